// Makes the KTX2 files of this folder and, for each, the RGBA that Basis Universal decodes it to,
// the reference for our decoder. Run it after `npm install`: node make.mjs
import { writeFileSync } from "node:fs";
import makeBasis from "./node_modules/ktx2-encoder/dist/basis/basis_encoder.js";

const kRgba32 = 13; // cTFRGBA32
const basis = await makeBasis();
basis.initializeBasis();

let state = 12345;
const random = () => {
  state = (Math.imul(state, 1103515245) + 12345) >>> 0;
  return (state >>> 16) & 255;
};

// Areas of one colour, grey, noise, stripes, a gradient and a grid, to use many modes.
function mixed(x, y, alpha) {
  const area = ((x >> 3) + (y >> 3) * 3) % 6;
  const grey = (x * 37 + y * 91) % 256;
  const grid = (x & 3) < 2 ? [10, 200, 30] : [240, 220, (y & 3) * 60];
  const colors = [
    [200, 30, 90, 128],
    [grey, grey, grey, (x * 20) & 255],
    [random(), random(), random(), random()],
    (x + y) % 8 < 4 ? [255, 0, 0, 255] : [0, 64, 255, 40],
    [(x * 8) & 255, (y * 8) & 255, (x * 5 + y * 3) & 255, 255 - ((x * 9) & 255)],
    [...grid, (y * 31) & 255],
  ];
  const color = colors[area];
  return alpha ? color : [...color.slice(0, 3), 255];
}

function encode({ width, height, alpha, uastc, zstd, mips }) {
  const pixels = new Uint8Array(width * height * 4);
  for (let i = 0; i < width * height; ++i) {
    pixels.set(mixed(i % width, Math.floor(i / width), alpha), i * 4);
  }
  const encoder = new basis.BasisEncoder();
  encoder.setCreateKTX2File(true);
  encoder.setTexType(0);
  encoder.setSliceSourceImage(0, pixels, width, height, 0);
  encoder.setUASTC(uastc);
  encoder.setKTX2UASTCSupercompression(zstd);
  encoder.setPackUASTCFlags(3);
  encoder.setQualityLevel(200);
  encoder.setMipGen(mips);
  const space = new Uint8Array(1 << 20);
  const bytes = encoder.encode(space);
  encoder.delete();
  return space.slice(0, bytes);
}

// Blocks of random bits in each of the 19 modes, of which encoders use only some: code, its bits,
// bits until the partition, bits of that, partitions.
const kModes = [
  [0x1, 4], [0x35, 6], [0x1d, 5, 20, 5, 30], [0x3, 5, 20, 4, 11], [0x13, 5, 20, 5, 30], [0xb, 5],
  [0x1b, 5], [0x7, 5, 20, 5, 19], [0x17, 5], [0xf, 5, 28, 5, 30], [0x2, 3], [0x0, 2], [0x6, 3],
  [0x1f, 5], [0xd, 5], [0x5, 7], [0x15, 6, 29, 5, 30], [0x25, 6], [0x9, 4],
];

function randomBlock(mode, partition) {
  const [code, codeBits, at, bits] = kModes[mode];
  const block = Uint8Array.from({ length: 16 }, random);
  const put = (value, from, count) => {
    for (let i = 0; i < count; ++i) {
      const bit = from + i;
      block[bit >> 3] = (block[bit >> 3] & ~(1 << (bit & 7))) | (((value >> i) & 1) << (bit & 7));
    }
  };
  put(code, 0, codeBits);
  if (at !== undefined) {
    put(partition, at, bits);
  }
  return block;
}

function everyMode() {
  const side = 128;
  const file = encode({ width: side, height: side, alpha: true, uastc: true, zstd: false });
  const level = Number(new DataView(file.buffer).getBigUint64(80, true));
  for (let block = 0; block < (side / 4) ** 2; ++block) {
    const mode = block % kModes.length;
    const partition = Math.floor(block / kModes.length) % (kModes[mode][4] ?? 1);
    file.set(randomBlock(mode, partition), level + block * 16);
  }
  return file;
}

function decode(file) {
  const ktx = new basis.KTX2File(file);
  ktx.startTranscoding();
  const pixels = new Uint8Array(ktx.getImageTranscodedSizeInBytes(0, 0, 0, kRgba32));
  if (!ktx.transcodeImage(pixels, 0, 0, 0, kRgba32, 0, -1, -1)) {
    throw new Error("Basis Universal cannot read its own file");
  }
  ktx.delete();
  return pixels;
}

const size = { width: 36, height: 28 };
const files = {
  etc1s: encode({ ...size, alpha: false, uastc: false, zstd: false, mips: false }),
  etc1s_alpha: encode({ ...size, alpha: true, uastc: false, zstd: false, mips: true }),
  etc1s_odd: encode({ width: 5, height: 7, alpha: true, uastc: false, zstd: false, mips: false }),
  uastc: encode({ ...size, alpha: false, uastc: true, zstd: false, mips: true }),
  uastc_zstd: encode({ ...size, alpha: true, uastc: true, zstd: true, mips: false }),
  uastc_modes: everyMode(),
};
for (const [name, file] of Object.entries(files)) {
  writeFileSync(new URL(`${name}.ktx2`, import.meta.url), file);
  writeFileSync(new URL(`${name}.rgba`, import.meta.url), decode(file));
}
