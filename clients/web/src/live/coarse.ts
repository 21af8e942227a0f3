import { FrameParser, type TileFrame } from 'tessera-render';
import { api } from '../api/client';

/** The planes of a whole image as one frame. Missing tiles stay unknown (no samples). */
export function assembled(tiles: TileFrame[], width: number, height: number): TileFrame {
  const hasAlpha = tiles.some((tile) => tile.hasAlpha);
  const count = hasAlpha ? 8 : 7;
  const planes = new Float32Array(count * width * height);
  for (const tile of tiles) {
    const size = tile.width * tile.height;
    for (let plane = 0; plane < (tile.hasAlpha ? 8 : 7); ++plane) {
      for (let row = 0; row < tile.height; ++row) {
        const from = plane * size + row * tile.width;
        const to = (plane * height + tile.y + row) * width + tile.x;
        planes.set(tile.planes.subarray(from, from + tile.width), to);
      }
    }
  }
  const whole = { revision: 0, x: 0, y: 0, end: false, correlated: true, error: NaN };
  return { ...whole, width, height, hasAlpha, meanOnly: false, planes };
}

/**
 * The two nearest pixels of a row or column for each position of a longer one, and the weight of
 * the second.
 */
function neighbours(from: number, to: number): { low: number; high: number; share: number }[] {
  return Array.from({ length: to }, (_, i) => {
    const at = Math.max(0, Math.min(from - 1, ((i + 0.5) * from) / to - 0.5));
    const low = Math.floor(at);
    return { low, high: Math.min(from - 1, low + 1), share: at - low };
  });
}

/** The same image with more pixels, interpolated linearly. */
export function enlarged(frame: TileFrame, width: number, height: number): TileFrame {
  if (frame.width === width && frame.height === height) return frame;
  const columns = neighbours(frame.width, width);
  const rows = neighbours(frame.height, height);
  const planeCount = frame.planes.length / (frame.width * frame.height);
  const planes = new Float32Array(planeCount * width * height);
  let to = 0;
  for (let base = 0; base < frame.planes.length; base += frame.width * frame.height) {
    for (const y of rows) {
      const top = base + y.low * frame.width;
      const bottom = base + y.high * frame.width;
      for (const x of columns) {
        const mixed = (row: number) =>
          frame.planes[row + x.low] * (1 - x.share) + frame.planes[row + x.high] * x.share;
        const above = mixed(top);
        const below = mixed(bottom);
        planes[to++] = above * (1 - y.share) + below * y.share;
      }
    }
  }
  return { ...frame, width, height, planes };
}

/** Returns every tile of a short job when it has ended. */
export async function tilesOf(jobId: string): Promise<TileFrame[]> {
  const response = await api.send(`v1/jobs/${jobId}/tiles?after=0`, {
    headers: { accept: 'application/vnd.tessera.tiles' },
    cache: 'no-store',
  });
  const bytes = new Uint8Array(await response.arrayBuffer());
  return new FrameParser().push(bytes).filter((tile) => !tile.end);
}
