import type { TileFrame } from 'tessera-render';

export interface Rect {
  x: number;
  y: number;
  width: number;
  height: number;
}

/**
 * Maximum number of pixels that a page keeps as floats (28 bytes each); larger images are encoded
 * by the server.
 */
export const maxLivePixels = 12_000_000;

/** The float planes of one image, filled tile by tile. Nothing here is clipped or encoded. */
export class LiveFilm {
  readonly rgb: Float32Array;
  readonly variance: Float32Array;
  /** Above 0 where there are samples; their number and variance only with all planes. */
  readonly samples: Float32Array;
  /** Relative error of the pixel's tile; in a film computed from others, the value to show. */
  readonly tileError: Float32Array;
  alpha: Float32Array | null = null;
  correlated = false;
  tilesSeen = 0;
  /** Increases with every tile, so that readers notice changes. */
  version = 0;
  /** Sum of the luminance's roots over the known pixels that are not transparent; their number. */
  private roots = 0;
  private opaque = 0;
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
    const last = planes.length - plane;
    if (tile.hasAlpha && !this.alpha)
      this.alpha = new Float32Array(this.width * this.height).fill(1);
    for (let row = 0; row < height; ++row) {
      let from = row * tile.width;
      let to = (y + row) * this.width + x;
      for (let column = 0; column < width; ++column, ++from, ++to) {
        this.weigh(to, -1);
        for (let c = 0; c < 3; ++c) {
          this.rgb[3 * to + c] = planes[c * plane + from];
          this.variance[3 * to + c] = tile.meanOnly ? NaN : planes[(3 + c) * plane + from];
        }
        this.samples[to] = tile.meanOnly ? 1 : planes[6 * plane + from];
        this.tileError[to] = tile.error;
        if (this.alpha && tile.hasAlpha) this.alpha[to] = planes[last + from];
        this.weigh(to, 1);
      }
    }
    this.correlated ||= tile.correlated;
    this.tilesSeen += 1;
    this.version += 1;
    for (const listener of this.listeners) listener({ x, y, width, height });
  }

  private weigh(pixel: number, sign: number): void {
    if (!(this.samples[pixel] > 0) || this.alpha?.[pixel] === 0) return;
    const at = 3 * pixel;
    const { rgb } = this;
    const light = 0.2126 * rgb[at] + 0.7152 * rgb[at + 1] + 0.0722 * rgb[at + 2];
    this.roots += sign * Math.sqrt(Math.max(light, 0));
    this.opaque += sign;
  }

  /** Error of each pixel of a rectangle over its window, as in the server's layer `error`. */
  relativeError(rect: Rect, out: Float32Array): void {
    this.pooled(rect, out, (_variance, _mean, _count, error) => error);
  }

  /** 0.05 (mean root of the luminance)^2, as of the server. */
  private get floor(): number {
    return this.opaque > 0 ? 0.05 * (this.roots / this.opaque) ** 2 : 0;
  }

  /**
   * Computes a value for each pixel of a rectangle from averages over a window of 5 x 5 pixels:
   * variance and mean, by channel, and the error. NaN where nothing is known. The arrays passed to
   * `figure` are reused; count is the number of pixels in the window.
   */
  pooled(
    rect: Rect,
    out: Float32Array,
    figure: (variance: number[], mean: number[], count: number, error: number) => number,
  ): void {
    const radius = 2;
    const x0 = Math.max(0, rect.x - radius);
    const x1 = Math.min(this.width, rect.x + rect.width + radius);
    const columns = x1 - x0;
    const bottom = this.height - 1;
    // First sums over the rows of the window, for every column; then over its columns.
    const sums = new Float32Array(columns * stride);
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
        const [count, error] = average(sums, from, to, variance, mean);
        const at = (y - rect.y) * rect.width + x - rect.x;
        out[at] = count > 0 ? figure(variance, mean, count, error) : NaN;
      }
    }
  }

  /**
   * Half means A and B have the mean m and the variance v = (A - B)^2 / 4, so |A - B| is 2 sqrt(v)
   * and |A| + |B| the larger of that and 2 |m|.
   */
  private addRow(y: number, x0: number, columns: number, sums: Float32Array): void {
    const { floor } = this;
    for (let i = 0; i < columns; ++i) {
      const pixel = y * this.width + x0 + i;
      const known = this.samples[pixel] > 0 && !Number.isNaN(this.variance[3 * pixel]);
      if (!known) continue;
      let apart = 0;
      let scale = 6 * floor;
      for (let c = 0; c < 3; ++c) {
        const variance = this.variance[3 * pixel + c];
        const mean = this.rgb[3 * pixel + c];
        const difference = 2 * Math.sqrt(variance);
        sums[stride * i + c] += variance;
        sums[stride * i + 3 + c] += mean;
        apart += difference;
        scale += Math.max(difference, 2 * Math.abs(mean));
      }
      const share = apart > 0 ? apart / scale : 0;
      sums[stride * i + 6] += share;
      sums[stride * i + 7] += apart * share;
      sums[stride * i + 8] += scale;
      sums[stride * i + 9] += 1;
    }
  }
}

/**
 * Number of sums per column: variance and mean of three channels; r, d r and s of the error (guide,
 * One number for an image); pixels.
 */
const stride = 10;

/** Means over the columns from..to; returns the number of known pixels and their error. */
function average(
  sums: Float32Array,
  from: number,
  to: number,
  variance: number[],
  mean: number[],
): [number, number] {
  let count = 0;
  let shares = 0;
  let doubtful = 0;
  let scale = 0;
  variance.fill(0);
  mean.fill(0);
  for (let i = from; i <= to; ++i) {
    for (let c = 0; c < 3; ++c) {
      variance[c] += sums[stride * i + c];
      mean[c] += sums[stride * i + 3 + c];
    }
    shares += sums[stride * i + 6];
    doubtful += sums[stride * i + 7];
    scale += sums[stride * i + 8];
    count += sums[stride * i + 9];
  }
  for (let c = 0; c < 3; ++c) {
    variance[c] /= count;
    mean[c] /= count;
  }
  const doubt = scale > 0 ? doubtful / scale : 0;
  return [count, Math.min(1, shares / count + doubt / 2)];
}
