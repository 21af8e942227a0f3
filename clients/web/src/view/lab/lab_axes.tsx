import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { ComponentChildren } from 'preact';
import type { LabOutcome, LabPoint } from 'tessera-render';

/** One run in the plots. */
export interface Series {
  id: number;
  /** Colour and shape, 0 to slots - 1; no two runs of a plot have the same. */
  slot: number;
  estimator: string;
  sampler: string;
  /** Total number of points expected. */
  asked: number;
  points: LabPoint[];
  outcome: LabOutcome | null;
}

const colours = 8;
export const slots = 2 * colours;
export const inkOf = (s: Series): string => `lab-series-${s.slot % colours}`;
export const labelOf = (s: Series): string => `${s.estimator}, ${s.sampler}`;

/** The mark of a run: a disk, or a diamond if all colours are in use. */
export function Mark({ series, x, y, children }: MarkProps) {
  if (series.slot < colours)
    return (
      <circle class="lab-dot" cx={x} cy={y} r={4.5}>
        {children}
      </circle>
    );
  return (
    <path class="lab-dot" d={`M${x} ${y - 6}l6 6l-6 6l-6 -6z`}>
      {children}
    </path>
  );
}

interface MarkProps {
  series: Series;
  x: number;
  y: number;
  children?: ComponentChildren;
}

export const height = 380;
export const margin = { left: 62, right: 18, top: 14, bottom: 44 };

export interface Axis {
  low: number;
  high: number;
}

/** Position of the value in the drawing. */
export const across = (width: number, { low, high }: Axis, value: number): number =>
  margin.left + ((width - margin.left - margin.right) * (value - low)) / (high - low);
export const up = ({ low, high }: Axis, value: number): number =>
  height - margin.bottom - ((height - margin.top - margin.bottom) * (value - low)) / (high - low);

/** Whole decades that contain all values: exponents of ten. */
export function decades(values: number[]): Axis {
  const logs = values.map(Math.log10);
  const low = Math.floor(Math.min(...logs) + 1e-9);
  return { low, high: Math.max(Math.ceil(Math.max(...logs) - 1e-9), low + 1) };
}

export function decadeTicks({ low, high }: Axis, most: number): number[] {
  const step = Math.max(1, Math.ceil((high - low) / most));
  const all: number[] = [];
  for (let e = low; e <= high; e += step) all.push(e);
  return all;
}

/** Round numbers, about five of them, within the axis. */
export function roundTicks({ low, high }: Axis): number[] {
  const rough = (high - low) / 5;
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step =
    decade * (rough / decade < 1.5 ? 1 : rough / decade < 3.5 ? 2 : rough / decade < 7.5 ? 5 : 10);
  const all: number[] = [];
  for (let i = Math.ceil(low / step); i * step <= high; ++i) all.push(i * step);
  return all;
}

const superscripts = '⁰¹²³⁴⁵⁶⁷⁸⁹';
export const power = (e: number): string =>
  `10${e < 0 ? '⁻' : ''}${[...String(Math.abs(e))].map((d) => superscripts[Number(d)]).join('')}`;

interface FrameProps {
  width: number;
  x: Axis;
  ticks: { at: number; text: string }[];
  name: string;
  /** Name of the horizontal axis. */
  across: string;
}

/** Grid and names of the axes; powers of ten to the right. */
export function Frame({ width, x, ticks, name, across: axis }: FrameProps) {
  const bottom = height - margin.bottom;
  const right = width - margin.right;
  return (
    <>
      {ticks.map(({ at, text }) => (
        <g key={text}>
          <line class="grid" x1={margin.left} x2={right} y1={at} y2={at} />
          <text x={margin.left - 9} y={at + 4} text-anchor="end">
            {text}
          </text>
        </g>
      ))}
      {decadeTicks(x, 8).map((e) => (
        <g key={e}>
          <line
            class="grid"
            x1={across(width, x, e)}
            x2={across(width, x, e)}
            y1={margin.top}
            y2={bottom}
          />
          <text x={across(width, x, e)} y={bottom + 18} text-anchor="middle">
            {power(e)}
          </text>
        </g>
      ))}
      <text x={(margin.left + right) / 2} y={height - 6} text-anchor="middle">
        {axis}
      </text>
      <text transform={`translate(14 ${bottom / 2}) rotate(-90)`} text-anchor="middle">
        {name}
      </text>
    </>
  );
}

/** The width of a box, updated as it changes. */
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
