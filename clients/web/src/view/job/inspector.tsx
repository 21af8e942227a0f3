import { Fragment } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import type { Job, Pixel, PixelLayer } from 'tessera-render';
import { api } from '../../api/client';
import { isAvailable, isFinal } from '../../api/states';
import type { LiveFilm } from '../../live/film';
import { toBytes } from '../../live/tone';
import { counted, measured, number } from '../../ui/format';
import { display } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { HalfHistogram } from './half_histogram';
import type { Probe } from './stage';

/** Unknown numbers are NaN. */
const asList = (v: (number | null)[] | undefined): number[] => (v ?? []).map((x) => x ?? NaN);

/**
 * The server's values of one pixel; requested when the pointer rests, and again while a pinned
 * pixel changes.
 */
function usePixel(job: Job, probe: Probe | null): Pixel | null {
  const [report, setReport] = useState<Pixel | null>(null);
  const ready = isAvailable(job, 'image');
  const beat =
    probe?.pinned && !isFinal(job.state) ? Math.floor((job.progress?.elapsed_seconds ?? 0) / 2) : 0;
  useEffect(() => {
    if (!probe || !ready) return setReport(null);
    const abort = new AbortController();
    const timer = setTimeout(
      () => {
        api
          .pixel(job.id, probe.x, probe.y, abort.signal)
          .then(setReport)
          .catch(() => undefined);
      },
      probe.pinned ? 20 : 160,
    );
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  }, [job.id, job.state, ready, probe?.x, probe?.y, probe?.pinned, beat]);
  return report && probe && report.x === probe.x && report.y === probe.y ? report : null;
}

export function Inspector({
  job,
  film,
  probe,
  onRelease,
}: {
  job: Job;
  film: LiveFilm | null;
  probe: Probe | null;
  onRelease: () => void;
}) {
  const report = usePixel(job, probe);
  return (
    <section class="card inspector" aria-labelledby="inspector-title" data-testid="inspector">
      <header class="card-head">
        <h2 id="inspector-title">Pixel</h2>
        {probe && (
          <span class="mono dim">
            {probe.x}, {probe.y}
          </span>
        )}
        {probe?.pinned && (
          <button type="button" class="link" onClick={onRelease}>
            Unpin
</button>
        )}
      </header>
      {probe ? (
        <Reading film={film} probe={probe} report={report} />
      ) : (
        <p class="hint">
          {matchMedia('(hover: none)').matches
            ? 'Tap the image to read a pixel.'
            : 'Hover to read a pixel; click to pin it.'}
        </p>
      )}
    </section>
  );
}

function Reading({
  film,
  probe,
  report,
}: {
  film: LiveFilm | null;
  probe: Probe;
  report: Pixel | null;
}) {
  const shown = useStore(display);
  const index = film ? probe.y * film.width + probe.x : -1;
  const local =
    film && film.samples[index] > 0 ? [...film.rgb.subarray(3 * index, 3 * index + 3)] : null;
  const beauty = report?.layers.beauty;
  const mean = beauty ? asList(beauty.mean) : local;
  if (!mean) return <p class="hint">No sample here yet.</p>;
  const samples = report?.samples ?? film?.samples[index];
  const colour = new Uint8ClampedArray(4);
  toBytes(
    mean[0],
    mean[1] ?? mean[0],
    mean[2] ?? mean[0],
    2 ** shown.exposure,
    shown.tone,
    colour,
    0,
  );
  const layers = Object.entries(report?.layers ?? {}).filter(
    ([name]) => name === 'albedo' || name === 'normal' || name === 'depth',
  );
  return (
    <div class="reading">
      <div
        class="swatch"
        style={{ backgroundColor: `rgb(${colour[0]} ${colour[1]} ${colour[2]})` }}
        aria-hidden="true"
      />
      <dl class="channels">
        {['R', 'G', 'B'].map((name, c) => (
          <Channel key={name} name={name} c={c} mean={mean[c]} layer={beauty} />
        ))}
      </dl>
      {film && <HalfHistogram film={film} x={probe.x} y={probe.y} />}
      <p class="hint mono">
        {counted(samples, 'sample')}
        {layers.map(([name, layer]) => (
          <Fragment key={name}>
            {' · '}
            <span class="whole">
              {name}{' '}
              {asList(layer.mean)
                .map((v) => number(v, 2))
                .join(' ')}
            </span>
          </Fragment>
        ))}
      </p>
    </div>
  );
}

/**
 * One channel: mean, half width of its interval, and the interval drawn with both halves as ticks.
 */
function Channel({
  name,
  c,
  mean,
  layer,
}: {
  name: string;
  c: number;
  mean: number;
  layer?: PixelLayer;
}) {
  const low = asList(layer?.low)[c],
    high = asList(layer?.high)[c];
  const halves = (layer?.halves ?? [])
    .map((h) => asList(h)[c])
    .filter((v) => Number.isFinite(v));
  const known = Number.isFinite(low) && Number.isFinite(high) && high > low;
  const values = known ? [low, high, mean, ...halves] : [];
  const from = Math.min(...values),
    to = Math.max(...values);
  const pad = (to - from) * 0.12 || 1;
  const [value, half] = known ? measured(mean, (high - low) / 2) : [number(mean, 4), ''];
  const at = (v: number): string => `${(100 * (v - from + pad)) / (to - from + 2 * pad)}%`;
  return (
    <div class={`channel channel-${name.toLowerCase()}`}>
      <dt>{name}</dt>
      <dd>
        <span class="mono">
          {value}
          {known && <span class="dim"> ± {half}</span>}
        </span>
        {known && (
          <span
            class="whisker"
            title={
              `95% interval ${number(low, 3)} to ${number(high, 3)}; ` +
              'the two short marks are the independent halves'
            }
          >
            <i class="whisker-bar" style={{ left: at(low), right: `calc(100% - ${at(high)})` }} />
            {halves.map((v, i) => (
              <i key={i} class="whisker-half" style={{ left: at(v) }} />
            ))}
            <i class="whisker-mean" style={{ left: at(mean) }} />
          </span>
        )}
      </dd>
    </div>
  );
}
