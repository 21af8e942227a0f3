// Jobs of the mock server: accumulate noise over a synthetic image and keep the numbers of the API.
import crypto from 'node:crypto';
import { makeNormal, makeTruth } from './mock_picture.mjs';
import { srgb8 } from './mock_codec.mjs';

const TILE = 32;
const FINAL = new Set(['finished', 'failed', 'cancelled']);
export const isFinal = (job) => FINAL.has(job.state);

const cameras = {
  main: null,
  detail: { position: [-0.4, 0.9, 2.6], target: [-0.2, 0.45, 0.6], fov: 40 },
  above: { position: [0.2, 5.5, 1.2], target: [0.1, 0, 0], fov: 45 },
};

export class MockJob {
  constructor(spec, onChange) {
    this.id = crypto.randomUUID();
    this.spec = spec;
    this.state = 'queued';
    this.stopReason = null;
    this.createdAt = new Date().toISOString();
    this.onChange = onChange;
    this.revision = 0;
    this.samples = 0;
    this.elapsed = 0;
    this.rays = 0;
    this.points = [];
    this.failure = null;
    this.log = [];
    this.width = spec.film.width;
    this.height = spec.film.height;
    const columns = Math.ceil(this.width / TILE),
      rows = Math.ceil(this.height / TILE);
    this.tiles = [];
    for (let r = 0; r < rows; ++r) {
      for (let c = 0; c < columns; ++c) {
        this.tiles.push({
          x: c * TILE,
          y: r * TILE,
          width: Math.min(TILE, this.width - c * TILE),
          height: Math.min(TILE, this.height - r * TILE),
          n: 0,
          revision: 0,
          error: NaN,
        });
      }
    }
    // From the centre outwards.
    const mid = [this.width / 2, this.height / 2];
    this.order = [...this.tiles.keys()].sort(
      (a, b) => dist(this.tiles[a], mid) - dist(this.tiles[b], mid),
    );
    this.cursor = 0;
    this.pass = 4;
  }

  start() {
    this.state = 'rendering';
    this.startedAt = new Date().toISOString();
    const camera = this.spec.camera.position
      ? {
          position: this.spec.camera.position,
          target: this.spec.camera.target,
          fov: this.spec.camera.vertical_fov_degrees ?? 45,
        }
      : (cameras[this.spec.camera.name] ?? null);
    this.truth = makeTruth(
      this.width,
      this.height,
      camera,
      this.spec.scene === 'interior' ? 0.35 : 0,
    );
    const pixels = this.width * this.height;
    this.sum = [new Float32Array(pixels * 3), new Float32Array(pixels * 3)];
    this.count = new Float32Array(pixels);
    this.normal = makeNormal(this.spec.seed + 1);
    this.onChange(this, 'state');
  }

  /** Renders one tile; true when a pass ended with it. */
  step() {
    const tile = this.tiles[this.order[this.cursor]];
    const half = this.pass / 2;
    const spread = Math.sqrt(half);
    for (let y = tile.y; y < tile.y + tile.height; ++y) {
      for (let x = tile.x; x < tile.x + tile.width; ++x) {
        const i = y * this.width + x;
        for (let h = 0; h < 2; ++h) {
          const grey = this.normal();
          for (let c = 0; c < 3; ++c) {
            const mean = this.truth.mean[3 * i + c];
            const sigma = this.truth.sigma[i] * (0.15 + mean) * 1.6;
            this.sum[h][3 * i + c] +=
              half * mean + spread * sigma * (0.9 * grey + 0.4 * this.normal());
          }
        }
        this.count[i] += this.pass;
      }
    }
    tile.n += this.pass;
    tile.revision = ++this.revision;
    tile.error = this.errorOf(tile);
    this.rays += tile.width * tile.height * this.pass * 7;
    this.cursor += 1;
    if (this.cursor < this.order.length) return false;
    this.cursor = 0;
    this.samples += this.pass;
    this.pass = Math.max(4, Math.floor(this.samples / 16) * 2);
    return true;
  }

  variance(i, c) {
    const n = this.count[i] / 2;
    const d = this.sum[0][3 * i + c] / n - this.sum[1][3 * i + c] / n;
    return (d * d) / 4;
  }

  mean(i, c) {
    return (this.sum[0][3 * i + c] + this.sum[1][3 * i + c]) / this.count[i];
  }

  errorOf({ x, y, width, height }) {
    let total = 0,
      n = 0;
    for (let py = y; py < y + height; ++py) {
      for (let px = x; px < x + width; ++px) {
        const i = py * this.width + px;
        if (!this.count[i]) continue;
        for (let c = 0; c < 3; ++c) {
          const mu = this.truth.mean[3 * i + c];
          total += this.variance(i, c) / (mu * mu + 0.01);
          n += 1;
        }
      }
    }
    return n ? Math.sqrt(total / n) : NaN;
  }

  endPass() {
    const error = this.errorOf({ x: 0, y: 0, width: this.width, height: this.height });
    const spread = 0.25 / Math.sqrt(1 + this.points.length);
    this.error = {
      relative: error,
      low: error * (1 - spread),
      high: error * (1 + spread),
      grain: 0.95 * error,
      doubt: 0.1 * error,
      unreliable: false,
      confidence: 0.95,
      bias: 'none',
    };
    this.points.push({
      samples_per_pixel: this.samples,
      elapsed_seconds: this.elapsed,
      cpu_seconds: this.elapsed * 2,
      rays: this.rays,
      relative: error,
      low: this.error.low,
      high: this.error.high,
    });
    const stop = this.spec.stop;
    if (stop.samples_per_pixel && this.samples >= stop.samples_per_pixel)
      return 'samples_per_pixel';
    if (stop.relative_error && this.error.high <= stop.relative_error) return 'relative_error';
    if (stop.seconds && this.elapsed >= stop.seconds) return 'seconds';
    return null;
  }

  finish(state, reason) {
    this.state = state;
    this.stopReason = reason;
    this.finishedAt = new Date().toISOString();
    this.onChange(this, 'state');
    this.onChange(this, 'end');
  }

  fraction() {
    if (this.state === 'finished') return 1;
    const stop = this.spec.stop;
    const done = this.samples + (this.pass * this.cursor) / this.tiles.length;
    let f = 0;
    if (stop.samples_per_pixel) f = Math.max(f, done / stop.samples_per_pixel);
    if (stop.seconds) f = Math.max(f, this.elapsed / stop.seconds);
    if (stop.relative_error && this.error)
      f = Math.max(f, (stop.relative_error / this.error.relative) ** 2);
    return Math.min(f, 0.999);
  }

  json() {
    const fraction = this.fraction();
    const done =
      this.samples + (this.tiles.length ? (this.pass * this.cursor) / this.tiles.length : 0);
    return {
      id: this.id,
      state: this.state,
      stop_reason: this.stopReason,
      created_at: this.createdAt,
      started_at: this.startedAt ?? null,
      finished_at: this.finishedAt ?? null,
      spec: this.spec,
      progress: {
        fraction,
        samples_per_pixel: {
          min: this.samples,
          mean: done,
          max: this.samples + (this.cursor ? this.pass : 0),
        },
        elapsed_seconds: this.elapsed,
        cpu_seconds: this.elapsed * 2,
        eta_seconds: isFinal(this)
          ? 0
          : fraction > 0.001
            ? (this.elapsed * (1 - fraction)) / fraction
            : null,
      },
      error: this.error ?? {
        relative: null,
        low: null,
        high: null,
        grain: null,
        doubt: null,
        confidence: 0.95,
        bias: 'none',
      },
      failure: this.failure,
      queue_position: this.state === 'queued' ? 1 : null,
      statistics: {
        rays: this.rays,
        rays_per_second: this.elapsed ? this.rays / this.elapsed : 0,
        efficiency: this.error ? 1 / (this.error.relative ** 2 * this.elapsed * 2) : null,
        rejected_samples: 0,
        peak_bytes: 64e6 + this.width * this.height * 64,
      },
      revision: this.revision,
      available: this.available(),
      film_digest:
        this.state === 'finished'
          ? crypto.createHash('sha256').update(this.id).digest('hex')
          : null,
      warnings:
        this.spec.scene.length === 64
          ? [
              {
                code: 'environment',
                detail: 'The scene has no light of its own: a white environment was added.',
              },
            ]
          : [],
      links: { self: `/v1/jobs/${this.id}` },
    };
  }

  available() {
    return this.revision ? ['image'] : [];
  }

  tilePlanes({ x, y, width, height }) {
    const size = width * height;
    const out = new Float32Array(7 * size);
    for (let py = 0; py < height; ++py) {
      for (let px = 0; px < width; ++px) {
        const i = (y + py) * this.width + x + px,
          o = py * width + px;
        for (let c = 0; c < 3; ++c) {
          out[c * size + o] = this.mean(i, c);
          out[(3 + c) * size + o] = this.variance(i, c);
        }
        out[6 * size + o] = this.count[i];
      }
    }
    return out;
  }

  /** Encoded bytes of a layer, at most max pixels on the longer side. */
  rgb8(layer, max, exposure) {
    const scale = Math.min(1, max / Math.max(this.width, this.height));
    const width = Math.max(1, Math.round(this.width * scale)),
      height = Math.max(1, Math.round(this.height * scale));
    const out = new Uint8Array(width * height * 3);
    for (let y = 0; y < height; ++y) {
      for (let x = 0; x < width; ++x) {
        const i =
          Math.min(this.height - 1, Math.floor(y / scale)) * this.width +
          Math.min(this.width - 1, Math.floor(x / scale));
        for (let c = 0; c < 3; ++c) {
          let v;
          if (layer === 'albedo') v = this.truth.albedo[3 * i + c];
          else if (layer === 'normal') v = 0.5 + 0.5 * this.truth.normal[3 * i + c];
          else if (layer === 'depth')
            v = Number.isFinite(this.truth.depth[i]) ? 1 / (1 + 0.2 * this.truth.depth[i]) : 0;
          else v = this.count[i] ? this.mean(i, c) * 2 ** exposure : 0;
          out[(y * width + x) * 3 + c] = srgb8(v);
        }
      }
    }
    return { width, height, rgb: out };
  }

  pixel(x, y) {
    const i = y * this.width + x;
    const mean = [],
      standard_error = [],
      low = [],
      high = [],
      halves = [[], []];
    for (let c = 0; c < 3; ++c) {
      mean.push(this.mean(i, c));
      standard_error.push(
        (this.truth.sigma[i] * (0.15 + this.truth.mean[3 * i + c]) * 1.6) /
          Math.sqrt(this.count[i]),
      );
      low.push(mean[c] - 1.96 * standard_error[c]);
      high.push(mean[c] + 1.96 * standard_error[c]);
      for (let h = 0; h < 2; ++h) halves[h].push((2 * this.sum[h][3 * i + c]) / this.count[i]);
    }
    return {
      x,
      y,
      samples: this.count[i],
      layers: {
        beauty: { mean, standard_error, low, high, halves },
        albedo: {
          mean: [...this.truth.albedo.subarray(3 * i, 3 * i + 3)],
          standard_error: [0, 0, 0],
          low: null,
          high: null,
          halves: null,
        },
      },
    };
  }

  slope() {
    const p = this.points.slice(-12);
    if (p.length < 3) return { value: null, low: null, high: null };
    const xs = p.map((q) => Math.log(q.samples_per_pixel)),
      ys = p.map((q) => Math.log(q.relative));
    const mx = xs.reduce((a, b) => a + b) / xs.length,
      my = ys.reduce((a, b) => a + b) / ys.length;
    const value =
      xs.reduce((a, x, i) => a + (x - mx) * (ys[i] - my), 0) /
      xs.reduce((a, x) => a + (x - mx) ** 2, 0);
    return { value, low: value - 0.02, high: value + 0.02 };
  }
}

function dist(tile, mid) {
  return Math.hypot(tile.x + tile.width / 2 - mid[0], tile.y + tile.height / 2 - mid[1]);
}
