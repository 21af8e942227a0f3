import type { TileFrame } from './frames';

export interface Rect {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** Pixels a page keeps as floats (28 bytes each); larger pictures are shown through the server's encoder. */
export const maxLivePixels = 12_000_000;

/** The float planes of one picture, filled tile by tile. Nothing here is clipped or encoded. */
export class LiveFilm {
  readonly rgb: Float32Array;
  readonly variance: Float32Array;
  readonly samples: Float32Array;
  /** Relative error of the tile a pixel is in; in a film made from others, the value to show. */
  readonly tileError: Float32Array;
  alpha: Float32Array | null = null;
  correlated = false;
  tilesSeen = 0;
  /** Grows with every tile; lets a reader know that something changed. */
  version = 0;
  private readonly listeners = new Set<(rect: Rect) => void>();

  constructor(
    readonly width: number,
    readonly height: number,
  ) {
    const pixels = width * height;
    this.rgb = new Float32Array(pixels * 3);
    this.variance = new Float32Array(pixels * 3);
    this.samples = new Float32Array(pixels);
    this.tileError = new Float32Array(pixels);
  }

  onChange(listener: (rect: Rect) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  apply(tile: TileFrame): void {
    const { x, y, planes } = tile;
    const width = Math.min(tile.width, this.width - x);
    const height = Math.min(tile.height, this.height - y);
    if (width <= 0 || height <= 0) return;
    const plane = tile.width * tile.height;
    if (tile.hasAlpha && !this.alpha)
      this.alpha = new Float32Array(this.width * this.height).fill(1);
    for (let row = 0; row < height; ++row) {
      let from = row * tile.width;
      let to = (y + row) * this.width + x;
      for (let column = 0; column < width; ++column, ++from, ++to) {
        for (let c = 0; c < 3; ++c) {
          this.rgb[3 * to + c] = planes[c * plane + from];
          this.variance[3 * to + c] = planes[(3 + c) * plane + from];
        }
        this.samples[to] = planes[6 * plane + from];
        this.tileError[to] = tile.error;
        if (this.alpha && tile.hasAlpha) this.alpha[to] = planes[7 * plane + from];
      }
    }
    this.correlated ||= tile.correlated;
    this.tilesSeen += 1;
    this.version += 1;
    for (const listener of this.listeners) listener({ x, y, width, height });
  }

  /** Relative error of each pixel of a rectangle, pooled as below. */
  relativeError(rect: Rect, out: Float32Array): void {
    this.pooled(rect, out, (variance, mean) => {
      let square = 0;
      for (let c = 0; c < 3; ++c) square += variance[c] / (mean[c] * mean[c] + 0.01);
      return Math.sqrt(square / 3);
    });
  }

  /**
   * A figure for each pixel of a rectangle from variance and mean, both averaged over a window of 5 x 5 pixels: a
   * pixel's variance over its own noisy mean would read low exactly where fireflies are. NaN where nothing is known.
   * The two arguments of `figure` are reused; count is the number of pixels in the window.
   */
  pooled(
    rect: Rect,
    out: Float32Array,
    figure: (variance: number[], mean: number[], count: number) => number,
  ): void {
    const radius = 2;
    const x0 = Math.max(0, rect.x - radius);
    const x1 = Math.min(this.width, rect.x + rect.width + radius);
    const columns = x1 - x0;
    const bottom = this.height - 1;
    // Sums over the rows of the window first, for every column; then over its columns.
    const sums = new Float32Array(columns * 7);
    const variance = [0, 0, 0];
    const mean = [0, 0, 0];
    for (let y = rect.y; y < rect.y + rect.height; ++y) {
      sums.fill(0);
      for (let wy = Math.max(0, y - radius); wy <= Math.min(bottom, y + radius); ++wy) {
        this.addRow(wy, x0, columns, sums);
      }
      for (let x = rect.x; x < rect.x + rect.width; ++x) {
        const from = Math.max(0, x - radius - x0);
        const to = Math.min(columns - 1, x + radius - x0);
        const count = average(sums, from, to, variance, mean);
        const at = (y - rect.y) * rect.width + x - rect.x;
        out[at] = count > 0 ? figure(variance, mean, count) : NaN;
      }
    }
  }

  private addRow(y: number, x0: number, columns: number, sums: Float32Array): void {
    for (let i = 0; i < columns; ++i) {
      const pixel = y * this.width + x0 + i;
      const known = this.samples[pixel] > 0 && !Number.isNaN(this.variance[3 * pixel]);
      if (!known) continue;
      for (let c = 0; c < 3; ++c) {
        sums[7 * i + c] += this.variance[3 * pixel + c];
        sums[7 * i + 3 + c] += this.rgb[3 * pixel + c];
      }
      sums[7 * i + 6] += 1;
    }
  }
}

/** Means over the columns from..to; gives the number of known pixels. */
function average(
  sums: Float32Array,
  from: number,
  to: number,
  variance: number[],
  mean: number[],
): number {
  let count = 0;
  variance.fill(0);
  mean.fill(0);
  for (let i = from; i <= to; ++i) {
    for (let c = 0; c < 3; ++c) {
      variance[c] += sums[7 * i + c];
      mean[c] += sums[7 * i + 3 + c];
    }
    count += sums[7 * i + 6];
  }
  for (let c = 0; c < 3; ++c) {
    variance[c] /= count;
    mean[c] /= count;
  }
  return count;
}
