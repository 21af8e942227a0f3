import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { Convergence, ConvergencePoint, Job } from '../api/types';
import { isFinal } from '../api/types';
import { count, duration, number, percent } from '../ui/format';

type Axis = 'samples' | 'seconds';
type Known = ConvergencePoint & { relative_rmse: number };

const height = 190;
const margin = { left: 44, right: 12, top: 10, bottom: 26 };
const xOf = (p: ConvergencePoint, axis: Axis): number =>
  axis === 'samples' ? p.samples_per_pixel : p.elapsed_seconds;

/** Straight line through (log x, log error): what more samples will bring. */
function fit(
  points: Known[],
  axis: Axis,
): { slope: number; at: (x: number) => number; whenBelow: (error: number) => number } | null {
  const late = points
    .slice(-Math.max(6, Math.ceil(points.length * 0.6)))
    .filter((p) => xOf(p, axis) > 0);
  if (late.length < 3) return null;
  const xs = late.map((p) => Math.log(xOf(p, axis))),
    ys = late.map((p) => Math.log(p.relative_rmse));
  const mx = xs.reduce((a, b) => a + b) / xs.length,
    my = ys.reduce((a, b) => a + b) / ys.length;
  const sxx = xs.reduce((a, x) => a + (x - mx) ** 2, 0);
  if (!(sxx > 1e-6)) return null;
  const slope = xs.reduce((a, x, i) => a + (x - mx) * (ys[i] - my), 0) / sxx;
  return {
    slope,
    at: (x) => Math.exp(my + slope * (Math.log(x) - mx)),
    whenBelow: (error) => Math.exp(mx + (Math.log(error) - my) / slope),
  };
}

const exponent = (v: number | null): string => (v ?? 0).toFixed(2).replace('-', '−');

function decades(low: number, high: number): number[] {
  const out: number[] = [];
  const steps = high / low < 4 ? [1, 1.5, 2, 3, 4, 5, 6, 8] : [1, 2, 5];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e)
    for (const m of steps) out.push(m * 10 ** e);
  const inside = out.filter((v) => v >= low * 0.999 && v <= high * 1.001);
  const tens = inside.filter((v) => Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-6);
  return inside.length <= 5
    ? inside
    : tens.length >= 2
      ? tens
      : inside.filter((_, i) => i % Math.ceil(inside.length / 5) === 0);
}

function useWidth(): [{ current: HTMLDivElement | null }, number] {
  const box = useRef<HTMLDivElement>(null);
  const [width, setWidth] = useState(300);
  useLayoutEffect(() => {
    const observer = new ResizeObserver(
      () => box.current && setWidth(Math.max(200, box.current.clientWidth)),
    );
    observer.observe(box.current!);
    return () => observer.disconnect();
  }, []);
  return [box, width];
}

export function ConvergencePlot({ job, data }: { job: Job; data: Convergence | null }) {
  const [axis, setAxis] = useState<Axis>('samples');
  const [hover, setHover] = useState<Known | null>(null);
  const [box, width] = useWidth();
  const points = (data?.points ?? []).filter(
    (p): p is Known => p.relative_rmse != null && p.relative_rmse > 0 && xOf(p, axis) > 0,
  );
  const slope = data?.slope?.value;
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
          <p class="plot-empty">The curve begins with the second pass over the picture.</p>
        ) : (
          <Curve
            job={job}
            points={points}
            axis={axis}
            width={width}
            hover={hover}
            onHover={setHover}
          />
        )}
      </div>
      <p class="plot-foot" data-testid="slope">
        {hover ? (
          `${count(hover.samples_per_pixel)} samples, ${duration(hover.elapsed_seconds)}: ${percent(hover.relative_rmse)} (${percent(hover.low)} to ${percent(hover.high)})`
        ) : slope != null ? (
          <>
            Slope <b>{exponent(slope)}</b>
            {data?.slope?.low != null &&
              ` (${exponent(data.slope.low)} to ${exponent(data.slope.high)})`}
            . Plain random numbers give −0.5; steeper is better.
          </>
        ) : (
          'Slope: a few more passes are needed.'
        )}
      </p>
    </section>
  );
}

interface CurveProps {
  job: Job;
  points: Known[];
  axis: Axis;
  width: number;
  hover: Known | null;
  onHover: (point: Known | null) => void;
}

function Curve({ job, points, axis, width, hover, onHover }: CurveProps) {
  const target = job.spec.stop?.relative_error ?? null;
  const line = fit(points, axis);
  const last = points[points.length - 1];
  const reach =
    target && line && line.slope < -0.05 && last.relative_rmse > target && !isFinal(job.state)
      ? line.whenBelow(target)
      : null;
  const x0 = xOf(points[0], axis);
  const x1 = Math.max(xOf(last, axis), Math.min(reach ?? 0, xOf(last, axis) * 30), x0 * 2) * 1.05;
  const lows = points.map((p) => p.low ?? p.relative_rmse).filter((v) => v > 0),
    highs = points.map((p) => p.high ?? p.relative_rmse);
  const y0 = Math.min(...lows, target ?? Infinity) * 0.8,
    y1 = Math.max(...highs) * 1.15;
  const px = (v: number): number =>
    margin.left + ((width - margin.left - margin.right) * Math.log(v / x0)) / Math.log(x1 / x0);
  const py = (v: number): number =>
    margin.top + ((height - margin.top - margin.bottom) * Math.log(y1 / v)) / Math.log(y1 / y0);
  const path = (list: Known[], y: (p: Known) => number): string =>
    list
      .map((p) => `${px(xOf(p, axis)).toFixed(1)},${py(Math.max(y(p), y0)).toFixed(1)}`)
      .join(' ');
  const band = `${path(points, (p) => p.high ?? p.relative_rmse)} ${path([...points].reverse(), (p) => p.low ?? p.relative_rmse)}`;
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
      aria-label={`Error against ${axis}: from ${percent(points[0].relative_rmse)} down to ${percent(last.relative_rmse)} after ${count(last.samples_per_pixel)} samples.`}
      onPointerMove={(e) => nearest(e.clientX, e.currentTarget)}
      onPointerLeave={() => onHover(null)}
    >
      {decades(y0, y1).map((v) => (
        <g key={v}>
          <line class="grid" x1={margin.left} x2={width - margin.right} y1={py(v)} y2={py(v)} />
          <text x={margin.left - 6} y={py(v) + 4} text-anchor="end">
            {Number((100 * v).toPrecision(2))} %
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
      <polyline class="curve" points={path(points, (p) => p.relative_rmse)} />
      <circle
        class="curve-end"
        cx={px(xOf(hover ?? last, axis))}
        cy={py((hover ?? last).relative_rmse)}
        r={4}
      />
      {reach && reach < x1 * 1.01 && (
        <text class="reach" x={px(reach) - 6} y={py(target!) - 6} text-anchor="end">
          {axis === 'seconds' ? `at ${duration(reach)}` : `at ${count(reach)} samples`}
        </text>
      )}
    </svg>
  );
}
