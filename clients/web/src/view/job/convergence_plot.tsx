import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { Convergence, ConvergencePoint, Job } from 'tessera-render';
import { isFinal } from '../../api/states';
import { takeTurn } from '../../live/turns';
import { count, counted, duration, number, percent } from '../../ui/format';
import { Later } from '../../ui/later';
import { biasOf, isNoiseAlone } from './bias';

type Axis = 'samples' | 'seconds';
type Known = ConvergencePoint & { relative: number };

const height = 190;
const margin = { left: 54, right: 12, top: 10, bottom: 30 };
const xOf = (p: ConvergencePoint, axis: Axis): number =>
  axis === 'samples' ? p.samples_per_pixel : p.elapsed_seconds;

/** Two points always form a line, which means nothing yet. */
const fitFrom = 3;

/** The forecast, from the newest point on with the slope that the server fitted. */
interface Forecast {
  /** The error at this number of samples or seconds. */
  at: (x: number) => number;
  /**
   * Samples or seconds until the error is below this; lower and upper limit from the slope's
   * interval.
   */
  whenBelow: (error: number) => { value: number; low: number | null; high: number | null };
}

function forecast(last: Known, slope: Convergence['slope'] | null, axis: Axis): Forecast | null {
  const value = slope?.value;
  // A curve that hardly falls gives no useful time.
  if (value == null || value > -0.05) return null;
  const here = xOf(last, axis);
  const reach = (error: number, s: number | null | undefined): number | null =>
    s != null && s < -0.05 ? here * (last.relative / error) ** (-1 / s) : null;
  return {
    at: (x) => last.relative * (x / here) ** value,
    whenBelow: (error) => ({
      value: reach(error, value)!,
      low: reach(error, slope?.low),
      high: reach(error, slope?.high),
    }),
  };
}

const roundErrors = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001];

/** The target, unless it is met; without one, the next two round errors. */
function nextErrors(job: Job, now: number): number[] {
  const target = job.spec.stop?.relative_error;
  return target && target < now
    ? [target]
    : roundErrors.filter((error) => error < 0.95 * now).slice(0, 2);
}

/** Samples and seconds from now until the next errors are reached. */
function Prediction({ job, data, last }: { job: Job; data: Convergence; last: Known }) {
  const samples = forecast(last, data.slope, 'samples');
  const seconds = forecast(last, data.slope, 'seconds');
  if (!samples || !seconds) return null;
  const left = (time: number | null): string =>
    time === null ? 'much more' : duration(Math.max(0, time - last.elapsed_seconds));
  const rows = nextErrors(job, last.relative).map((error) => {
    const t = seconds.whenBelow(error);
    return {
      error,
      samples: samples.whenBelow(error).value,
      left: left(t.value),
      range: t.low !== null ? `${left(t.low)} to ${left(t.high)} by the interval of the slope` : '',
    };
  });
  if (!rows.length) return null;
  // The job ends when the bound of its error meets the target, later than the estimate: the server
  // knows when.
  const p = job.progress;
  if (rows[0].error === job.spec.stop?.relative_error && p?.eta_seconds != null && p.fraction > 0) {
    const [low, high] = p.eta_interval_seconds ?? [p.eta_seconds, p.eta_seconds];
    if (p.samples_per_pixel) rows[0].samples = Math.round(p.samples_per_pixel.mean / p.fraction);
    rows[0].left = duration(p.eta_seconds);
    rows[0].range = `${duration(low)} to ${duration(high)} left at this pace`;
  }
  return (
    <dl class="figures prediction" data-testid="prediction">
      {rows.map(({ error, samples: n, left: wait, range }) => (
        <div key={error} title={range || undefined}>
          <dt>
            {number(100 * error)}% {isNoiseAlone(job) ? 'noise' : 'error'}
          </dt>
          <dd>
            <span>{isFinal(job.state) ? `${wait} more` : `in ${wait}`}</span>,{' '}
            <span>{counted(n, 'sample')}</span>
          </dd>
        </div>
      ))}
    </dl>
  );
}

const exponent = (v: number | null): string => (v ?? 0).toFixed(2).replace('-', '−');

function decades(low: number, high: number): number[] {
  const out: number[] = [];
  const steps = high / low < 4 ? [1, 1.5, 2, 3, 4, 5, 6, 8] : [1, 2, 5];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e)
    for (const m of steps) out.push(m * 10 ** e);
  const inside = out.filter((v) => v >= low * 0.999 && v <= high * 1.001);
  const tens = inside.filter((v) => Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-6);
  const list = inside.length > 5 && tens.length >= 2 ? tens : inside;
  return list.filter((_, i) => i % Math.ceil(list.length / 5) === 0);
}

/**
 * Width of the box; 0 until it is known, which is reported in a separate task, because drawing a
 * curve takes time.
 */
function useWidth(): [{ current: HTMLDivElement | null }, number] {
  const box = useRef<HTMLDivElement>(null);
  const [width, setWidth] = useState(0);
  useLayoutEffect(() => {
    const read = (): void => void (box.current && setWidth(Math.max(200, box.current.clientWidth)));
    let takeBack: (() => void) | null = null;
    const observer = new ResizeObserver(() => (takeBack ? read() : (takeBack = takeTurn(read))));
    observer.observe(box.current!);
    return () => {
      observer.disconnect();
      takeBack?.();
    };
  }, []);
  return [box, width];
}

export function ConvergencePlot({ job, data }: { job: Job; data: Convergence | null }) {
  const [axis, setAxis] = useState<Axis>('samples');
  const [hover, setHover] = useState<Known | null>(null);
  const [box, width] = useWidth();
  const points = (data?.points ?? []).filter(
    (p): p is Known => p.relative != null && p.relative > 0 && xOf(p, axis) > 0,
  );
  const fitted = points.length >= fitFrom ? (data?.slope ?? null) : null;
  const slope = fitted?.value;
  return (
    <section class="card" aria-labelledby="plot-title">
      <header class="card-head">
        <h2 id="plot-title">Convergence</h2>
        <div class="tiny-switch" role="group" aria-label="Horizontal axis">
          {(['samples', 'seconds'] as const).map((a) => (
            <button key={a} type="button" aria-pressed={axis === a} onClick={() => setAxis(a)}>
              {a}
            </button>
          ))}
        </div>
      </header>
      <div ref={box} class="plot">
        {points.length < 2 ? (
          <p class="plot-empty">The curve appears after the second pass.</p>
        ) : (
          width > 0 && (
            <Curve
              job={job}
              points={points}
              slope={fitted}
              axis={axis}
              width={width}
              hover={hover}
              onHover={setHover}
            />
          )
        )}
      </div>
      <p class="plot-foot" data-testid="slope">
        {hover ? (
          `${counted(hover.samples_per_pixel, 'sample')}, ${duration(hover.elapsed_seconds)}: ` +
          `${percent(hover.relative)} (${percent(hover.low)} to ${percent(hover.high)})`
        ) : slope != null ? (
          <>
            Slope <b>{exponent(slope)}</b>
            {fitted?.low != null && ` (${exponent(fitted.low)} to ${exponent(fitted.high)})`}
            {slope >= 0
              ? '. The error is not falling yet: rare bright paths are still being found.'
              : biasOf(job) === 'none'
                ? '. Plain random numbers give −0.5; steeper is better.'
                : isNoiseAlone(job)
                  ? '. This is the noise alone, without the systematic error.'
                  : '. This is of noise and systematic error together.'}
          </>
        ) : (
          'Slope: not enough passes yet.'
        )}
      </p>
      {data && fitted && (
        <Later>
          <Prediction job={job} data={data} last={points[points.length - 1]} />
        </Later>
      )}
    </section>
  );
}

interface CurveProps {
  job: Job;
  points: Known[];
  slope: Convergence['slope'] | null;
  axis: Axis;
  width: number;
  hover: Known | null;
  onHover: (point: Known | null) => void;
}

function Curve({ job, points, slope, axis, width, hover, onHover }: CurveProps) {
  const target = job.spec.stop?.relative_error ?? null;
  const last = points[points.length - 1];
  const line = forecast(last, slope, axis);
  const reach =
    target && line && last.relative > target && !isFinal(job.state)
      ? line.whenBelow(target).value
      : null;
  const x0 = xOf(points[0], axis);
  const x1 = Math.max(xOf(last, axis), Math.min(reach ?? 0, xOf(last, axis) * 30), x0 * 2) * 1.05;
  const lows = points.map((p) => p.low ?? p.relative).filter((v) => v > 0),
    highs = points.map((p) => p.high ?? p.relative);
  // Intervals of the first passes may be arbitrarily wide: the band is clipped.
  const errors = points.map((p) => p.relative);
  const lowest = Math.max(Math.min(...lows), Math.min(...errors) / 10);
  const y0 = Math.min(target ?? Infinity, lowest) * 0.8,
    y1 = Math.min(Math.max(...highs), 10 * Math.max(...errors)) * 1.15;
  const px = (v: number): number =>
    margin.left + ((width - margin.left - margin.right) * Math.log(v / x0)) / Math.log(x1 / x0);
  const py = (v: number): number =>
    margin.top + ((height - margin.top - margin.bottom) * Math.log(y1 / v)) / Math.log(y1 / y0);
  const path = (list: Known[], y: (p: Known) => number): string =>
    list
      .map((p) => {
        const within = Math.min(Math.max(y(p), y0), y1);
        return `${px(xOf(p, axis)).toFixed(1)},${py(within).toFixed(1)}`;
      })
      .join(' ');
  const upper = path(points, (p) => p.high ?? p.relative);
  const band = `${upper} ${path([...points].reverse(), (p) => p.low ?? p.relative)}`;
  const nearest = (clientX: number, element: Element): void => {
    const x = clientX - element.getBoundingClientRect().left;
    onHover(
      points.reduce((best, p) =>
        Math.abs(px(xOf(p, axis)) - x) < Math.abs(px(xOf(best, axis)) - x) ? p : best,
      ),
    );
  };
  return (
    <svg
      width={width}
      height={height}
      role="img"
      aria-label={
        `Error against ${axis}: from ${percent(points[0].relative)} down to ` +
        `${percent(last.relative)} after ${counted(last.samples_per_pixel, 'sample')}.`
      }
      onPointerMove={(e) => nearest(e.clientX, e.currentTarget)}
      onPointerLeave={() => onHover(null)}
    >
      {decades(y0, y1).map((v) => (
        <g key={v}>
          <line class="grid" x1={margin.left} x2={width - margin.right} y1={py(v)} y2={py(v)} />
          <text x={margin.left - 6} y={py(v) + 4} text-anchor="end">
            {Number((100 * v).toPrecision(2))}%
          </text>
        </g>
      ))}
      {decades(x0, x1).map((v) => (
        <g key={v}>
          <line class="grid" x1={px(v)} x2={px(v)} y1={margin.top} y2={height - margin.bottom} />
          <text x={px(v)} y={height - 9} text-anchor="middle">
            {axis === 'seconds' ? `${number(v)} s` : count(v)}
          </text>
        </g>
      ))}
      {target && target > y0 && (
        <line
          class="target"
          x1={margin.left}
          x2={width - margin.right}
          y1={py(target)}
          y2={py(target)}
        />
      )}
      <polygon class="band" points={band} />
      {line && (
        <line class="trend" x1={px(x0)} y1={py(line.at(x0))} x2={px(x1)} y2={py(line.at(x1))} />
      )}
      <polyline class="curve" points={path(points, (p) => p.relative)} />
      <circle
        class="curve-end"
        cx={px(xOf(hover ?? last, axis))}
        cy={py((hover ?? last).relative)}
        r={4}
      />
    </svg>
  );
}
