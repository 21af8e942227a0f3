/** Relative luminance of the pixels of an image, row by row from the top. */
export interface Luminances {
  width: number;
  height: number;
  values: Float32Array;
}

/** The exponent's offset, and eight bits of mantissa. */
const exponentBias = 128 + 8;
/** Scanlines of other widths are not run-length encoded. */
const encodedWidths = { least: 8, most: 0x7fff };

/** Reads a line of the header and returns the position after it. */
function lineAt(bytes: Uint8Array, from: number): [string, number] {
  const end = bytes.indexOf(10, from);
  if (end < 0) throw new Error('the header has no end');
  return [String.fromCharCode(...bytes.subarray(from, end)), end + 1];
}

/** Decodes a scanline into four planes of bytes; returns the position after it. */
function readLine(bytes: Uint8Array, from: number, width: number, planes: Uint8Array): number {
  let at = from;
  const isEncoded =
    width >= encodedWidths.least &&
    width <= encodedWidths.most &&
    bytes[at] === 2 &&
    bytes[at + 1] === 2 &&
    bytes[at + 2] === width >> 8 &&
    bytes[at + 3] === (width & 255);
  if (!isEncoded) {
    for (let i = 0; i < 4 * width; ++i) planes[(i & 3) * width + (i >> 2)] = bytes[at++];
    return at;
  }
  at += 4;
  for (let plane = 0; plane < 4; ++plane) {
    const end = (plane + 1) * width;
    for (let i = plane * width; i < end; ) {
      const count = bytes[at++];
      if (count > 128) {
        planes.fill(bytes[at++], i, Math.min(end, i + count - 128));
        i += count - 128;
      } else {
        if (!count) throw new Error('the image is damaged');
        for (let k = 0; k < count && i < end; ++k) planes[i++] = bytes[at++];
      }
    }
  }
  return at;
}

/**
 * Decodes an image in Radiance format with the rows from top to bottom.
 * Source: G. Ward, Real Pixels, in Graphics Gems II, 1991; Rec. 709 for the weights.
 */
export function readRadiance(bytes: Uint8Array): Luminances {
  let [line, at] = lineAt(bytes, 0);
  if (!line.startsWith('#?')) throw new Error('not a Radiance image');
  while (line) [line, at] = lineAt(bytes, at);
  [line, at] = lineAt(bytes, at);
  const size = /^-Y (\d+) \+X (\d+)$/.exec(line);
  if (!size) throw new Error(`the rows are ordered by ${line}`);
  const [height, width] = [Number(size[1]), Number(size[2])];
  const values = new Float32Array(width * height);
  const planes = new Uint8Array(4 * width);
  for (let y = 0; y < height; ++y) {
    at = readLine(bytes, at, width, planes);
    if (at > bytes.length) throw new Error('the image is cut off');
    for (let x = 0; x < width; ++x) {
      const mantissa =
        0.2126 * planes[x] + 0.7152 * planes[width + x] + 0.0722 * planes[2 * width + x];
      values[y * width + x] = mantissa * 2 ** (planes[3 * width + x] - exponentBias);
    }
  }
  return { width, height, values };
}
