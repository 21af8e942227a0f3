/**
 * Colours of the measuring views. Lightness increases with the value, so that they are readable in
 * grey and with any colour vision.
 */

type Stop = [number, number, number];

// Blue-black through violet and terracotta to pale gold: the page's own tones on an inferno-like
// lightness ramp.
const errorStops: Stop[] = [
  [10, 12, 28],
  [36, 24, 78],
  [92, 30, 108],
  [150, 44, 96],
  [203, 74, 66],
  [238, 124, 44],
  [248, 184, 62],
  [253, 240, 176],
];
const sampleStops: Stop[] = [
  [12, 18, 42],
  [22, 54, 98],
  [24, 96, 128],
  [36, 138, 138],
  [82, 178, 128],
  [160, 210, 110],
  [242, 236, 140],
];

/** The server draws the FLIP map; its colours are these. */
const flipStops: Stop[] = [
  [0, 0, 5],
  [69, 20, 115],
  [186, 56, 84],
  [250, 145, 38],
  [252, 250, 191],
];

export type Ramp = 'error' | 'samples';

function table(stops: Stop[]): Uint8Array {
  const out = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; ++i) {
    const at = (i / 255) * (stops.length - 1);
    const k = Math.min(stops.length - 2, Math.floor(at));
    for (let c = 0; c < 3; ++c)
      out[4 * i + c] = Math.round(stops[k][c] + (stops[k + 1][c] - stops[k][c]) * (at - k));
    out[4 * i + 3] = 255;
  }
  return out;
}

export const ramps: Record<Ramp, Uint8Array> = {
  error: table(errorStops),
  samples: table(sampleStops),
};

/** from, to: where the ramp's low and high end lie, in percent along the direction. */
export function rampCss(ramp: Ramp | 'flip', direction = 'to right', from = 0, to = 100): string {
  const stops = { error: errorStops, samples: sampleStops, flip: flipStops }[ramp];
  const step = (to - from) / (stops.length - 1);
  const parts = stops.map((s, i) => `rgb(${s.join(' ')}) ${from + i * step}%`);
  return `linear-gradient(${direction}, ${parts.join(', ')})`;
}
