import { LiveFilm } from './film';

export type Measure = 'difference' | 'z';

/** The page's own comparison of two films, from their float tiles. */
export interface Figures {
  mse: number;
  relmse: number;
  bias: number;
  shareAbove3: number;
}

const sliceMs = 6;
/** Pixels between two checks of the clock. */
const runPixels = 512;

/**
 * A film whose `tileError` contains, per pixel, the relative difference of two films or their
 * distance in standard errors (both pooled over 5 x 5 pixels). Works for a few milliseconds at a
 * time and yields to the page in between.
 */
export async function compareFilms(
  a: LiveFilm,
  b: LiveFilm,
  measure: Measure,
  signal: AbortSignal,
): Promise<{ film: LiveFilm; figures: Figures }> {
  const film = new LiveFilm(a.width, a.height);
  const figures = { mse: 0, relmse: 0, bias: 0, shareAbove3: 0 };
  const pixels = a.width * a.height;
  const pause = makePause(signal);
  for (let from = 0; from < pixels; from += runPixels) {
    const to = Math.min(pixels, from + runPixels);
    for (let i = from; i < to; ++i) subtract(a, b, film, i, figures);
    const waited = pause();
    if (waited) await waited;
  }
  const pooled = new Float32Array(runPixels);
  const zFigure = a.correlated || b.correlated ? zCorrelated : zIndependent;
  let known = 0;
  for (let y = 0; y < a.height; ++y) {
    for (let x = 0; x < a.width; x += runPixels) {
      const rect = { x, y, width: Math.min(runPixels, a.width - x), height: 1 };
      film.pooled(rect, pooled, zFigure);
      for (let i = 0; i < rect.width; ++i) {
        const pixel = y * a.width + x + i;
        if (film.samples[pixel] > 0) known += 1;
        if (pooled[i] > 3) figures.shareAbove3 += 1;
        if (measure === 'z') film.tileError[pixel] = pooled[i];
      }
      const waited = pause();
      if (waited) await waited;
    }
  }
  figures.shareAbove3 /= Math.max(1, known);
  for (const key of ['mse', 'relmse', 'bias'] as const) figures[key] /= Math.max(1, 3 * known);
  film.tilesSeen = 1;
  return { film, figures };
}

function subtract(a: LiveFilm, b: LiveFilm, out: LiveFilm, pixel: number, figures: Figures): void {
  if (!(a.samples[pixel] > 0 && b.samples[pixel] > 0)) return;
  out.samples[pixel] = 1;
  let relative = 0;
  for (let k = 3 * pixel; k < 3 * pixel + 3; ++k) {
    const difference = a.rgb[k] - b.rgb[k];
    out.rgb[k] = difference;
    out.variance[k] = a.variance[k] + b.variance[k];
    const square = (difference * difference) / (b.rgb[k] * b.rgb[k] + 0.01);
    relative += square;
    figures.mse += difference * difference;
    figures.relmse += square;
    figures.bias += difference;
  }
  out.tileError[pixel] = Math.sqrt(relative / 3);
}

/**
 * The mean of n correlated differences has at most the variance mean(v), so z is never too large.
 */
function zCorrelated(variance: number[], mean: number[]): number {
  return zIndependent(variance, mean, 1);
}

/** The mean of n independent differences has the variance mean(v) / n. */
function zIndependent(variance: number[], mean: number[], count: number): number {
  const difference = mean[0] + mean[1] + mean[2];
  const spread = Math.sqrt((variance[0] + variance[1] + variance[2]) / count);
  return spread > 0 ? Math.abs(difference) / spread : difference === 0 ? 0 : NaN;
}

/** Yields to other tasks when a time slice is over, not before. */
function makePause(signal: AbortSignal): () => Promise<void> | undefined {
  let until = performance.now() + sliceMs;
  return () => {
    if (performance.now() < until) return undefined;
    return new Promise<void>((resolve) => setTimeout(resolve, 0)).then(() => {
      if (signal.aborted) throw new DOMException('stopped', 'AbortError');
      until = performance.now() + sliceMs;
    });
  };
}
