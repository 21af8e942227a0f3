// The byte formats the mock needs: PNG, CRC-32 and the tile frames of the contract.
import zlib from 'node:zlib';

const crcTable = new Uint32Array(256).map((_, n) => {
  let c = n;
  for (let k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

export function crc32(bytes) {
  let c = 0xffffffff;
  for (let i = 0; i < bytes.length; ++i) c = crcTable[(c ^ bytes[i]) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

function chunk(type, data) {
  const out = Buffer.alloc(12 + data.length);
  out.writeUInt32BE(data.length, 0);
  out.write(type, 4, 'latin1');
  data.copy(out, 8);
  out.writeUInt32BE(crc32(out.subarray(4, 8 + data.length)), 8 + data.length);
  return out;
}

/** rgb: bytes, 3 per pixel. */
export function png(width, height, rgb) {
  const raw = Buffer.alloc((width * 3 + 1) * height);
  for (let y = 0; y < height; ++y)
    Buffer.from(rgb.buffer, y * width * 3, width * 3).copy(raw, y * (width * 3 + 1) + 1);
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 2, 0, 0, 0], 8);
  return Buffer.concat([
    Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]),
    chunk('IHDR', head),
    chunk('IDAT', zlib.deflateSync(raw, { level: 1 })),
    chunk('IEND', Buffer.alloc(0)),
  ]);
}

export const srgb8 = (v) =>
  Math.round(
    255 *
      Math.min(1, Math.max(0, v <= 0.0031308 ? 12.92 * v : 1.055 * Math.pow(v, 1 / 2.4) - 0.055)),
  );

/** planes: Float32Array of 7 * width * height values; null makes the end frame. */
export function tileFrame({ revision, x, y, width, height, error, planes }) {
  const payload = planes
    ? Buffer.from(planes.buffer, planes.byteOffset, planes.byteLength)
    : Buffer.alloc(0);
  const head = Buffer.alloc(32);
  head.write('TSR1', 0, 'latin1');
  head.writeUInt32LE(payload.length, 4);
  head.writeUInt32LE(revision, 8);
  [x, y, width, height].forEach((v, i) => head.writeUInt16LE(v, 12 + 2 * i));
  head.writeUInt32LE(planes ? 0 : 1, 20);
  head.writeFloatLE(error, 24);
  head.writeUInt32LE(crc32(payload), 28);
  return Buffer.concat([head, payload]);
}
