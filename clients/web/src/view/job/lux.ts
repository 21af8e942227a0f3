import { quantile, quantileOfTop, thinned } from './film_reading';

/** Luminous efficacy of nominal white. */
export const lumensPerWatt = 683;

export interface LuxScale {
  /** Value of the ramp's last colour; the first is 0. */
  top: number;
  /** Number of intervals between labels. */
  parts: number;
  /** The largest value. */
  most: number;
}

/** Ends of scales within a decade, with the number of intervals that gives round labels. */
const roundTops: [number, number][] = [
  [1, 4],
  [1.5, 3],
  [2, 4],
  [3, 3],
  [4, 4],
  [5, 5],
  [6, 3],
  [8, 4],
  [10, 4],
];

/** Rounded up, so that the scale is easy to read and stays the same while the image grows. */
function roundUp(v: number): { top: number; parts: number } {
  const ten = 10 ** Math.floor(Math.log10(v));
  const [top, parts] = roundTops.find(([m]) => m * ten >= v * (1 - 1e-6)) ?? roundTops[8];
  return { top: top * ten, parts };
}

/** A linear scale from 0 to a high percentile: a few outliers do not determine it. */
export function luxScale(lux: ArrayLike<number>): LuxScale {
  let most = 0;
  for (let i = 0; i < lux.length; ++i) if (lux[i] > most && lux[i] < Infinity) most = lux[i];
  const lit = thinned(lux.length, (i) => lux[i]);
  return { ...roundUp(lit.length ? quantile(lit, quantileOfTop) : 1), most };
}

/** Index of the ramp's colour. */
export const rampIndex = (lux: number, { top }: LuxScale): number =>
  Math.round(255 * Math.min(1, Math.max(0, lux / top))) || 0;
