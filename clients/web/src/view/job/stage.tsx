import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { filmOf, isFinal } from '../../api/states';
import type { JobFeed, FeedState } from '../../live/job_feed';
import { Picture } from '../../live/picture';
import { display } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { DenoisedImage, useDenoised, type DenoisedError } from './denoised_image';
import { IrradianceImage } from './irradiance_image';
import { ServerImage } from './server_image';
import { samplesRange, varianceRange } from './film_reading';
import { FirstLook } from './first_look';
import { Legend, LuxLegend, unitOf } from './legend';
import { LackingTiles } from './light_not_found';
import type { LuxScale } from './lux';
import { TileFlashes } from './tile_flashes';
import { isHeat, isLayer, lookOf, planeModes, type Mode, type Range } from './view_modes';
import { useViewport, type Viewport } from './viewport';
import { WorkerTiles } from './worker_tiles';

export interface Probe {
  x: number;
  y: number;
  pinned: boolean;
}

interface StageProps {
  feed: JobFeed;
  state: FeedState;
  mode: Mode;
  probe: Probe | null;
  onProbe: (probe: Probe | null) => void;
  onDenoised?: (error: DenoisedError | null) => void;
}

function meaningOf(mode: Mode, correlated: boolean): string {
  const { meaning } = planeModes.find((m) => m.mode === mode)!;
  return correlated && mode !== 'samples'
    ? `${meaning} Errors of neighbouring pixels hang together here.`
    : meaning;
}

const sameRange = (a: Range, b: Range): boolean => a.low === b.low && a.high === b.high;

/** Ranges of the colour ramps, updated occasionally while the film changes. */
function useRanges(state: FeedState, mode: Mode) {
  const [ranges, setRanges] = useState({
    variance: { low: 1e-6, high: 1 },
    samples: { low: 1, high: 2 },
  });
  const { film } = state;
  useEffect(() => {
    if (!film || !isHeat(mode)) return;
    const read = (): void =>
      setRanges((old) => {
        const next = { variance: varianceRange(film), samples: samplesRange(film) };
        return sameRange(old.variance, next.variance) && sameRange(old.samples, next.samples)
          ? old
          : next;
      });
    read();
    let seen = film.version;
    const timer = setInterval(() => film.version !== seen && ((seen = film.version), read()), 1000);
    return () => clearInterval(timer);
  }, [film, mode]);
  return ranges;
}

/** Whether the background of the image is transparent. */
const isClear = (job: Job | null): boolean => job?.spec.background?.type === 'transparent';

const nobody = (): void => undefined;

export function Stage({ feed, state, mode, probe, onProbe, onDenoised = nobody }: StageProps) {
  const { job, film } = state;
  const canvas = useRef<HTMLCanvasElement>(null);
  const box = useRef<HTMLDivElement>(null);
  const picture = useRef<Picture | null>(null);
  const shown = useStore(display);
  const ranges = useRanges(state, mode);
  const size = job ? filmOf(job) : { width: 16, height: 9 };
  const view = useViewport(
    box,
    size,
    (x, y, pinned) => onProbe({ x, y, pinned }),
    () => onProbe(null),
    probe,
  );
  const look = lookOf(mode, shown, ranges);
  const [luxScale, setLuxScale] = useState<LuxScale | null>(null);
  const denoised = useDenoised(job) && mode === 'picture' && !state.tooLarge;

  useLayoutEffect(() => {
    if (!film || !canvas.current) return;
    picture.current = new Picture(canvas.current, film, look);
    return () => picture.current?.dispose();
  }, [film]);
  useEffect(
    () => picture.current?.show(isLayer(mode) ? 'picture' : mode, look),
    [film, mode, look.exposure, look.tone, look.low, look.high],
  );

  return (
    <div class="stage-frame">
      <div
        class="stage"
        ref={box}
        tabIndex={0}
        role="group"
        aria-roledescription="image viewer"
        aria-label="Image. Arrow keys move the pixel probe, plus and minus zoom, 0 fits."
        style={{ '--aspect': `${size.width} / ${size.height}` }}
      >
        <div
          class={['film', view.scale > 2.5 && 'film-pixels', isClear(job) && 'film-clear']
            .filter(Boolean)
            .join(' ')}
          style={view.style}
        >
          {job && mode === 'picture' && !state.tooLarge && (
            <FirstLook key={`look-${job.id}`} feed={feed} job={job} film={film} />
          )}
          <canvas
            ref={canvas}
            key={job?.id}
            data-testid="picture"
            role="img"
            aria-label={`Render of ${job?.spec.scene ?? 'the scene'}`}
            hidden={state.tooLarge}
          />
          {job && mode === 'irradiance' && (
            <IrradianceImage key={job.id} job={job} large={state.tooLarge} onScale={setLuxScale} />
          )}
          {job && mode !== 'irradiance' && (state.tooLarge || isLayer(mode)) && (
            <ServerImage job={job} mode={mode} large={state.tooLarge} />
          )}
          {job && denoised && <DenoisedImage key={job.id} job={job} onError={onDenoised} />}
          {job && film && shown.showTiles && mode === 'picture' && (
            <TileFlashes
              feed={feed}
              width={size.width}
              height={size.height}
              active={!isFinal(job.state)}
            />
          )}
          {job && mode === 'picture' && (
            <LackingTiles
              job={job}
              width={size.width}
              height={size.height}
              left={job.spec.film?.crop?.x}
              top={job.spec.film?.crop?.y}
            />
          )}
          {job && shown.showWorkers && !isFinal(job.state) && (
            <WorkerTiles job={job.id} width={size.width} height={size.height} />
          )}
        </div>
        {probe && <ProbeMark probe={probe} view={view} />}
        {job && <StageNotice state={state} />}
        {view.zoomed && (
          <button type="button" class="stage-fit" onClick={view.reset}>
            {Math.round(view.scale * 100)}% · fit
          </button>
        )}
      </div>
      {isHeat(mode) && film && film.tilesSeen > 0 && (
        <Legend look={look} meaning={meaningOf(mode, film.correlated)} unit={unitOf(mode)} />
      )}
      {mode === 'irradiance' && luxScale && (
        <LuxLegend
          meaning="Light arriving at the surfaces, whatever their colour."
          scale={luxScale}
          values="pixels"
        />
      )}
    </div>
  );
}

function ProbeMark({ probe, view }: { probe: Probe; view: Viewport }) {
  const at = view.toBox(probe.x + 0.5, probe.y + 0.5);
  const side = Math.max(9, view.scale + 2);
  return (
    <div
      class={`probe${probe.pinned ? ' probe-pinned' : ''}`}
      style={{ left: `${at.x}px`, top: `${at.y}px`, width: `${side}px`, height: `${side}px` }}
      aria-hidden="true"
    />
  );
}

/** States without an image yet, or without further updates. */
function StageNotice({ state }: { state: FeedState }) {
  const job = state.job!;
  const empty = !state.tooLarge && !job.revision && !(state.film && state.film.tilesSeen > 0);
  if (job.state === 'failed') {
    return (
      <div class="stage-notice notice-failed" role="alert">
        <strong>{job.failure?.title ?? 'The render failed.'}</strong>
        {job.failure?.detail && <p>{job.failure.detail}</p>}
        {job.failure?.errors?.map((e) => (
          <p key={e.pointer}>
            <code>{e.pointer}</code> {e.detail}
          </p>
        ))}
      </div>
    );
  }
  if (!empty) return null;
  const text = {
    queued: job.queue_position ? `Queued, ${job.queue_position} ahead.` : 'Queued.',
    loading: 'Loading the scene.',
    rendering: 'Waiting for the first tiles…',
    paused: 'Paused before the first tile.',
    finished: 'Fetching the image.',
    cancelled: 'Cancelled before the first tile.',
    failed: '',
  }[job.state];
  return (
    <div class="stage-notice">
      <span class={job.state === 'cancelled' || job.state === 'paused' ? '' : 'pulse'}>{text}</span>
    </div>
  );
}
