import { useEffect, useState } from 'preact/hooks';
import type { ExtendRequest, Job } from 'tessera-render';
import { api, imageUrl, RequestError } from '../../api/client';
import { isAvailable, isFinal } from '../../api/states';
import type { LinkState } from '../../live/feed_messages';
import type { JobFeed } from '../../live/job_feed';
import { count, counted, doneShare, duration, percent } from '../../ui/format';
import { Icon } from '../../ui/icons';
import { go, route } from '../../ui/router';
import { display, jobs, refresh, say, sayError, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { Menu } from '../menu';
import { sameSize, sizeText } from '../jobs/job_pick';
import { sceneTitle, stateLabel } from '../jobs/job_words';
import { orbitOf, storeAsUrl } from './picture_url';

/**
 * shown: encoded for display, with the page's exposure and tone curve; the others contain the
 * film's floats.
 */
const formatNotes: Record<string, { note: string; shown?: boolean }> = {
  png: { note: '8 bit, as shown here', shown: true },
  jpg: { note: 'small, as shown here', shown: true },
  webp: { note: 'small, as shown here', shown: true },
  avif: { note: 'small, as shown here', shown: true },
  exr: { note: 'linear floats, all layers' },
  hdr: { note: 'linear, Radiance' },
  tif: { note: 'linear floats' },
};

function Downloads({ job }: { job: Job }) {
  const shown = useStore(display);
  const info = useStore(serverInfo);
  const formats = info?.image_formats ?? ['png', 'exr'];
  const encoded = {
    exposure: shown.auto === false ? shown.exposure : 'auto',
    tonemap: shown.tone,
  };
  const base = `${sceneTitle(job).replace(/[^\w-]+/g, '-')}-${job.id.slice(0, 8)}`;
  return (
    <Menu
      label={
        <>
          <Icon name="download" /> Download
        </>
      }
      testId="download"
    >
      {formats.map((f) => (
        <a
          key={f}
          href={imageUrl(job.id, f, formatNotes[f]?.shown ? encoded : {})}
          download={`${base}.${f}`}
          data-testid={`download-${f}`}
        >
          <b>{f.toUpperCase()}</b> <span>{formatNotes[f]?.note}</span>
        </a>
      ))}
    </Menu>
  );
}

interface Extension {
  label: string;
  stop: ExtendRequest['stop'];
}

/** Offered extensions of an ended job, based on its current values. */
function extensions(job: Job, mostSamples: number): Extension[] {
  const samples = job.progress?.samples_per_pixel?.mean ?? 0;
  const error = job.error?.relative;
  const out: Extension[] = [];
  if (samples > 0)
    out.push({
      label: `Four times the samples (${count(4 * samples)})`,
      stop: { samples_per_pixel: Math.min(mostSamples, Math.round(4 * samples)) },
    });
  if (error)
    out.push({
      label: `Half the error (${percent(error / 2)})`,
      stop: { relative_error: Number((error / 2).toPrecision(3)) },
    });
  out.push({
    label: 'One more minute',
    stop: { seconds: Math.ceil((job.progress?.elapsed_seconds ?? 0) + 60) },
  });
  return out;
}

const canBeRetried = (job: Job): boolean =>
  job.state === 'failed' || (job.state === 'finished' && job.doubted && !job.merged);

const canBeExtended = (job: Job): boolean =>
  job.state === 'finished' && !job.doubted && !job.merged;

export function JobHeader({ feed, job, link }: { feed: JobFeed; job: Job; link: LinkState }) {
  const [busy, setBusy] = useState(false);
  const act = async (operation: () => Promise<Job | void>): Promise<void> => {
    setBusy(true);
    try {
      const answer = await operation();
      if (answer) feed.adopt(answer);
      void refresh();
    } catch (error) {
      if (error instanceof RequestError && error.status === 404) await feed.check();
      if (feed.state.link !== 'gone') sayError(error);
    } finally {
      setBusy(false);
    }
  };
  const running = !isFinal(job.state);
  const mostSamples = useStore(serverInfo)?.limits.samples_per_pixel ?? Infinity;
  const others = (useStore(jobs) ?? [])
    .filter((j) => j.id !== job.id && sameSize(j, job) && isAvailable(j, 'image'))
    .slice(0, 4);
  // Over plain HTTP browsers deny access to the clipboard: then the link is shown.
  const copy = async (link: string, done: string): Promise<void> => {
    const copied = await navigator.clipboard?.writeText(link).then(
      () => true,
      () => false,
    );
    say(copied ? done : link);
  };
  const copyLink = (): Promise<void> => {
    const { query } = route.get();
    const link = location.href.replace(/#.*/, `#/jobs/${job.id}${query && `?${query}`}`);
    return copy(link, 'Link copied.');
  };
  const copyUrl = (): Promise<void> =>
    act(async () => {
      const { name, url } = await storeAsUrl(job);
      await copy(url, `URL of the image copied. Its settings are the public preset ${name}.`);
    });
  if (link === 'gone')
    return (
      <header class="job-header">
        <div class="job-title">
          <h1>{sceneTitle(job)}</h1>
          <p role="alert">
            <span class="state state-failed" data-testid="state">
              This render no longer exists.
            </span>
            <span class="dim">It has been deleted. You are seeing a local copy.</span>
          </p>
        </div>
      </header>
    );
  return (
    <header class="job-header">
      <div class="job-title">
        <h1>{sceneTitle(job)}</h1>
        <p>
          <span class={`state state-${job.state}`} data-testid="state">
            {stateLabel(job)}
          </span>
          <span class="dim">{sizeText(job)}</span>
          <LinkNote link={link} running={running} />
        </p>
      </div>
      <ProgressLine job={job} />
      <div class="job-actions">
        {running &&
          job.pause_reason !== 'storage_full' &&
          (job.state === 'paused' ? (
            <button
              type="button"
              class="quiet"
              disabled={busy}
              data-testid="resume"
              onClick={() => act(() => api.patch(job.id, { paused: false }))}
            >
              <Icon name="play" /> Resume
            </button>
          ) : (
            <button
              type="button"
              class="quiet"
              disabled={busy}
              data-testid="pause"
              onClick={() => act(() => api.patch(job.id, { paused: true }))}
            >
              <Icon name="pause" /> Pause
            </button>
          ))}
        {running && (
          <button
            type="button"
            class="quiet"
            disabled={busy}
            data-testid="cancel"
            onClick={() => act(() => api.cancel(job.id))}
          >
            <Icon name="stop" /> Cancel
          </button>
        )}
        {canBeRetried(job) && (
          <button
            type="button"
            class="quiet"
            disabled={busy}
            data-testid="retry"
            onClick={() => act(() => api.retry(job.id))}
          >
            <Icon name="play" /> Try again
          </button>
        )}
        {canBeExtended(job) && (
          <Menu
            label={
              <>
                <Icon name="plus" /> Extend
              </>
            }
            testId="extend"
          >
            {extensions(job, mostSamples).map((e) => (
              <button
                key={e.label}
                type="button"
                data-closes
                onClick={() => act(() => api.extend(job.id, e.stop))}
              >
                {e.label}
              </button>
            ))}
          </Menu>
        )}
        {isAvailable(job, 'image') && <Downloads job={job} />}
        <Menu
          label={
            <>
              <Icon name="more" />
              <span class="visually-hidden">More</span>
            </>
          }
          testId="more"
          class="menu-icon"
        >
          <button type="button" data-closes onClick={copyLink}>
            <Icon name="link" /> Copy link
          </button>
          {isAvailable(job, 'image') && (
            <button
              type="button"
              data-closes
              data-testid="copy-url"
              disabled={!orbitOf(job.spec)}
              title={
                orbitOf(job.spec)
                  ? 'An address of the image for <img>, by a public preset'
                  : 'Only for views of your own: the file’s camera has no angles'
              }
              onClick={copyUrl}
            >
              <Icon name="link" /> Copy as URL
            </button>
          )}
          {others.map((o) => (
            <button
              key={o.id}
              type="button"
              data-closes
              onClick={() => go(`/compare/${job.id}/${o.id}`)}
            >
              <Icon name="compare" /> Compare with {sceneTitle(o)} {o.id.slice(0, 4)}
            </button>
          ))}
          {isAvailable(job, 'image') && (
            <a href={`#/compare/${job.id}`}>
              <Icon name="compare" /> Compare with another…
            </a>
          )}
          {!running && (
            <DeleteButton
              key={job.id}
              onDelete={() =>
                act(async () => {
                  await api.remove(job.id);
                  go('/');
                  say('Render deleted.');
                })
              }
            />
          )}
        </Menu>
      </div>
    </header>
  );
}

/** Deleting cannot be undone, so it needs a second press. */
function DeleteButton({ onDelete }: { onDelete: () => void }) {
  const [asked, setAsked] = useState(false);
  useEffect(() => {
    const timer = asked ? setTimeout(() => setAsked(false), 5000) : 0;
    return () => clearTimeout(timer);
  }, [asked]);
  return (
    <button
      type="button"
      class="danger"
      data-testid="delete"
      data-closes={asked ? '' : undefined}
      onClick={(e) => {
        if (asked) return onDelete();
        // The menu stays open.
        e.stopPropagation();
        setAsked(true);
      }}
    >
      <Icon name="trash" />
      <span aria-live="polite">{asked ? 'Delete permanently?' : 'Delete'}</span>
    </button>
  );
}

/** Shorter waits are not worth a word. */
const waitLeast = 10;

/** Time that a job spent in the queue or paused, if that is long. */
function waitedIn(job: Job): string {
  if (!job.finished_at) return '';
  const whole = (Date.parse(job.finished_at) - Date.parse(job.created_at)) / 1000;
  const waited = whole - (job.progress?.elapsed_seconds ?? 0);
  return waited >= waitLeast ? `, waited ${duration(waited)}` : '';
}

function ProgressLine({ job }: { job: Job }) {
  const p = job.progress;
  const fraction = p?.fraction ?? 0;
  const running = !isFinal(job.state);
  const text = running
    ? doneShare(fraction) +
      (p?.eta_seconds != null && job.state === 'rendering'
        ? `, about ${duration(p.eta_seconds)} left`
        : '')
    : p?.samples_per_pixel?.mean
      ? `${counted(p.samples_per_pixel.mean, 'sample')} in ${duration(p.elapsed_seconds)} ` +
        `(CPU ${duration(p.cpu_seconds)}${waitedIn(job)})`
      : '';
  return (
    <div class="progress-line">
      {running && <progress max={1} value={fraction} aria-label="Progress" />}
      <span
        class="mono"
        data-testid="progress"
        title={
          running && p?.eta_interval_seconds
            ? `${duration(p.eta_interval_seconds[0])} to ` +
              `${duration(p.eta_interval_seconds[1])} left at this pace`
            : undefined
        }
      >
        {text}
      </span>
    </div>
  );
}

function LinkNote({ link, running }: { link: LinkState; running: boolean }) {
  if (link === 'reconnecting' && running)
    return (
      <span class="link-note" role="status">
        Reconnecting…
      </span>
    );
  if (link === 'overloaded')
    return (
      <span class="link-note" role="status">
        Too many viewers right now; retrying.
      </span>
    );
  return null;
}
