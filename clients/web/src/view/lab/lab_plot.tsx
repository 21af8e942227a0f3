import { count, number } from '../../ui/format';
import {
  across,
  decades,
  decadeTicks,
  Frame,
  height,
  inkOf,
  labelOf,
  margin,
  Mark,
  power,
  roundTicks,
  up,
  type Axis,
  type Series,
} from './lab_axes';

interface PlotProps {
  series: Series[];
  /** The selected run. */
  shown: Series;
  unit: string;
  width: number;
}

/** RMSE over n, both logarithmic: every run with its fitted line, and a dashed line for theory. */
export function ErrorPlot({ series, shown, unit, width }: PlotProps) {
  const measured = series
    .map((s) => ({ ...s, points: s.points.filter((p) => p.rmse > 0) }))
    .filter((s) => s.points.length > 0);
  const points = measured.flatMap((s) => s.points);
  if (!points.length) return <p class="lab-nothing">No error at all: this estimate is exact.</p>;
  const x = decades(points.map((p) => p.n));
  const y = decades(points.map((p) => p.rmse));
  const px = (n: number): number => across(width, x, Math.log10(n));
  const py = (e: number): number => up(y, Math.log10(e));
  const words = measured
    .map(
      (s) =>
        `${labelOf(s)}: RMSE ${number(s.points[0].rmse)} at n = ${s.points[0].n}, ` +
        `${number(s.points[s.points.length - 1].rmse)} at n = ${s.points[s.points.length - 1].n}` +
        (s.outcome?.slope != null ? `, slope ${number(s.outcome.slope)}` : ''),
    )
    .join('; ');
  return (
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
      <Frame
        width={width}
        x={x}
        ticks={decadeTicks(y, 8).map((e) => ({ at: up(y, e), text: power(e) }))}
        name="RMSE"
        across={`n, ${unit}`}
      />
      <g clip-path="url(#lab-area)">
        {measured.map((s) => (
          <Lines
            key={s.id}
            series={s}
            px={px}
            py={py}
            // With many runs only the theory of one is drawn: the others are in the legend.
            theory={measured.length <= 3 || s.id === shown.id}
          />
        ))}
      </g>
      {measured.map((s) => (
        <g key={s.id} class={`${inkOf(s)}${s.id === shown.id ? '' : ' lab-behind'}`}>
          {s.points.map((p) => (
            <Mark key={p.n_asked} series={s} x={px(p.n)} y={py(p.rmse)}>
              <title>
                {`${labelOf(s)}: n = ${count(p.n)}, RMSE ${number(p.rmse)}, ` +
                  `mean ${number(p.mean, 6)} ± ${number(p.standard_error, 2)}`}
              </title>
            </Mark>
          ))}
        </g>
      ))}
    </svg>
  );
}

interface LinesProps {
  series: Series;
  px: (n: number) => number;
  py: (e: number) => number;
  theory: boolean;
}

function Lines({ series, px, py, theory }: LinesProps) {
  const { points, outcome } = series;
  const ns = points.map((p) => p.n);
  const [first, last] = [Math.min(...ns), Math.max(...ns)];
  const middle = (of: (p: Series['points'][number]) => number): number =>
    points.reduce((sum, p) => sum + Math.log(of(p)), 0) / points.length;
  const expected = outcome?.expected_slope;
  const line = (kind: string, at: (n: number) => number) => (
    <line class={kind} x1={px(first)} y1={py(at(first))} x2={px(last)} y2={py(at(last))} />
  );
  return (
    <g class={inkOf(series)}>
      {outcome?.slope != null && outcome.intercept != null
        ? line('lab-fit', (n) => Math.exp(outcome.intercept! + outcome.slope! * Math.log(n)))
        : points.length > 1 && (
            <polyline
              class="lab-fit"
              points={points.map((p) => `${px(p.n)},${py(p.rmse)}`).join(' ')}
            />
          )}
      {theory &&
        expected != null &&
        line('lab-expected', (n) =>
          Math.exp(middle((p) => p.rmse) + expected * (Math.log(n) - middle((p) => p.n))),
        )}
    </g>
  );
}

/**
 * Means over n with two standard errors on each side, and the exact value: a remaining distance is
 * bias.
 */
export function MeanPlot({ series, shown, unit, width }: PlotProps) {
  const measured = series.filter((s) => s.points.length > 0);
  const points = measured.flatMap((s) => s.points);
  const exact = [...new Set(measured.flatMap((s) => (s.outcome ? [s.outcome.expected] : [])))];
  const x = decades(points.map((p) => p.n));
  const y = linear([
    ...points.flatMap((p) => [p.mean - 2 * p.standard_error, p.mean + 2 * p.standard_error]),
    ...exact,
  ]);
  const step = beside(
    shown.points.map((p) => across(width, x, Math.log10(p.n))),
    measured.length,
  );
  const words = measured
    .map((s) => {
      const p = s.points[s.points.length - 1];
      return `${labelOf(s)}: ${number(p.mean, 6)} ± ${number(p.standard_error, 2)} at n = ${p.n}`;
    })
    .join('; ');
  return (
    <svg
      viewBox={`0 0 ${width} ${height}`}
      width={width}
      height={height}
      role="img"
      aria-label={
        `Mean over n, exact value ${exact.map((e) => number(e, 7)).join(' and ')}. ${words}.`
      }
      data-testid="lab-mean"
    >
      <Frame
        width={width}
        x={x}
        ticks={roundTicksOf(y)}
        name="mean ± 2 standard errors"
        across={`n, ${unit}`}
      />
      {exact.map((e) => (
        <g key={e}>
          <line
            class="lab-exact"
            x1={margin.left}
            x2={width - margin.right}
            y1={up(y, e)}
            y2={up(y, e)}
          />
          <text class="lab-exact-value" x={width - margin.right} y={up(y, e) - 6} text-anchor="end">
            exact {number(e, 7)}
          </text>
        </g>
      ))}
      {measured.map((s, i) => (
        <g key={s.id} class={`${inkOf(s)}${s.id === shown.id ? '' : ' lab-behind'}`}>
          {s.points.map((p) => {
            // Side by side, because they are nearly equal.
            const at = across(width, x, Math.log10(p.n)) + step * (i - (measured.length - 1) / 2);
            return (
              <g key={p.n_asked}>
                <line
                  class="lab-fit"
                  x1={at}
                  x2={at}
                  y1={up(y, p.mean - 2 * p.standard_error)}
                  y2={up(y, p.mean + 2 * p.standard_error)}
                />
                <Mark series={s} x={at} y={up(y, p.mean)}>
                  <title>
                    {`${labelOf(s)}: n = ${count(p.n)}, ` +
                      `mean ${number(p.mean, 6)} ± ${number(p.standard_error, 2)}`}
                  </title>
                </Mark>
              </g>
            );
          })}
        </g>
      ))}
    </svg>
  );
}

/** Distance between runs at one n, small enough to separate them from those of the next. */
function beside(places: number[], runs: number): number {
  const sorted = [...places].sort((a, b) => a - b);
  const gaps = sorted.slice(1).map((at, i) => at - sorted[i]);
  return Math.min(7, (0.7 * Math.min(...gaps.filter((gap) => gap > 0), 100)) / runs);
}

function linear(values: number[]): Axis {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const space = high > low ? 0.06 * (high - low) : Math.max(Math.abs(high), 1) * 0.01;
  return { low: low - space, high: high + space };
}

const roundTicksOf = (y: Axis) => roundTicks(y).map((v) => ({ at: up(y, v), text: number(v, 4) }));
