import type { ConvergencePoint, Job } from '../api/types';
import { isFinal } from '../api/types';
import { rampCss } from '../live/heat';
import { errorInWords, percent } from '../ui/format';

/**
 * The page's signature: how wrong the picture still is, on a logarithmic scale from noise (left) to clean (right).
 * The scale's colours are those of the error picture. Ghost marks are earlier estimates; the bar is the interval.
 */
export function ErrorRuler({ job, points }: { job: Job; points: ConvergencePoint[] }) {
  const error = job.error;
  const known = error?.relative_rmse != null;
  const target = job.spec.stop?.relative_error ?? null;
  const range = rangeFor(job, target);
  const at = (v: number): number =>
    100 * Math.min(1, Math.max(0, Math.log(range.high / v) / Math.log(range.high / range.low)));
  const low = error?.low ?? error?.relative_rmse ?? 0;
  const high = error?.high ?? error?.relative_rmse ?? 0;
  const interval = known && error?.low != null && error.high != null;
  const confidence = Math.round(100 * (error?.confidence ?? 0.95));
  const bias = error?.bias && error.bias !== 'none' ? error.bias : null;
  return (
    <section class="ruler" aria-label="Error of the picture">
      <div class="ruler-head">
        <p class="ruler-value" data-testid="error">
          <span class="ruler-label">Error</span>{' '}
          <strong>{known ? percent(error!.relative_rmse) : 'not known yet'}</strong>
          {interval && (
            <span class="ruler-interval">
              {' '}
              {percent(low)} to {percent(high)} with {confidence} % confidence
            </span>
          )}
        </p>
        <p class="ruler-words">
          {bias
            ? `This method is ${bias}: the error may be larger than shown.`
            : errorInWords(error?.relative_rmse)}
        </p>
      </div>
      <div class={`ruler-track${target ? ' ruler-aims' : ''}`} aria-hidden="true">
        <div class="ruler-scale" style={{ backgroundImage: rampCss('error', 'to left') }} />
        {known && <div class="ruler-todo" style={{ left: `${at(error!.relative_rmse!)}%` }} />}
        {ghosts(points).map((v, i) => (
          <i key={i} class="ruler-ghost" style={{ left: `${at(v)}%` }} />
        ))}
        {target && (
          <i class="ruler-target" style={{ left: `${at(target)}%` }}>
            <b>target {percent(target)}</b>
          </i>
        )}
        {interval && (
          <div class="ruler-bar" style={{ left: `${at(high)}%`, right: `${100 - at(low)}%` }} />
        )}
        {known && (
          <div
            class={`ruler-now${isFinal(job.state) ? '' : ' ruler-live'}`}
            style={{ left: `${at(error!.relative_rmse!)}%` }}
          />
        )}
      </div>
      <div class="ruler-ticks" aria-hidden="true">
        {ticksOf(range).map((v) => (
          <span key={v} style={{ left: `${at(v)}%` }}>
            {v >= 0.1 ? `${100 * v} %` : `${Number((100 * v).toPrecision(1))} %`}
          </span>
        ))}
      </div>
    </section>
  );
}

/** 100 % to 0.1 %, and further down by decades when the picture or its target is better than that. */
function rangeFor(job: Job, target: number | null): { low: number; high: number } {
  const best = Math.min(job.error?.low ?? 1, target ?? 1);
  let low = 0.001;
  while (best > 0 && best < low * 1.5 && low > 1e-6) low /= 10;
  return { low, high: 1 };
}

function ticksOf({ low, high }: { low: number; high: number }): number[] {
  const out: number[] = [];
  for (let v = high; v > low * 0.99; v /= 10) {
    out.push(v);
    if (low >= 0.001 && v / 3.3 > low) out.push(v * 0.3);
  }
  return out.map((v) => Number(v.toPrecision(1)));
}

/** Up to 24 earlier estimates. */
function ghosts(points: ConvergencePoint[]): number[] {
  const values = points.map((p) => p.relative_rmse).filter((v): v is number => v != null && v > 0);
  const step = Math.max(1, Math.ceil(values.length / 24));
  return values.filter((_, i) => i % step === 0);
}
