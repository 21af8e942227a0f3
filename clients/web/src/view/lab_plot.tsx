import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { LabOutcome, LabPoint } from '../api/types';
import { count, number } from '../ui/format';

export interface Series {
  id: number;
  label: string;
  points: LabPoint[];
  outcome: LabOutcome | null;
}

const height = 380;
const margin = { left: 62, right: 18, top: 14, bottom: 44 };
const superscripts = '⁰¹²³⁴⁵⁶⁷⁸⁹';
const power = (e: number): string =>
  `10${e < 0 ? '⁻' : ''}${[...String(Math.abs(e))].map((d) => superscripts[Number(d)]).join('')}`;

export function useWidth(): [{ current: HTMLDivElement | null }, number] {
  const box = useRef<HTMLDivElement>(null);
  const [width, setWidth] = useState(600);
  useLayoutEffect(() => {
    const observer = new ResizeObserver(
      () => box.current && setWidth(Math.max(260, box.current.clientWidth)),
    );
    observer.observe(box.current!);
    return () => observer.disconnect();
  }, []);
  return [box, width];
}

interface Axis {
  low: number;
  high: number;
}

/** Whole decades, so that both axes read as powers of ten. */
function decades(values: number[]): Axis {
  const logs = values.map(Math.log10);
  const low = Math.floor(Math.min(...logs) + 1e-9);
  return { low, high: Math.max(Math.ceil(Math.max(...logs) - 1e-9), low + 1) };
}

function ticks({ low, high }: Axis, most: number): number[] {
  const step = Math.max(1, Math.ceil((high - low) / most));
  const all: number[] = [];
  for (let e = low; e <= high; e += step) all.push(e);
  return all;
}

/** RMSE over n, both logarithmic: every series with its fitted line, dashed lines for what theory says. */
export function LabPlot({ series, unit }: { series: Series[]; unit: string }) {
  const [box, width] = useWidth();
  const shown = series
    .map((s) => ({ ...s, points: s.points.filter((p) => p.rmse > 0) }))
    .filter((s) => s.points.length > 0);
  const points = shown.flatMap((s) => s.points);
  if (!points.length)
    return (
      <div ref={box} class="lab-plot lab-plot-empty">
        <p>
          {series.some((s) => s.outcome)
            ? 'No error at all: this estimate is exact.'
            : 'The error curve appears here, point by point.'}
        </p>
      </div>
    );
  const xAxis = decades(points.map((p) => p.n));
  const yAxis = decades(points.map((p) => p.rmse));
  const px = (n: number): number =>
    margin.left +
    ((width - margin.left - margin.right) * (Math.log10(n) - xAxis.low)) / (xAxis.high - xAxis.low);
  const py = (e: number): number =>
    height -
    margin.bottom -
    ((height - margin.top - margin.bottom) * (Math.log10(e) - yAxis.low)) / (yAxis.high - yAxis.low);
  const best = shown[shown.length - 1];
  const words = shown
    .map(
      (s) =>
        `${s.label}: RMSE ${number(s.points[0].rmse)} at n = ${s.points[0].n}, ` +
        `${number(s.points[s.points.length - 1].rmse)} at n = ${s.points[s.points.length - 1].n}` +
        (s.outcome?.slope != null ? `, slope ${number(s.outcome.slope)}` : ''),
    )
    .join('; ');
  return (
    <div ref={box} class="lab-plot">
      <svg
        viewBox={`0 0 ${width} ${height}`}
        width={width}
        height={height}
        role="img"
        aria-label={`Error over n, logarithmic. ${words}.`}
        data-testid="lab-plot"
      >
        <clipPath id="lab-area">
          <rect
            x={margin.left}
            y={margin.top}
            width={width - margin.left - margin.right}
            height={height - margin.top - margin.bottom}
          />
        </clipPath>
        {ticks(yAxis, 8).map((e) => (
          <g key={`y${e}`}>
            <line class="grid" x1={margin.left} x2={width - margin.right} y1={py(10 ** e)} y2={py(10 ** e)} />
            <text x={margin.left - 9} y={py(10 ** e) + 4} text-anchor="end">
              {power(e)}
            </text>
          </g>
        ))}
        {ticks(xAxis, 8).map((e) => (
          <g key={`x${e}`}>
            <line class="grid" x1={px(10 ** e)} x2={px(10 ** e)} y1={margin.top} y2={height - margin.bottom} />
            <text x={px(10 ** e)} y={height - margin.bottom + 18} text-anchor="middle">
              {power(e)}
            </text>
          </g>
        ))}
        <text x={(margin.left + width - margin.right) / 2} y={height - 6} text-anchor="middle">
          n, {unit}
        </text>
        <text transform={`translate(14 ${(height - margin.bottom) / 2}) rotate(-90)`} text-anchor="middle">
          RMSE
        </text>
        <g clip-path="url(#lab-area)">
          {shown.map((s) => (
            <Lines key={s.id} series={s} px={px} py={py} />
          ))}
        </g>
        {shown.map((s) => (
          <g key={s.id} class={`lab-series-${s.id % 6}${s === best ? '' : ' lab-earlier'}`}>
            {s.points.map((p) => (
              <circle key={p.n_asked} class="lab-dot" cx={px(p.n)} cy={py(p.rmse)} r={4.5}>
                <title>
                  {`${s.label}: n = ${count(p.n)}, RMSE ${number(p.rmse)}, mean ${number(p.mean, 6)} ± ${number(p.standard_error, 2)}`}
                </title>
              </circle>
            ))}
          </g>
        ))}
      </svg>
    </div>
  );
}

interface LinesProps {
  series: Series;
  px: (n: number) => number;
  py: (e: number) => number;
}

function Lines({ series, px, py }: LinesProps) {
  const { points, outcome } = series;
  const ns = points.map((p) => p.n);
  const [first, last] = [Math.min(...ns), Math.max(...ns)];
  const middle = (of: (p: LabPoint) => number): number =>
    points.reduce((sum, p) => sum + Math.log(of(p)), 0) / points.length;
  const expected = outcome?.expected_slope;
  const line = (kind: string, at: (n: number) => number) => (
    <line class={kind} x1={px(first)} y1={py(at(first))} x2={px(last)} y2={py(at(last))} />
  );
  return (
    <g class={`lab-series-${series.id % 6}`}>
      {outcome?.slope != null && outcome.intercept != null
        ? line('lab-fit', (n) => Math.exp(outcome.intercept! + outcome.slope! * Math.log(n)))
        : points.length > 1 && (
            <polyline class="lab-fit" points={points.map((p) => `${px(p.n)},${py(p.rmse)}`).join(' ')} />
          )}
      {expected != null &&
        line('lab-expected', (n) =>
          Math.exp(middle((p) => p.rmse) + expected * (Math.log(n) - middle((p) => p.n))),
        )}
    </g>
  );
}

const axes = ['x', 'y', 'z', 'w'];

/** The first points of a sampler; of four dimensions any two. */
export function PatternPlot({ pattern, label }: { pattern: number[][]; label: string }) {
  const [pair, setPair] = useState<[number, number]>([0, 1]);
  const dimensions = pattern[0]?.length ?? 2;
  const pairs: [number, number][] = [];
  for (let a = 0; a < dimensions; ++a) for (let b = a + 1; b < dimensions; ++b) pairs.push([a, b]);
  const [a, b] = pair[1] < dimensions ? pair : [0, 1];
  const side = 260;
  const cells = Math.round(Math.sqrt(pattern.length));
  return (
    <figure class="lab-pattern">
      <svg
        viewBox={`-4 -4 ${side + 8} ${side + 8}`}
        role="img"
        aria-label={`${pattern.length} points of ${label}, axes ${axes[a]} and ${axes[b]}`}
        data-testid="lab-pattern"
      >
        {cells <= 16 &&
          Array.from({ length: cells + 1 }, (_, i) => (
            <path key={i} class="grid" d={`M0 ${(i * side) / cells}H${side}M${(i * side) / cells} 0V${side}`} />
          ))}
        <rect class="lab-frame" width={side} height={side} />
        {pattern.map((p, i) => (
          <circle
            key={i}
            class="lab-dot"
            cx={p[a] * side}
            cy={(1 - p[b]) * side}
            r={pattern.length > 300 ? 1.8 : 2.8}
          />
        ))}
      </svg>
      <figcaption class="hint">
        {pattern.length} points of {label}
      </figcaption>
      {pairs.length > 1 && (
        <div class="tiny-switch" role="group" aria-label="Axes shown">
          {pairs.map(([i, j]) => (
            <button
              key={`${i}${j}`}
              type="button"
              aria-pressed={i === a && j === b}
              onClick={() => setPair([i, j])}
            >
              {axes[i]}
              {axes[j]}
            </button>
          ))}
        </div>
      )}
    </figure>
  );
}
