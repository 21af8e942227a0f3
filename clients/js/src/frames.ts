/** Tile frames of the contract (`application/vnd.tessera.tiles`), cut out of a byte stream. */

const headerBytes = 32;
const maxPayloadBytes = 64 * 1024 * 1024;

export interface TileFrame {
  revision: number;
  x: number;
  y: number;
  width: number;
  height: number;
  end: boolean;
  /** Errors of neighbouring pixels are correlated: variances do not add up over a block. */
  correlated: boolean;
  hasAlpha: boolean;
  /** Only planes r g b and, if hasAlpha, alpha. */
  meanOnly: boolean;
  /** Relative error of the tile; NaN when unknown. */
  error: number;
  /** Planes r g b, vr vg vb, n and, if hasAlpha, alpha; each width * height values, row by row. */
  planes: Float32Array;
}

const crcTable = new Uint32Array(256).map((_, n) => {
  let c = n;
  for (let k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

function crc32(bytes: Uint8Array): number {
  let c = 0xffffffff;
  for (let i = 0; i < bytes.length; ++i) c = crcTable[(c ^ bytes[i]) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

/** float16, as `planes=mean` sends it. */
function fromHalves(bytes: Uint8Array): Float32Array {
  const halves = new Uint16Array(bytes.buffer);
  const out = new Float32Array(halves.length);
  for (let i = 0; i < halves.length; ++i) {
    const bits = halves[i];
    const exponent = (bits >> 10) & 31;
    const fraction = bits & 1023;
    const size = exponent === 0 ? fraction * 2 ** -24 : (1024 + fraction) * 2 ** (exponent - 25);
    out[i] = bits & 0x8000 ? -size : size;
  }
  return out;
}

/** Cuts a stream into frames. */
export class FrameParser {
  private pending = new Uint8Array(1 << 16);
  private used = 0;

  /** The frames that the chunk, of any size, completes. Throws on invalid bytes. */
  push(chunk: Uint8Array): TileFrame[] {
    this.append(chunk);
    const frames: TileFrame[] = [];
    let at = 0;
    for (;;) {
      if (this.used - at < headerBytes) break;
      const view = new DataView(this.pending.buffer, at, headerBytes);
      const isFrame =
        view.getUint8(0) === 0x54 && view.getUint8(1) === 0x53 && view.getUint8(2) === 0x52;
      const payloadBytes = view.getUint32(4, true);
      if (!isFrame || payloadBytes > maxPayloadBytes) throw new Error('the tile stream is damaged');
      if (this.used - at < headerBytes + payloadBytes) break;
      frames.push(this.read(view, at + headerBytes, payloadBytes));
      at += headerBytes + payloadBytes;
    }
    this.pending.copyWithin(0, at, this.used);
    this.used -= at;
    return frames;
  }

  private append(chunk: Uint8Array): void {
    if (this.used + chunk.length > this.pending.length) {
      const larger = new Uint8Array(Math.max(this.pending.length * 2, this.used + chunk.length));
      larger.set(this.pending.subarray(0, this.used));
      this.pending = larger;
    }
    this.pending.set(chunk, this.used);
    this.used += chunk.length;
  }

  private read(view: DataView, from: number, payloadBytes: number): TileFrame {
    const payload = this.pending.slice(from, from + payloadBytes);
    if (crc32(payload) !== view.getUint32(28, true)) throw new Error('a tile arrived damaged');
    const flags = view.getUint32(20, true);
    const frame: TileFrame = {
      revision: view.getUint32(8, true),
      x: view.getUint16(12, true),
      y: view.getUint16(14, true),
      width: view.getUint16(16, true),
      height: view.getUint16(18, true),
      end: (flags & 1) !== 0,
      correlated: (flags & 2) !== 0,
      hasAlpha: (flags & 4) !== 0,
      meanOnly: (flags & 8) !== 0,
      error: view.getFloat32(24, true),
      planes: flags & 8 ? fromHalves(payload) : new Float32Array(payload.buffer),
    };
    const planes = (frame.meanOnly ? 3 : 7) + (frame.hasAlpha ? 1 : 0);
    if (!frame.end && frame.planes.length !== planes * frame.width * frame.height)
      throw new Error('a tile has the wrong size');
    return frame;
  }
}
