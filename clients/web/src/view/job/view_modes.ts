import type { TilePlanes } from '../../live/feed_messages';
import type { Look } from '../../live/painter';
import type { Plane } from '../../live/picture';
import type { Display } from '../../ui/server_state';

/** A light share that the job records. */
export type Share = `bounce:${string}` | `light:${string}` | `st:${string}` | 'irradiance';
/** Labels that the job records. */
export type Label =
  | 'object'
  | 'instance'
  | 'material'
  | 'primitive'
  | 'position'
  | 'uv'
  | 'z_depth'
  | 'cryptomatte:object'
  | 'cryptomatte:material';
/** A plane of the live film, or a layer encoded by the server. */
export type Mode = Plane | 'albedo' | 'normal' | 'depth' | 'denoise_bias' | 'mix' | Share | Label;

export interface ModeInfo {
  mode: Mode;
  label: string;
  /** One sentence on how to read it. */
  meaning: string;
}

export const planeModes: ModeInfo[] = [
  { mode: 'picture', label: 'Image', meaning: 'The image so far.' },
  {
    mode: 'error',
    label: 'Error',
    meaning: 'Estimated error of each pixel, relative to its brightness.',
  },
  {
    mode: 'tile-error',
    label: 'Tiles',
    meaning: 'Estimated error of each 32 × 32 tile.',
  },
  {
    mode: 'variance',
    label: 'Variance',
    meaning: 'Variance of each pixel’s mean, in absolute terms: raw and itself noisy.',
  },
  { mode: 'samples', label: 'Samples', meaning: 'How many samples each pixel was given.' },
];

export const layerModes: ModeInfo[] = [
  { mode: 'albedo', label: 'Albedo', meaning: 'Colour of the surfaces without light.' },
  {
    mode: 'normal',
    label: 'Normal',
    meaning: 'Direction of the surfaces: red is x, green y, blue z; middle grey is 0.',
  },
  { mode: 'depth', label: 'Depth', meaning: 'Distance from the camera.' },
  {
    mode: 'denoise_bias',
    label: 'Bias',
    meaning: 'Light that the denoiser adds (bright) or takes (dark), over 15 pixels.',
  },
];

const labelModes: (ModeInfo & { mode: Label })[] = [
  { mode: 'object', label: 'Objects', meaning: 'A colour for each node of the file.' },
  { mode: 'instance', label: 'Instances', meaning: 'A colour for each place of a node.' },
  { mode: 'material', label: 'Materials', meaning: 'A colour for each material.' },
  { mode: 'primitive', label: 'Primitives', meaning: 'A colour for each primitive of a mesh.' },
  { mode: 'position', label: 'Position', meaning: 'Where the surfaces are: x, y, z as colours.' },
  { mode: 'uv', label: 'UV', meaning: 'Texture coordinates: red is u, green v.' },
  { mode: 'z_depth', label: 'Z depth', meaning: 'Distance along the axis of the camera.' },
  {
    mode: 'cryptomatte:object',
    label: 'Object mattes',
    meaning: 'How much each object covers of a pixel, in its colour.',
  },
  {
    mode: 'cryptomatte:material',
    label: 'Material mattes',
    meaning: 'How much each material covers of a pixel, in its colour.',
  },
];
export const isLabel = (name: string): name is Label => labelModes.some((m) => m.mode === name);

export const isShare = (name: string): name is Share =>
  /^(bounce|light|st):./.test(name) || name === 'irradiance';
/** Whether it is a part of the image and thus of the mix. */
export const isPart = (name: string): boolean =>
  isShare(name) && name !== 'irradiance' && !name.endsWith(':unweighted');

/** A layer of `bdpt`: paths of s vertices from the light and t from the camera. */
export interface Strategy {
  layer: Share;
  s: number;
  t: number;
  unweighted: boolean;
}
export function strategyOf(layer: string): Strategy | null {
  const [, s, t, alone] = /^st:(\d+),(\d+)(:unweighted)?$/.exec(layer) ?? [];
  return t ? { layer: layer as Share, s: Number(s), t: Number(t), unweighted: !!alone } : null;
}

function shareMode(name: Share): ModeInfo {
  if (name === 'irradiance')
    return {
      mode: name,
      label: 'Irradiance',
      meaning: 'Light arriving at the surfaces, whatever their colour.',
    };
  const strategy = strategyOf(name);
  if (strategy) {
    const { s, t, unweighted } = strategy;
    return {
      mode: name,
      label: `s${s} t${t}${unweighted ? ' without MIS' : ''}`,
      meaning: `Light of paths with ${s} vertices from the light and ${t} from the camera${
        unweighted ? ': the estimate of this strategy alone, without its MIS weight' : ''
      }.`,
    };
  }
  const [kind, which] = [name.slice(0, name.indexOf(':')), name.slice(name.indexOf(':') + 1)];
  if (kind === 'light')
    return { mode: name, label: which, meaning: `Light of the group of lights “${which}”.` };
  const more = which.endsWith('-') ? ' and more' : '';
  const count = which.replace('-', '');
  return {
    mode: name,
    label: `Bounce ${count}${more && '+'}`,
    meaning: `Light of paths with ${count}${more} scattering events: 0 is emitted, 1 direct light.`,
  };
}

/** Views of the shares that a job records. */
export const shareModes = (layers: readonly string[]): ModeInfo[] =>
  layers.filter(isShare).map(shareMode);

const mixMode: ModeInfo = {
  mode: 'mix',
  label: 'Mix',
  meaning: 'Sum of the shares of the light, each turned up or down.',
};
/** Views of the recorded layers: labels, shares, and the sum of several shares. */
export const jobModes = (layers: readonly string[]): ModeInfo[] => {
  const shares = shareModes(layers);
  const labels = labelModes.filter((m) => layers.includes(m.mode));
  return [...labels, ...shares, ...(layers.filter(isPart).length > 1 ? [mixMode] : [])];
};

export const modeNamed = (name: string): Mode =>
  isShare(name) || isLabel(name) || name === 'mix'
    ? name
    : ([...planeModes, ...layerModes].find((m) => m.mode === name)?.mode ?? 'picture');

export const isLayer = (
  mode: Mode,
): mode is 'albedo' | 'normal' | 'depth' | 'denoise_bias' | 'mix' | Share | Label =>
  mode === 'albedo' ||
  mode === 'normal' ||
  mode === 'depth' ||
  mode === 'denoise_bias' ||
  mode === 'mix' ||
  isShare(mode) ||
  isLabel(mode);

/** The planes that it needs at once; null: none, or once the first look is shown. */
export function planesOf(mode: Mode): TilePlanes | null {
  if (mode === 'tile-error') return 'mean';
  return isHeat(mode) ? 'all' : null;
}
export const isHeat = (mode: Mode): boolean => mode !== 'picture' && !isLayer(mode);

/** Ends of the error ramp, shared by the ruler below the image. */
export const errorRange = { low: 0.001, high: 1 };

export interface Range {
  low: number;
  high: number;
}

export function lookOf(
  mode: Mode,
  display: Display,
  ranges: { variance: Range; samples: Range },
): Look {
  const base = { exposure: display.exposure, tone: display.tone };
  if (mode === 'picture' || isLayer(mode))
    return { ...base, kind: 'colour', ramp: 'error', ...errorRange };
  if (mode === 'samples') return { ...base, kind: 'scalar', ramp: 'samples', ...ranges.samples };
  return {
    ...base,
    kind: 'scalar',
    ramp: 'error',
    ...(mode === 'variance' ? ranges.variance : errorRange),
  };
}
