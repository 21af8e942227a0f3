import type { LiveFilm } from '../../live/film';
import { count, number } from '../../ui/format';
import { halvesAround, halvesRadius, type Halves } from './film_reading';

const width = 240;
const height = 56;
const bins = 30;
const channels = ['r', 'g', 'b'] as const;

/** Counts per bin; values outside are in the first or last one. */
function binned(values: number[], low: number, high: number): number[] {
  const counts = new Array<number>(bins).fill(0);
  for (const v of values) {
    const bin = Math.floor(((v - low) / (high - low)) * bins);
    counts[Math.max(0, Math.min(bins - 1, bin))] += 1;
  }
  return counts;
}

/** The outline of a histogram's bars, closed along the bottom. */
function outline(counts: number[], top: number): string {
  const step = width / bins;
  const points = counts.flatMap((n, i) => {
    const y = (height * (1 - n / top)).toFixed(1);
    return [`${(i * step).toFixed(1)},${y}`, `${((i + 1) * step).toFixed(1)},${y}`];
  });
  return `0,${height} ${points.join(' ')} ${width},${height}`;
}

/** The middle 98% of all values, slightly widened: a single firefly must not compress the rest. */
function rangeOf(halves: Halves): { low: number; high: number } {
  const all = halves.values.flat().sort((a, b) => a - b);
  const low = all[Math.floor(0.01 * all.length)];
  const high = all[Math.min(all.length - 1, Math.floor(0.99 * all.length))];
  const pad = 0.04 * (high - low) || 0.05 * Math.abs(high) || 0.01;
  return { low: low - pad, high: high + pad };
}

/**
 * Distribution of the two independent halves of the pixel and its neighbours: one histogram per
 * channel, with the pixel's own halves as marks.
 */
export function HalfHistogram({ film, x, y }: { film: LiveFilm; x: number; y: number }) {
  const halves = halvesAround(film, x, y);
  if (!halves) return null;
  const { low, high } = rangeOf(halves);
  const counts = halves.values.map((values) => binned(values, low, high));
  const top = Math.max(...counts.flat());
  const at = (v: number): number =>
    Math.max(1, Math.min(width - 1, (width * (v - low)) / (high - low)));
  const side = 2 * halvesRadius + 1;
  return (
    <figure class="halves" data-testid="halves">
      <svg
        viewBox={`0 0 ${width} ${height}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={
          'Histogram of the halves around the pixel, red, green and blue, ' +
          `from ${number(low)} to ${number(high)}.`
        }
      >
        {channels.map((c, i) => (
          <polygon key={c} class={`halves-${c}`} points={outline(counts[i], top)} />
        ))}
        {channels.map((c, i) =>
          halves.own[i].map((v, half) => (
            <line
              key={`${c}${half}`}
              class={`halves-own halves-${c}`}
              x1={at(v)}
              x2={at(v)}
              y1={0}
              y2={height}
            />
          )),
        )}
      </svg>
      <div class="halves-ends mono" aria-hidden="true">
        <span>{number(low)}</span>
        <span>{number(high)}</span>
      </div>
      <figcaption class="hint">
        Both halves of {count(halves.pixels)} pixels ({side} × {side}); the lines mark this
        pixel. A long tail means rare bright paths (fireflies).
      </figcaption>
    </figure>
  );
}
