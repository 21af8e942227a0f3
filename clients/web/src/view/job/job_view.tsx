import { useEffect, useReducer, useRef, useState } from 'preact/hooks';
import type { Convergence, Job } from 'tessera-render';
import { api } from '../../api/client';
import { isFinal } from '../../api/states';
import type { TilePlanes } from '../../live/feed_messages';
import { JobFeed } from '../../live/job_feed';
import { doneShare } from '../../ui/format';
import { choiceIn, keepChoice, route, type Route } from '../../ui/router';
import { Later } from '../../ui/later';
import { connection, jobs, refresh } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { ConvergencePlot } from './convergence_plot';
import type { DenoisedError } from './denoised_image';
import { ErrorRuler } from './error_ruler';
import { Filmstrip } from './filmstrip';
import { Inspector } from './inspector';
import { JobHeader } from './job_header';
import { JobSettings } from './job_settings';
import { absence, sceneTitle } from '../jobs/job_words';
import { MeterTable } from './meter_table';
import { Stage, type Probe } from './stage';
import { Statistics } from './statistics';
import { StrategyPyramid } from './strategy_pyramid';
import { Toolbar } from './toolbar';
import { modeNamed, planesOf, type Mode } from './view_modes';

/**
 * Keeps the job's feed open while the component is mounted, and redraws it when the feed changes.
 */
export function useFeed(jobId: string, planes: TilePlanes | null): JobFeed {
  const [, again] = useReducer<number, void>((n) => n + 1, 0);
  const holder = useRef<JobFeed | null>(null);
  if (holder.current?.jobId !== jobId) {
    holder.current?.close();
    const known = jobs.get()?.find((j) => j.id === jobId);
    holder.current = new JobFeed(jobId, planes, known ?? null);
  }
  const feed = holder.current;
  const drawn = feed.state;
  useEffect(() => {
    if (feed.state !== drawn) again();
    return feed.subscribe(() => again());
  }, [feed]);
  useEffect(
    () => () => {
      holder.current?.close();
      holder.current = null;
    },
    [],
  );
  return feed;
}

/** A render that failed before its first tile has nothing to measure. */
const shows = (job: Job): boolean =>
  job.spec.film !== null && (job.state !== 'failed' || (job.revision ?? 0) > 0);

/**
 * An ended job has no stream, but disappears from the list when it is deleted. The list also lacks
 * old jobs, so each one that does is a reason to ask again, not an answer.
 */
function useListWatch(feed: JobFeed): void {
  const list = useStore(jobs);
  useEffect(() => {
    const { job, link } = feed.state;
    const mayBeGone = job && isFinal(job.state) && link !== 'gone';
    if (mayBeGone && list && !list.some((j) => j.id === feed.jobId)) void feed.check();
  }, [feed, list]);
}

const askEveryMs = 2000;

/**
 * The error over time. While the job renders it is requested after new tiles, at most every two
 * seconds.
 */
function useConvergence(job: Job | null): Convergence | null {
  const [data, setData] = useState<Convergence | null>(null);
  const revision = useRef(0);
  revision.current = job?.revision ?? 0;
  const id = job?.id,
    state = job?.state;
  useEffect(() => {
    if (!id || !state) return;
    const abort = new AbortController();
    let asked = -1;
    const ask = (): void => {
      if (revision.current === asked || document.hidden) return;
      asked = revision.current;
      api
        .convergence(id, abort.signal)
        .then(setData)
        .catch(() => (asked = -1));
    };
    ask();
    const timer = isFinal(state) ? 0 : setInterval(ask, askEveryMs);
    return () => {
      clearInterval(timer);
      abort.abort();
    };
  }, [id, state]);
  return data;
}

function probeIn(at: Route): Probe | null {
  const [, x, y] = /^(\d{1,5}),(\d{1,5})$/.exec(choiceIn(at, 'pixel')) ?? [];
  return y ? { x: Number(x), y: Number(y), pinned: true } : null;
}

/** The inspected pixel. A pinned one is also in the address. */
function useProbe(jobId: string): [Probe | null, (probe: Probe | null) => void] {
  const [probe, setProbe] = useState<Probe | null>(() => probeIn(route.get()));
  const first = useRef(true);
  useEffect(() => {
    if (!first.current) setProbe(probeIn(route.get()));
    first.current = false;
  }, [jobId]);
  const kept = probe?.pinned ? `${probe.x},${probe.y}` : '';
  useEffect(() => {
    // Browsers limit how often an address may change, and keys repeat faster.
    const timer = setTimeout(() => {
      if (choiceIn(route.get(), 'pixel') !== kept) keepChoice('pixel', kept);
    }, 300);
    return () => clearTimeout(timer);
  }, [kept, jobId]);
  return [probe, setProbe];
}

const showMode = (next: Mode): void => keepChoice('show', next === 'picture' ? '' : next);

export function JobView({ jobId }: { jobId: string }) {
  const feed = useFeed(jobId, null);
  const { state } = feed;
  const { job, link, film } = state;
  const mode = modeNamed(choiceIn(useStore(route), 'show'));
  const [probe, setProbe] = useProbe(jobId);
  const planes = probe ? 'all' : planesOf(mode);
  useEffect(() => {
    if (planes) feed.want(planes);
  }, [feed, planes]);
  const convergence = useConvergence(job);
  const [denoised, setDenoised] = useState<DenoisedError | null>(null);
  useListWatch(feed);
  // The stream is often the first to notice that the server is back.
  useEffect(() => {
    if (link === 'live' && connection.get() === 'offline') void refresh();
  }, [link]);
  useEffect(() => {
    const percent =
      job && !isFinal(job.state) && link !== 'gone'
        ? `${doneShare(job.progress?.fraction ?? 0)} `
        : '';
    document.title = job ? `${percent}${sceneTitle(job)} · Tessera` : 'Tessera';
    return () => void (document.title = 'Tessera');
  }, [job?.state, job?.progress?.fraction, link]);

  const missing = absence(state);
  if (missing) {
    return (
      <div class="center-note" role="alert">
        <h1>{missing.title}</h1>
        <p>{missing.why}</p>
        <a class="quiet" href="#/">
          Back to the newest render
        </a>
      </div>
    );
  }
  return (
    <div class="job-view">
      <div class="job-main">
        {job ? (
          <JobHeader feed={feed} job={job} link={link} />
        ) : (
          <header class="job-header">
            <div class="job-title">
              <h1 class="dim">
                {link === 'reconnecting'
                  ? 'Waiting for the server…'
                  : link === 'overloaded'
                    ? 'Too many viewers right now; retrying.'
                    : 'Opening…'}
              </h1>
            </div>
          </header>
        )}
        {job?.spec.film === null ? (
          <MeterTable key={job.id} job={job} />
        ) : (
          <>
            <Stage
              feed={feed}
              state={state}
              mode={mode}
              probe={probe}
              onProbe={setProbe}
              onDenoised={setDenoised}
            />
            <Toolbar
              job={job}
              mode={mode}
              film={film}
              tooLarge={state.tooLarge}
              onMode={showMode}
            />
          </>
        )}
        {job && shows(job) && (
          <Later>
            <ErrorRuler job={job} points={convergence?.points ?? []} denoised={denoised} />
          </Later>
        )}
        <Later>
          <Filmstrip current={jobId} />
        </Later>
      </div>
      <aside class="measures" aria-label="Measurements">
        {job && shows(job) && (
          <Later>
            <ConvergencePlot job={job} data={convergence} />
          </Later>
        )}
        {job && shows(job) && (
          <Later>
            <Inspector job={job} film={film} probe={probe} onRelease={() => setProbe(null)} />
          </Later>
        )}
        {job && shows(job) && (
          <Later>
            <StrategyPyramid job={job} mode={mode} onMode={showMode} />
          </Later>
        )}
        {job?.spec.meter && job.spec.film && (
          <Later>
            <MeterTable key={job.id} job={job} />
          </Later>
        )}
        {job && (
          <Later>
            <Statistics job={job} />
          </Later>
        )}
        {job && (
          <Later>
            <JobSettings job={job} />
          </Later>
        )}
      </aside>
    </div>
  );
}
