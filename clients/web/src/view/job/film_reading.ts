import type { LiveFilm } from '../../live/film';
import type { Range } from './view_modes';

/** Maximum number of pixels read for a range or an exposure. */
const looks = 20_000;

const luminance = (film: LiveFilm, pixel: number): number =>
  0.2126 * film.rgb[3 * pixel] +
  0.7152 * film.rgb[3 * pixel + 1] +
  0.0722 * film.rgb[3 * pixel + 2];

/** Positive values of up to about `looks` pixels, sorted. */
export function thinned(pixels: number, value: (pixel: number) => number): number[] {
  // A step without a common factor with usual widths, so that the pixels do not line up in columns.
  const step = Math.max(1, Math.floor(pixels / looks) | 1);
  const out: number[] = [];
  for (let i = 0; i < pixels; i += step) {
    const v = value(i);
    if (v > 0 && Number.isFinite(v)) out.push(v);
  }
  return out.sort((a, b) => a - b);
}

const sampled = (film: LiveFilm, value: (pixel: number) => number): number[] =>
  thinned(film.width * film.height, (i) => (film.samples[i] > 0 ? value(i) : 0));

/** Where a colour scale ends: a few outliers do not determine it. */
export const quantileOfTop = 0.995;

export const quantile = (sorted: number[], q: number): number =>
  sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];

/**
 * The automatic exposure of the server (`exposure=auto`, core/layers/exposure.h), in stops; null
 * while there are too few pixels.
 */
export function autoExposure(film: LiveFilm): number | null {
  const pixels = film.width * film.height;
  const step = Math.max(1, Math.floor(pixels / looks) | 1);
  const seen: { stops: number; weight: number }[] = [];
  for (let i = 0; i < pixels; i += step) {
    const weight = film.alpha ? Math.max(0, Math.min(1, film.alpha[i])) : 1;
    const stops = Math.log2(luminance(film, i) / weight);
    if (film.samples[i] > 0 && Number.isFinite(stops)) seen.push({ stops, weight });
  }
  if (seen.length < 16) return null;
  seen.sort((a, b) => a.stops - b.stops);
  const sum = seen.reduce((all, one) => all + one.weight, 0);
  const at = (share: number): number => {
    let below = 0;
    return seen.find((one) => (below += one.weight) >= share * sum)?.stops ?? seen[0].stops;
  };
  const mean = seen.reduce((all, one) => all + one.weight * one.stops, 0) / sum;
  const [low, high] = [at(0.01), at(0.99)];
  const key = Math.max(-1, Math.min(1, (2 * mean - low - high) / Math.max(high - low, 1)));
  const stops = Math.min(Math.log2(0.18) + 2 * key - mean, -at(0.9));
  return Math.round(10 * Math.max(-30, Math.min(30, stops))) / 10;
}

/** Whole decades around the visible variances. */
export function varianceRange(film: LiveFilm): Range {
  const values = sampled(
    film,
    (i) => (film.variance[3 * i] + film.variance[3 * i + 1] + film.variance[3 * i + 2]) / 3,
  );
  if (values.length < 16) return { low: 1e-6, high: 1 };
  const low = 10 ** Math.floor(Math.log10(quantile(values, 0.1)));
  const top = 10 ** Math.ceil(Math.log10(quantile(values, quantileOfTop)));
  return { low, high: Math.max(100 * low, top) };
}

export function samplesRange(film: LiveFilm): Range {
  const values = sampled(film, (i) => film.samples[i]);
  if (!values.length) return { low: 1, high: 2 };
  // At least a factor of two, so that a pass in progress does not look like a large difference.
  const high = Math.max(2, values[values.length - 1]);
  return { low: Math.max(1, Math.min(values[0], high / 2)), high };
}

/**
 * Both halves of the surrounding pixels: their values per channel, and the two of the pixel itself.
 */
export interface Halves {
  pixels: number;
  values: [number[], number[], number[]];
  own: [number[], number[], number[]];
}

export const halvesRadius = 4;

/**
 * A pixel's mean is that of its halves A and B, and its variance (A - B)² / 4: so they are mean ±
 * √variance. Null while the pixel has one half only.
 */
export function halvesAround(film: LiveFilm, x: number, y: number): Halves | null {
  const halves: Halves = { pixels: 0, values: [[], [], []], own: [[], [], []] };
  const known = (pixel: number): boolean =>
    film.samples[pixel] > 0 && Number.isFinite(film.variance[3 * pixel]);
  if (!known(y * film.width + x)) return null;
  const bottom = Math.min(film.height - 1, y + halvesRadius);
  const right = Math.min(film.width - 1, x + halvesRadius);
  for (let row = Math.max(0, y - halvesRadius); row <= bottom; ++row) {
    for (let column = Math.max(0, x - halvesRadius); column <= right; ++column) {
      const pixel = row * film.width + column;
      if (!known(pixel)) continue;
      halves.pixels += 1;
      for (let c = 0; c < 3; ++c) {
        const mean = film.rgb[3 * pixel + c];
        const apart = Math.sqrt(film.variance[3 * pixel + c]);
        halves.values[c].push(mean - apart, mean + apart);
        if (row === y && column === x) halves.own[c] = [mean - apart, mean + apart];
      }
    }
  }
  return halves;
}
