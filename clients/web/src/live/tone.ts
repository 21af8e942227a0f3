/** Linear Rec.709 to encoded sRGB, on the CPU and in GLSL, with equal results. */

export const toneMaps = ['srgb', 'linear', 'aces', 'agx', 'khronos-neutral'] as const;
export type ToneMap = (typeof toneMaps)[number];

export const toneMapLabels: Record<ToneMap, string> = {
  srgb: 'sRGB',
  linear: 'Linear',
  aces: 'ACES',
  agx: 'AgX',
  'khronos-neutral': 'Neutral',
};

const clamp01 = (v: number): number => (v < 0 ? 0 : v > 1 ? 1 : v);
const encode = (v: number): number =>
  v <= 0.0031308 ? 12.92 * v : 1.055 * Math.pow(v, 1 / 2.4) - 0.055;

const tableSize = 4096;
const encodeTable = Uint8ClampedArray.from({ length: tableSize + 1 }, (_, i) =>
  Math.round(255 * encode(i / tableSize)),
);

/** Only display clips; NaN is black, and beyond 1e9 everything is white. */
const positive = (v: number): number => (v > 0 ? Math.min(v, 1e9) : 0);

type Rgb = [number, number, number];

function aces(c: Rgb): void {
  const v = (x: number): number =>
    (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.432951) + 0.238081);
  const r = v(0.59719 * c[0] + 0.35458 * c[1] + 0.04823 * c[2]);
  const g = v(0.076 * c[0] + 0.90834 * c[1] + 0.01566 * c[2]);
  const b = v(0.0284 * c[0] + 0.13383 * c[1] + 0.83777 * c[2]);
  c[0] = 1.60475 * r - 0.53108 * g - 0.07367 * b;
  c[1] = -0.10208 * r + 1.10813 * g - 0.00605 * b;
  c[2] = -0.00327 * r - 0.07276 * g + 1.07602 * b;
}

function agx(c: Rgb): void {
  const curve = (v: number): number => {
    const x = clamp01((Math.log2(Math.max(v, 1e-10)) + 12.47393) / 16.5);
    const x2 = x * x,
      x4 = x2 * x2;
    return (
      15.5 * x4 * x2 -
      40.14 * x4 * x +
      31.96 * x4 -
      6.868 * x2 * x +
      0.4298 * x2 +
      0.1191 * x -
      0.00232
    );
  };
  const r = curve(0.842479 * c[0] + 0.0784336 * c[1] + 0.0792237 * c[2]);
  const g = curve(0.0423283 * c[0] + 0.8784686 * c[1] + 0.0791661 * c[2]);
  const b = curve(0.0423757 * c[0] + 0.0784336 * c[1] + 0.879143 * c[2]);
  const lin = (x: number): number => Math.pow(clamp01(x), 2.2);
  c[0] = lin(1.196879 * r - 0.0980208 * g - 0.0990297 * b);
  c[1] = lin(-0.0528969 * r + 1.1519031 * g - 0.0989612 * b);
  c[2] = lin(-0.0529716 * r - 0.0980434 * g + 1.1510737 * b);
}

function neutral(c: Rgb): void {
  const start = 0.8 - 0.04,
    desaturation = 0.15;
  const x = Math.min(c[0], c[1], c[2]);
  const offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
  for (let i = 0; i < 3; ++i) c[i] -= offset;
  const peak = Math.max(c[0], c[1], c[2]);
  if (peak < start) return;
  const d = 1 - start;
  const newPeak = 1 - (d * d) / (peak + d - start);
  const g = 1 - 1 / (desaturation * (peak - newPeak) + 1);
  for (let i = 0; i < 3; ++i) c[i] = c[i] * (newPeak / peak) * (1 - g) + newPeak * g;
}

const curves: Partial<Record<ToneMap, (c: Rgb) => void>> = {
  aces,
  agx,
  'khronos-neutral': neutral,
};
const scratch: Rgb = [0, 0, 0];

/** Writes four bytes. scale: 2^exposure. */
export function toBytes(
  r: number,
  g: number,
  b: number,
  scale: number,
  tone: ToneMap,
  out: Uint8ClampedArray,
  at: number,
): void {
  scratch[0] = positive(r * scale);
  scratch[1] = positive(g * scale);
  scratch[2] = positive(b * scale);
  curves[tone]?.(scratch);
  for (let c = 0; c < 3; ++c) {
    const v = clamp01(scratch[c]);
    out[at + c] = tone === 'linear' ? 255 * v : encodeTable[Math.round(v * tableSize)];
  }
  out[at + 3] = 255;
}

export const toneGlsl = `
vec3 tone_aces(vec3 c) {
  c = vec3(
    dot(vec3(0.59719, 0.35458, 0.04823), c),
    dot(vec3(0.076, 0.90834, 0.01566), c),
    dot(vec3(0.0284, 0.13383, 0.83777), c));
  c = (c * (c + 0.0245786) - 0.000090537) / (c * (0.983729 * c + 0.432951) + 0.238081);
  return vec3(
    dot(vec3(1.60475, -0.53108, -0.07367), c),
    dot(vec3(-0.10208, 1.10813, -0.00605), c),
    dot(vec3(-0.00327, -0.07276, 1.07602), c));
}
vec3 tone_agx(vec3 c) {
  c = vec3(
    dot(vec3(0.842479, 0.0784336, 0.0792237), c),
    dot(vec3(0.0423283, 0.8784686, 0.0791661), c),
    dot(vec3(0.0423757, 0.0784336, 0.8791430), c));
  vec3 x = clamp((log2(max(c, vec3(1e-10))) + 12.47393) / 16.5, 0.0, 1.0);
  vec3 x2 = x * x, x4 = x2 * x2;
  c = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x
    + 0.4298 * x2 + 0.1191 * x - 0.00232;
  c = vec3(
    dot(vec3(1.196879, -0.0980208, -0.0990297), c),
    dot(vec3(-0.0528969, 1.1519031, -0.0989612), c),
    dot(vec3(-0.0529716, -0.0980434, 1.1510737), c));
  return pow(clamp(c, 0.0, 1.0), vec3(2.2));
}
vec3 tone_neutral(vec3 c) {
  float x = min(c.r, min(c.g, c.b));
  c -= x < 0.08 ? x - 6.25 * x * x : 0.04;
  float peak = max(c.r, max(c.g, c.b));
  if (peak < 0.76) return c;
  float new_peak = 1.0 - 0.0576 / (peak - 0.52);
  return mix(c * (new_peak / peak), vec3(new_peak), 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0));
}
vec3 encode_srgb(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}
vec3 display(vec3 c, int tone) {
  c = clamp(c, 0.0, 1e9);
  if (tone == 2) c = tone_aces(c);
  if (tone == 3) c = tone_agx(c);
  if (tone == 4) c = tone_neutral(c);
  c = clamp(c, 0.0, 1.0);
  return tone == 1 ? c : encode_srgb(c);
}`;
