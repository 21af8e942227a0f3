import { useEffect, useRef, useState } from 'preact/hooks';
import type { Batch, BatchJob, BatchSummary, Flicker, Job, JobState } from 'tessera-render';
import { api, explain, imageUrl, relative, RequestError } from '../../api/client';
import { isFinal } from '../../api/states';
import { ago, doneShare, percent } from '../../ui/format';
import { go } from '../../ui/router';
import { display, sayError, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { denoiseModes } from '../job/denoised_image';

const lookMs = 1000;
const formats = ['png', 'jpg', 'webp', 'exr'] as const;

const ended = (state: string): boolean => isFinal(state as JobState);

const stateWords: Record<BatchSummary['state'], string> = {
  queued: 'Waiting',
  rendering: 'Rendering',
  paused: 'Paused',
  failed: 'Ended; some images failed',
  cancelled: 'Cancelled',
  finished: 'Finished',
};

/** The current state of the series, requested until it ends; or why it does not exist. */
function useSeries(id: string) {
  const [batch, setBatch] = useState<Batch | null>(null);
  const [fault, setFault] = useState('');
  const [asked, ask] = useState(0);
  useEffect(() => {
    let timer = 0;
    const abort = new AbortController();
    const again = (): void => void (timer = window.setTimeout(look, lookMs));
    const look = (): void =>
      void api.batch(id, abort.signal).then(
        (found) => {
          setBatch(found);
          setFault('');
          if (!ended(found.state)) again();
        },
        (error: unknown) => {
          if (abort.signal.aborted) return;
          setFault(explain(error));
          if (!(error instanceof RequestError)) again();
        },
      );
    look();
    return () => {
      abort.abort();
      clearTimeout(timer);
    };
  }, [id, asked]);
  return { batch, fault, renew: () => ask((n) => n + 1) };
}

/** The pattern of its names without the placeholders and their separators. */
const titleOf = ({ name }: Batch): string =>
  name.replace(/[\s\-_.,·]*\{[^}]*\}( s\b)?[\s\-_.,·]*/g, ' ').trim();

/** A job of the series, for the settings that all share. */
function useFirstJob(batch: Batch): Job | null {
  const [job, setJob] = useState<Job | null>(null);
  const id = batch.jobs[0]?.id;
  useEffect(() => {
    if (!id) return;
    const abort = new AbortController();
    api.job(id, abort.signal).then(setJob, (error: unknown) => {
      if (!abort.signal.aborted) sayError(error);
    });
    return () => abort.abort();
  }, [id]);
  return job;
}

type SeriesMode = NonNullable<ReturnType<typeof display.get>['seriesMode']>;

const seriesModes: Record<SeriesMode, { label: string; meaning: string }> = {
  ...denoiseModes,
  video: {
    label: 'Video',
    meaning:
      'Averaged with the images before and after it along the motion, so that it holds still',
  },
};

/** Whether its images are frames: of a moving camera or of an animation. */
const isVideo = ({ jobs }: Batch): boolean =>
  jobs.length > 1 &&
  Object.keys(jobs[0]?.values ?? {}).some((key) => /^(camera\b|time_seconds$)/.test(key));

const flickerMeaning =
  'By how much the error changes from one image to the next, with its 95% interval';
const flickerText = ({ relative: r, low, high }: Flicker): string =>
  `flicker ${percent(r)} (${percent(low)} to ${percent(high)})`;

interface Denoising {
  may: boolean;
  modes: SeriesMode[];
  mode: SeriesMode;
  denoise: SeriesMode | 'off';
}

/** Whether and how its images can be denoised, and what is selected. */
function useDenoising(batch: Batch, first: Job | null): Denoising {
  const { denoised, seriesMode = 'mixed' } = useStore(display);
  const offered = useStore(serverInfo)?.layers?.includes('denoised') ?? false;
  const may = offered && first !== null && first.spec.denoise?.type !== 'none';
  // Its frames are averaged once all have ended.
  const modes: SeriesMode[] =
    ended(batch.state) && isVideo(batch) ? ['mixed', 'full', 'video'] : ['mixed', 'full'];
  const mode = modes.includes(seriesMode) ? seriesMode : 'mixed';
  return { may, modes, mode, denoise: may && denoised !== false ? mode : 'off' };
}

export function SeriesView({ id }: { id: string }) {
  const { batch, fault, renew } = useSeries(id);
  if (!batch)
    return (
      <div class="center-note">
        {fault ? (
          <>
            <h1>This series is not here.</h1>
            <p>{fault}</p>
          </>
        ) : (
          <p class="pulse">Loading…</p>
        )}
      </div>
    );
  return <Series batch={batch} fault={fault} onChange={renew} />;
}

interface SeriesProps {
  batch: Batch;
  fault: string;
  onChange: () => void;
}

function Series({ batch, fault, onChange }: SeriesProps) {
  const first = useFirstJob(batch);
  const timer = useRef(0);
  // It is known as the images are made.
  const tellFlicker = (): void => {
    clearTimeout(timer.current);
    timer.current = window.setTimeout(onChange, lookMs);
  };
  useEffect(() => () => clearTimeout(timer.current), []);
  const denoising = useDenoising(batch, first);
  const { flicker } = batch;
  const film = first?.spec.film;
  const count = `${batch.jobs.length} images`;
  const title = titleOf(batch);
  return (
    <div class="page" data-testid="series">
      <header class="page-head">
        <div>
          <h1>{title || count}</h1>
          <p class="dim">
            <span role="status" data-testid="series-state">
              {stateWords[batch.state]}
              {!ended(batch.state) && `: ${doneShare(batch.progress.fraction)}`}
            </span>
            {title && ` · ${count}`}
            {denoising.denoise === 'video' && flicker && (
              <span data-testid="flicker" title={flickerMeaning}>
                {` · ${flickerText(flicker)}`}
              </span>
            )}
          </p>
        </div>
        {!ended(batch.state) && (
          <progress max={1} value={batch.progress.fraction} aria-label="Progress of the series" />
        )}
        <SeriesActions batch={batch} denoising={denoising} onChange={onChange} />
      </header>
      {fault && (
        <p class="wrong" role="alert">
          {fault}
        </p>
      )}
      {batch.state === 'finished' && batch.jobs.length > 1 && (
        <VideoCommand
          id={batch.id}
          denoise={denoising.denoise !== 'off' && isVideo(batch) ? 'video' : denoising.denoise}
        />
      )}
      <ul
        class={`job-grid${first?.spec.background?.type === 'transparent' ? ' on-white' : ''}`}
        style={film ? { '--thumb-ratio': `${film.width} / ${film.height}` } : undefined}
      >
        {batch.jobs.map((job) => (
          <SeriesCard
            key={job.id}
            job={job}
            denoise={denoising.denoise}
            onShown={denoising.denoise === 'video' ? tellFlicker : undefined}
          />
        ))}
      </ul>
    </div>
  );
}

/** Instructions for a video: the server has no encoder, the command line uses ffmpeg. */
function VideoCommand({ id, denoise }: { id: string; denoise: string }) {
  const command =
    `tessera batch ${id} --video turn.mp4 --fps 12` +
    `${denoise === 'off' ? '' : ` --denoise ${denoise}`} --server ${location.origin}`;
  return (
    <details class="advanced series-video">
      <summary>Video</summary>
      <div class="advanced-body">
        <p class="hint">
          This command writes the images as the frames of a video, with ffmpeg on your machine. In
          Python, <code>batch.video('turn.mp4')</code> does the same.
        </p>
        <pre class="settings-text" tabIndex={0} aria-label="Command" data-testid="video-command">
          {command}
        </pre>
      </div>
    </details>
  );
}

interface ActionsProps {
  batch: Batch;
  denoising: ReturnType<typeof useDenoising>;
  onChange: () => void;
}

function SeriesActions({
  batch,
  denoising: { may, modes, mode, denoise },
  onChange,
}: ActionsProps) {
  const [format, setFormat] = useState<string>('png');
  // EXR contains every layer, which a denoised image does not have.
  const hasLayers = format === 'exr';
  const [sure, setSure] = useState(false);
  const [busy, setBusy] = useState(false);
  const act = async (step: () => Promise<unknown>): Promise<void> => {
    setBusy(true);
    await step().then(onChange, sayError);
    setBusy(false);
  };
  if (!ended(batch.state))
    return (
      <div class="job-actions">
        <button
          type="button"
          class="quiet"
          disabled={busy}
          onClick={() => void act(() => api.cancelBatch(batch.id))}
        >
          Cancel all
        </button>
      </div>
    );
  return (
    <div class="job-actions">
      {batch.counts.failed > 0 && (
        <button
          type="button"
          class="quiet"
          disabled={busy}
          onClick={() => void act(() => api.retryBatch(batch.id))}
        >
          Try failed ones again
        </button>
      )}
      <label>
        <span class="visually-hidden">Format of the images</span>
        <select value={format} onChange={(e) => setFormat(e.currentTarget.value)}>
          {formats.map((f) => (
            <option key={f} value={f}>
              {f.toUpperCase()}
            </option>
          ))}
        </select>
      </label>
      {may && !hasLayers && (
        <>
          <label class="check" title="Off: the images as rendered">
            <input
              type="checkbox"
              checked={denoise !== 'off'}
              data-testid="series-denoised"
              onChange={(e) => display.set({ ...display.get(), denoised: e.currentTarget.checked })}
            />
            Denoised
          </label>
          <label>
            <span class="visually-hidden">Denoised images</span>
            <select
              title={seriesModes[mode].meaning}
              value={mode}
              disabled={denoise === 'off'}
              data-testid="series-mode"
              onChange={(e) =>
                display.set({ ...display.get(), seriesMode: e.currentTarget.value as SeriesMode })
              }
            >
              {modes.map((name) => (
                <option key={name} value={name}>
                  {seriesModes[name].label}
                </option>
              ))}
            </select>
          </label>
        </>
      )}
      <a
        class="quiet"
        data-testid="archive"
        href={
          `${relative(batch.links.archive)}?format=${format}` +
          `&denoise=${hasLayers ? 'off' : denoise}`
        }
        download
      >
        Download zip
      </a>
      <a
        class="quiet"
        href={`${relative(batch.links.sheet)}?denoise=${denoise}`}
        target="_blank"
        rel="noopener"
      >
        Contact sheet
      </a>
      <button
        type="button"
        class="quiet"
        disabled={busy}
        onBlur={() => setSure(false)}
        onClick={() =>
          sure ? void api.removeBatch(batch.id).then(() => go('/jobs'), sayError) : setSure(true)
        }
      >
        {sure ? 'Delete all images?' : 'Delete'}
      </button>
    </div>
  );
}

/** A value of an axis, as names of jobs have it. */
const wordsOf = (value: unknown): string =>
  value === null
    ? 'default'
    : typeof value === 'object'
      ? Object.values(value).map(wordsOf).join('x')
      : String(value);

/** Whether a job that has not ended has an image: from its first samples. */
const isBegun = (job: BatchJob): boolean =>
  (job.state === 'rendering' || job.state === 'paused') && job.revision > 0;

interface CardProps {
  job: BatchJob;
  denoise: string;
  onShown: (() => void) | undefined;
}

function SeriesCard({ job, denoise, onShown }: CardProps) {
  // Values that are not part of its name.
  const values = Object.values(job.values)
    .map(wordsOf)
    .filter((value) => !job.name.includes(value))
    .join(' · ');
  const state = job.state === 'finished' ? '' : job.state;
  return (
    <li class="job-card">
      <a href={`#/jobs/${job.id}`}>
        <span class="thumb">
          {job.state === 'finished' || isBegun(job) ? (
            <img
              src={imageUrl(job.id, 'png', {
                max_size: 400,
                ...(job.state === 'finished' ? { denoise } : { revision: job.revision }),
              })}
              alt=""
              onLoad={onShown}
              decoding="async"
              loading="lazy"
            />
          ) : (
            <span class={`thumb-empty thumb-${job.state}`} />
          )}
          {job.state === 'rendering' && (
            <i class="thumb-progress" style={{ width: `${100 * job.fraction}%` }} />
          )}
        </span>
        <strong>{job.name}</strong>
      </a>
      <p class="dim">{[values, state].filter(Boolean).join(' · ')}</p>
    </li>
  );
}

const listed = 6;

/** Links to the newest series; nothing if there is none. */
export function SeriesLinks() {
  const [batches, setBatches] = useState<BatchSummary[]>([]);
  useEffect(() => {
    const abort = new AbortController();
    api.batches(listed, abort.signal).then(
      (page) => setBatches(page.batches),
      () => undefined,
    );
    return () => abort.abort();
  }, []);
  if (!batches.length) return null;
  return (
    <nav class="series-links" aria-label="Series">
      <span class="dim">Series</span>
      {batches.map((b) => (
        <a key={b.id} href={`#/series/${b.id}`}>
          {Object.values(b.counts).reduce((sum, n) => sum + n, 0)} images, {ago(b.created_at)}
        </a>
      ))}
    </nav>
  );
}
