import { useEffect, useRef, useState } from 'preact/hooks';
import type { ConvergencePoint, Job } from 'tessera-render';
import { api, explain } from '../../api/client';
import { isFinal } from '../../api/states';
import { counted, duration, percent } from '../../ui/format';
import { choiceIn, keepChoice, route } from '../../ui/router';
import { useStore } from '../../ui/store';
import { sceneTitle } from '../jobs/job_words';
import {
  across,
  decades,
  decadeTicks,
  Frame,
  height,
  margin,
  up,
  useWidth,
} from './lab_axes';
import { save, svgText } from './lab_model';

/** The number of distinct colours. */
export const curvesAtMost = 8;

const lookMs = 2000;

type Known = ConvergencePoint & { relative: number };

interface Curve {
  id: string;
  title: string;
  ended: boolean;
  points: Known[];
}

const overs = {
  samples: { label: 'Samples', axis: 'samples per pixel', of: (p: Known) => p.samples_per_pixel },
  seconds: { label: 'Seconds', axis: 'seconds', of: (p: Known) => p.elapsed_seconds },
  cpu: { label: 'CPU seconds', axis: 'CPU seconds', of: (p: Known) => p.cpu_seconds },
} as const;
type Over = keyof typeof overs;

async function curveOf(id: string, signal: AbortSignal): Promise<Curve> {
  const [job, data] = await Promise.all([api.job(id, signal), api.convergence(id, signal)]);
  return {
    id,
    title: titleOf(job),
    ended: isFinal(job.state),
    points: data.points.filter(
      (p): p is Known => p.relative !== null && p.relative > 0,
    ),
  };
}

const titleOf = (job: Job): string => `${sceneTitle(job)} (${job.id.slice(0, 4)})`;

/** The curves of all readable jobs, updated until all have ended; and why one cannot be read. */
function useCurves(ids: string[]): { curves: Curve[] | null; faults: string[] } {
  const [state, setState] = useState<{ curves: Curve[] | null; faults: string[] }>({
    curves: null,
    faults: [],
  });
  const key = ids.join();
  useEffect(() => {
    let timer = 0;
    const abort = new AbortController();
    const look = async (): Promise<void> => {
      const found = await Promise.allSettled(ids.map((id) => curveOf(id, abort.signal)));
      if (abort.signal.aborted) return;
      const curves = found.flatMap((f) => (f.status === 'fulfilled' ? [f.value] : []));
      const faults = found.flatMap((f, i) =>
        f.status === 'rejected' ? [`${ids[i].slice(0, 8)}: ${explain(f.reason)}`] : [],
      );
      setState({ curves, faults });
      if (curves.some((c) => !c.ended)) timer = window.setTimeout(() => void look(), lookMs);
    };
    void look();
    return () => {
      abort.abort();
      clearTimeout(timer);
    };
  }, [key]);
  return state;
}

/** A CSV cell, quoted if necessary (RFC 4180). */
const cell = (text: string): string =>
  /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;

/** All curves in one table, one line per point. */
export function tableOf(curves: Curve[]): string {
  const lines = curves.flatMap((c) =>
    c.points.map((p) =>
      [
        c.id,
        cell(c.title),
        p.samples_per_pixel,
        p.elapsed_seconds,
        p.cpu_seconds,
        p.rays,
        p.relative,
        p.low ?? '',
        p.high ?? '',
      ].join(),
    ),
  );
  const head = 'job,name,samples_per_pixel,elapsed_seconds,cpu_seconds,rays,relative,low,high';
  return [head, ...lines, ''].join('\n');
}

/** Error curves of several renders in one plot. */
export function ConvergenceView({ ids }: { ids: string[] }) {
  const at = useStore(route);
  const chosen = choiceIn(at, 'over');
  const over: Over = chosen in overs ? (chosen as Over) : 'samples';
  const { curves, faults } = useCurves(ids);
  const [box, width] = useWidth();
  const drawing = useRef<HTMLDivElement>(null);
  const shown = (curves ?? []).filter((c) => c.points.length > 0);
  const saveSvg = (): void => {
    const svg = drawing.current?.querySelector('svg');
    if (svg) save('convergence.svg', svgText(svg), 'image/svg+xml');
  };
  return (
    <div class="page convergence" data-testid="convergence">
      <header class="page-head">
        <h1>Convergence</h1>
        <div class="tiny-switch" role="group" aria-label="Horizontal axis">
          {(Object.keys(overs) as Over[]).map((name) => (
            <button
              key={name}
              type="button"
              aria-pressed={over === name}
              onClick={() => keepChoice('over', name === 'samples' ? '' : name)}
            >
              {overs[name].label}
            </button>
          ))}
        </div>
      </header>
      {faults.map((fault) => (
        <p key={fault} class="wrong" role="alert">
          {fault}
        </p>
      ))}
      <div ref={box} class="lab-plot">
        <div ref={drawing}>
          {shown.length > 0 ? (
            <Plot curves={shown} over={over} width={width} />
          ) : (
            <p class="lab-plot-empty dim">
              {curves ? 'None of these renders has an error curve yet.' : 'Loading…'}
            </p>
          )}
        </div>
      </div>
      <ul class="convergence-legend">
        {shown.map((c, i) => {
          const last = c.points[c.points.length - 1];
          return (
            <li key={c.id} class={`lab-series-${i % curvesAtMost}`}>
              <svg width="14" height="14" aria-hidden="true">
                <circle class="lab-dot" cx="7" cy="7" r="5" />
              </svg>
              <a href={`#/jobs/${c.id}`}>{c.title}</a>
              <span class="dim">
                {percent(last.relative)} after {counted(last.samples_per_pixel, 'sample')},{' '}
                {duration(last.elapsed_seconds)}
              </span>
            </li>
          );
        })}
      </ul>
      {shown.length > 0 && (
        <div class="bench-buttons">
          <button
            type="button"
            class="quiet"
            onClick={() => save('convergence.csv', tableOf(shown), 'text/csv')}
          >
            Save CSV
          </button>
          <button type="button" class="quiet" onClick={saveSvg}>
            Save SVG
          </button>
        </div>
      )}
    </div>
  );
}

/** The intervals, if finite: those of the first passes may be unbounded. */
function bandOf(points: Known[], line: (list: Known[], error: (p: Known) => number) => string) {
  const known = points.filter((p) => p.low && p.high && p.high < 10 * p.low);
  return `${line(known, (p) => p.high!)} ${line([...known].reverse(), (p) => p.low!)}`;
}

/** As a percentage: 10%, not 10⁻¹. */
const percentOf = (exponent: number): string => `${Number((10 ** (exponent + 2)).toPrecision(1))}%`;

function Plot({ curves, over, width }: { curves: Curve[]; over: Over; width: number }) {
  const { of, axis } = overs[over];
  const drawn = curves.map((c) => ({ ...c, points: c.points.filter((p) => of(p) > 0) }));
  const points = drawn.flatMap((c) => c.points);
  if (!points.length) return <p class="lab-plot-empty dim">Not enough passes yet.</p>;
  const x = decades(points.map(of));
  const y = decades(points.map((p) => p.relative));
  const px = (p: Known): number => across(width, x, Math.log10(of(p)));
  const py = (error: number): number =>
    Math.min(height - margin.bottom, Math.max(margin.top, up(y, Math.log10(error))));
  const line = (list: Known[], error: (p: Known) => number): string =>
    list.map((p) => `${px(p).toFixed(1)},${py(error(p)).toFixed(1)}`).join(' ');
  const words = drawn
    .filter((c) => c.points.length)
    .map((c) => `${c.title}: ${percent(c.points[c.points.length - 1].relative)} in the end`)
    .join('; ');
  return (
    <svg
      viewBox={`0 0 ${width} ${height}`}
      width={width}
      height={height}
      role="img"
      aria-label={`Relative error over ${axis}, both logarithmic. ${words}.`}
      data-testid="convergence-plot"
    >
      <Frame
        width={width}
        x={x}
        ticks={decadeTicks(y, 8).map((e) => ({ at: up(y, e), text: percentOf(e) }))}
        name="relative error"
        across={axis}
      />
      {drawn.map((c, i) => (
        <g key={c.id} class={`lab-series-${i % curvesAtMost}`}>
          <polygon class="convergence-band" points={bandOf(c.points, line)} />
          <polyline class="lab-fit" points={line(c.points, (p) => p.relative)} />
          {c.points.map((p) => (
            <circle
              key={p.samples_per_pixel}
              class="lab-dot"
              cx={px(p)}
              cy={py(p.relative)}
              r={3}
            >
              <title>
                {`${c.title}: ${counted(p.samples_per_pixel, 'sample')}, ` +
                  `${duration(p.elapsed_seconds)}: ${percent(p.relative)}`}
              </title>
            </circle>
          ))}
        </g>
      ))}
    </svg>
  );
}
