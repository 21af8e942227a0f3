import type { FieldError, Server } from 'tessera-render';
import { RequestError } from '../../api/client';
import { rounded } from '../../ui/format';
import { Store } from '../../ui/store';
import { hasArea, planeOf, pointsIn, type MeterGrid } from './meter_model';
import { isMembers, type Members } from './request_texts';
import { withReused, type Reused } from './reused_settings';
import { perUnit, rulesFor } from './stop_rules';

/** Presets that the server generates; the page builds the other modes' requests. */
export const presets = ['studio', 'tent', 'rim'] as const;
export type Preset = (typeof presets)[number];
export type EnvironmentMode = 'scene' | Preset | 'sun' | 'colour' | 'file' | 'none';
export const isPreset = (mode: string): mode is Preset => presets.some((p) => p === mode);
export type Shadow = 'neutral' | 'physical';
export type Background = 'environment' | 'transparent' | 'color' | 'blurred';
export type Ground = 'none' | 'catcher' | 'sweep';

/** What a job makes. */
export const outputs = {
  image: 'An image',
  both: 'An image and a light meter',
  meter: 'A light meter, no image',
};
export type Output = keyof typeof outputs;

/** A camera placed by hand. */
export interface Pose {
  position: [number, number, number];
  target: [number, number, number];
  /** Omitted if the camera is level. */
  up?: [number, number, number];
  verticalFovDegrees: number;
}

/** Edges of the rendered part, as fractions of the image: unchanged when the size changes. */
export interface Crop {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

export interface PixelRect {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface FormValues {
  scene: string;
  name: string;
  output: Output;
  /** Where the meter measures a grid; null: nowhere. */
  plane: MeterGrid | null;
  /** Single points of the meter, a line for each. */
  points: string;
  width: number;
  height: number;
  useSamples: boolean;
  samples: number;
  useError: boolean;
  errorPercent: number;
  useDenoisedError: boolean;
  denoisedErrorPercent: number;
  useLightNotFound: boolean;
  lightNotFoundPercent: number;
  useMeterError: boolean;
  meterErrorPercent: number;
  useSeconds: boolean;
  useCpuSeconds: boolean;
  cpuSeconds: number;
  seconds: number;
  camera: string;
  pose: Pose | null;
  /** Radius of the lens for depth of field; 0: everything is sharp. */
  apertureMm: number;
  /** Null: the point that the camera looks at. */
  focusM: number | null;
  crop: Crop | null;
  variant: string;
  /** Null: the rest pose. */
  timeSeconds: number | null;
  shutterSeconds: number;
  environment: EnvironmentMode;
  environmentAsset: string;
  environmentName: string;
  environmentColour: string;
  environmentIntensity: number;
  environmentRotation: number;
  /** Degrees, and a local time in the format of the browser's field. */
  sunLatitude: number;
  sunLongitude: number;
  sunTime: string;
  background: Background;
  backgroundColour: string;
  ground: Ground;
  /** Weight of the ground's clear coat, 0 to 1. */
  groundReflection: number;
  shadow: Shadow;
  shadowStrength: number;
  shadowSoftness: number;
  /** Clear surfaces show what is behind the image. */
  throughGlass: boolean;
  integrator: string;
  /** Null: the server's default. */
  maxDepth: number | null;
  /** Options of the selected integrator that were set, by member. */
  integratorOptions: Record<string, number | string>;
  sampler: string;
  lightSampler: string;
  adaptive: string;
  filter: string;
  seed: number;
  priority: number;
  /** Number of views in a series; 1: one image. */
  views: number;
  allVariants: boolean;
  /** Number of frames of an animation; 1: a still image. */
  frames: number;
  framesPerSecond: number;
  /** Every so many minutes from sunTime until the end of that day; 0: one time. */
  dayMinutes: number;
  /** Selected estimator options: group to option name. */
  options: Record<string, string>;
  /** Members of the request without a field of their own: name to value, as JSON or a text. */
  others: Record<string, string>;
  /** Settings of the render that was used to fill in the form. */
  reused: Reused | null;
}

export const initial: FormValues = {
  scene: '',
  name: '',
  output: 'image',
  plane: null,
  points: '',
  width: 960,
  height: 540,
  useSamples: true,
  samples: 256,
  useError: false,
  errorPercent: 1,
  useDenoisedError: false,
  denoisedErrorPercent: 2,
  useLightNotFound: false,
  lightNotFoundPercent: 5,
  useMeterError: false,
  meterErrorPercent: 10,
  useSeconds: false,
  seconds: 60,
  useCpuSeconds: false,
  cpuSeconds: 60,
  camera: '',
  pose: null,
  apertureMm: 0,
  focusM: null,
  crop: null,
  variant: '',
  timeSeconds: 0,
  shutterSeconds: 0,
  environment: 'scene',
  environmentAsset: '',
  environmentName: '',
  environmentColour: '#ffffff',
  environmentIntensity: 1,
  environmentRotation: 0,
  sunLatitude: 52.5,
  sunLongitude: 13.4,
  sunTime: '2026-06-21T12:00',
  background: 'environment',
  backgroundColour: '#ffffff',
  ground: 'none',
  groundReflection: 0,
  shadow: 'neutral',
  shadowStrength: 1,
  shadowSoftness: 0,
  throughGlass: true,
  integrator: '',
  maxDepth: null,
  integratorOptions: {},
  sampler: '',
  lightSampler: '',
  adaptive: '',
  filter: '',
  seed: 0,
  priority: 0,
  views: 1,
  allVariants: false,
  frames: 1,
  framesPerSecond: 24,
  dayMinutes: 0,
  options: {},
  others: {},
  reused: null,
};

export const form = new Store<FormValues>(initial);
export const change = (patch: Partial<FormValues>): void => form.set({ ...form.get(), ...patch });

/** An option that only some integrators have: a number with a default, or a choice. */
export interface IntegratorOption {
  name: string;
  pointer: string;
  standard?: number;
}

/** The integrator's own options: members that it accepts. */
export function integratorOptions(info: Server | null, type: string): IntegratorOption[] {
  const row = info?.integrators.find((one) => one.type === type);
  const own = (row?.defaults?.integrator ?? {}) as Record<string, number | undefined>;
  const accepted = row?.accepts.filter((at) => at.startsWith('/integrator/')) ?? [];
  return accepted
    .map((pointer) => ({ name: pointer.slice('/integrator/'.length), pointer }))
    .filter(({ name }) => name !== 'max_depth')
    .map((option) => ({ ...option, standard: own[option.name] }));
}

/** The server's refusals by JSON pointer; the empty pointer is the request as a whole. */
export const refusals = new Store<FieldError[]>([]);

export const sizePresets = [
  { label: '480 × 270', note: 'draft', width: 480, height: 270 },
  { label: '960 × 540', note: 'half HD', width: 960, height: 540 },
  { label: '1280 × 720', note: 'HD', width: 1280, height: 720 },
  { label: '1920 × 1080', note: 'full HD', width: 1920, height: 1080 },
  { label: '512 × 512', note: 'square', width: 512, height: 512 },
  { label: '1000 × 1000', note: 'square, shop', width: 1000, height: 1000 },
  { label: '1200 × 1200', note: 'square, shop', width: 1200, height: 1200 },
  { label: '2000 × 2000', note: 'square, zoom', width: 2000, height: 2000 },
  { label: '2048 × 2048', note: 'square, texture', width: 2048, height: 2048 },
  { label: '1080 × 1350', note: 'portrait', width: 1080, height: 1350 },
];

type Offered = { name: string; patch: unknown }[];

/** The job request, with settings of a reused render that the form has no field for. */
export function requestOf(v: FormValues, offered: Offered = []): Record<string, unknown> {
  const request = formRequest(v, offered);
  return v.reused ? withReused(v.reused, request) : request;
}

/**
 * The request from the form's fields; members with default values are omitted, so that the server's
 * defaults apply.
 */
export function formRequest(v: FormValues, offered: Offered = []): Record<string, unknown> {
  const request: Record<string, unknown> = {
    scene: v.scene,
    film:
      v.output === 'meter'
        ? null
        : {
            width: v.width,
            height: v.height,
            ...(v.crop && { crop: cropPixels(v) }),
            ...(v.filter && { filter: { type: v.filter } }),
          },
    stop: stopOf(v),
  };
  if (v.output !== 'image')
    request.meter = {
      ...(v.points.trim() && { points: pointsIn(v.points) }),
      ...(v.plane && { plane: planeOf(v.plane) }),
    };
  if (v.name) request.name = v.name;
  if (v.seed) request.seed = v.seed;
  if (v.priority) request.priority = v.priority;
  const camera = cameraOf(v);
  if (camera) request.camera = camera;
  if (v.variant) request.variant = v.variant;
  if (v.timeSeconds !== 0) request.time_seconds = v.timeSeconds;
  if (v.shutterSeconds > 0) request.shutter_seconds = v.shutterSeconds;
  if (v.integrator || v.maxDepth !== null)
    request.integrator = {
      ...(v.integrator && { type: v.integrator }),
      ...(v.maxDepth !== null && { max_depth: v.maxDepth }),
      ...v.integratorOptions,
    };
  if (v.sampler) request.sampler = { type: v.sampler };
  if (v.lightSampler) request.light_sampler = { type: v.lightSampler };
  if (v.adaptive) request.adaptive = { type: v.adaptive };
  const environment = environmentOf(v);
  if (environment !== undefined) request.environment = environment;
  const background = backgroundOf(v);
  if (background) request.background = background;
  if (v.ground !== 'none')
    request.ground = {
      type: v.ground,
      ...(v.groundReflection > 0 && { reflection: v.groundReflection }),
      ...shadowOf(v),
    };
  const chosen = new Set(Object.values(v.options));
  for (const option of offered) if (chosen.has(option.name)) merge(request, option.patch);
  for (const [name, text] of Object.entries(v.others))
    if (text) put(request, name.split('.'), valueOf(text));
  return request;
}

function put(target: Record<string, unknown>, [key, ...inner]: string[], value: unknown): void {
  if (!inner.length) {
    target[key!] = value;
    return;
  }
  const own = isMembers(target[key!]) ? { ...(target[key!] as Members) } : {};
  target[key!] = own;
  put(own, inner, value);
}

function valueOf(text: string): unknown {
  try {
    return JSON.parse(text) as unknown;
  } catch {
    return text;
  }
}

/** The chosen rules that apply to what the job makes. */
function stopOf(v: FormValues): Record<string, number> {
  const chosen = rulesFor(v).filter((rule) => v[rule.use]);
  return Object.fromEntries(
    chosen.map((rule) => [
      rule.member,
      rule.unit === '%' ? rounded(v[rule.value] / perUnit(rule)) : v[rule.value],
    ]),
  );
}

/** The crop in pixels, at least one. */
export function cropPixels({ crop, width, height }: FormValues): PixelRect | null {
  if (!crop) return null;
  const x = Math.min(width - 1, Math.round(crop.left * width));
  const y = Math.min(height - 1, Math.round(crop.top * height));
  return {
    x,
    y,
    width: Math.max(1, Math.round(crop.right * width) - x),
    height: Math.max(1, Math.round(crop.bottom * height) - y),
  };
}

/** Null: the whole image. Parts beyond it are clipped. */
export function cropOf(rect: PixelRect, width: number, height: number): Crop | null {
  const share = (v: number, size: number): number => Math.max(0, Math.min(size, v)) / size;
  const crop = {
    left: share(rect.x, width),
    top: share(rect.y, height),
    right: share(rect.x + rect.width, width),
    bottom: share(rect.y + rect.height, height),
  };
  return crop.left || crop.top || crop.right < 1 || crop.bottom < 1 ? crop : null;
}

/**
 * RFC 7396 merge patch, in place; nulls are skipped, because they would only remove absent members.
 */
function merge(target: Record<string, unknown>, patch: unknown): void {
  for (const [key, value] of Object.entries((patch ?? {}) as Record<string, unknown>)) {
    if (value === null) continue;
    if (typeof value !== 'object' || Array.isArray(value)) {
      target[key] = value;
      continue;
    }
    const inner = (target[key] ?? {}) as Record<string, unknown>;
    target[key] = inner;
    merge(inner, value);
  }
}

function cameraOf(v: FormValues): Record<string, unknown> | null {
  const camera = { ...placeOf(v), ...lensOf(v) };
  return Object.keys(camera).length ? camera : null;
}

function placeOf(v: FormValues): Record<string, unknown> {
  if (v.pose)
    return {
      position: v.pose.position,
      target: v.pose.target,
      ...(v.pose.up && { up: v.pose.up }),
      vertical_fov_degrees: v.pose.verticalFovDegrees,
    };
  if (!v.camera) return {};
  // Cameras without a name are offered as "#index".
  return v.camera.startsWith('#') ? { index: Number(v.camera.slice(1)) } : { name: v.camera };
}

const lensOf = (v: FormValues): Record<string, unknown> =>
  v.apertureMm > 0
    ? {
        aperture_radius: rounded(v.apertureMm / 1000),
        ...(v.focusM !== null && { focus_distance: v.focusM }),
      }
    : {};

const pad = (n: number): string => String(n).padStart(2, '0');

/** A moment in the format of the browser's field, in local time. */
export const localTime = (moment: Date): string =>
  `${moment.getFullYear()}-${pad(moment.getMonth() + 1)}-${pad(moment.getDate())}` +
  `T${pad(moment.getHours())}:${pad(moment.getMinutes())}`;

/** The same moment in UTC, as in a request. */
export const utcOf = (local: string): string =>
  local && new Date(local).toISOString().replace('.000Z', 'Z');

/** Moments of the day of the sun's time, from that on, as in a request. */
export function sunTimes(v: FormValues): string[] {
  if (v.environment !== 'sun' || !v.sunTime) return [];
  const times = [];
  for (
    let moment = new Date(v.sunTime);
    localTime(moment).slice(0, 10) === v.sunTime.slice(0, 10);
  ) {
    times.push(utcOf(localTime(moment)));
    if (!(v.dayMinutes > 0)) break;
    moment = new Date(moment.getTime() + 60_000 * v.dayMinutes);
  }
  return times;
}

function environmentOf(v: FormValues): unknown {
  if (v.environment === 'scene') return undefined;
  if (v.environment === 'none') return null;
  const common = {
    intensity: v.environmentIntensity,
    rotation_degrees: v.environmentRotation,
  };
  // Until a file is chosen, the scene's own light is shown.
  if (v.environment === 'file')
    return v.environmentAsset ? { asset: v.environmentAsset, ...common } : undefined;
  if (isPreset(v.environment)) return { preset: v.environment, ...common };
  if (v.environment === 'sun') {
    const sun = { latitude: v.sunLatitude, longitude: v.sunLongitude, time: utcOf(v.sunTime) };
    return { sun, ...common };
  }
  return { color: linearOf(v.environmentColour), ...common };
}

/** The shadow on a catcher, without defaults. */
function shadowOf(v: FormValues): object {
  const shadow = {
    ...(v.shadow !== 'neutral' && { color: v.shadow }),
    ...(v.shadowStrength < 1 && { strength: v.shadowStrength }),
    ...(v.shadowSoftness > 0 && { softness: v.shadowSoftness }),
  };
  return v.ground === 'catcher' && Object.keys(shadow).length ? { shadow } : {};
}

function backgroundOf(v: FormValues): unknown {
  if (v.background === 'color') return { type: 'color', color: linearOf(v.backgroundColour) };
  return v.background === 'environment' && v.ground !== 'catcher'
    ? undefined
    : {
        type: v.background,
        ...(v.background === 'transparent' && !v.throughGlass && { through_glass: false }),
      };
}

/** "#rrggbb" as linear Rec.709. */
export function linearOf(hex: string): number[] {
  return [1, 3, 5].map((i) => {
    const s = parseInt(hex.slice(i, i + 2), 16) / 255;
    return rounded(s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
  });
}


/** Errors that the page can detect itself. */
export function check(v: FormValues): FieldError[] {
  const out: FieldError[] = [];
  if (!v.scene) out.push({ pointer: '/scene', detail: 'Choose a scene or drop a model.' });
  if (!Object.keys(stopOf(v)).length)
    out.push({ pointer: '/stop', detail: 'Choose at least one stop condition.' });
  if (v.output !== 'image' && !pointsIn(v.points))
    out.push({ pointer: '/meter/points', detail: 'Give three or six numbers in each line.' });
  if (v.output !== 'image' && v.plane && !hasArea(v.plane))
    out.push({
      pointer: '/meter/plane',
      detail: 'Right must be greater than left, and front greater than back.',
    });
  if (v.output !== 'image' && !v.plane && !v.points.trim())
    out.push({ pointer: '/meter/points', detail: 'Choose a plane or points.' });
  if (v.environment === 'file' && !v.environmentAsset)
    out.push({ pointer: '/environment', detail: 'Choose an .hdr or .exr file.' });
  if (v.environment === 'sun' && !v.sunTime)
    out.push({ pointer: '/environment', detail: 'Choose a date and a time.' });
  return out;
}

export function refusalsOf(error: unknown): FieldError[] {
  // A missing key is not related to a member of the request.
  if (!(error instanceof RequestError) || error.status === 401) return [];
  return error.errors.length
    ? error.errors
    : [{ pointer: error.status === 404 ? '/scene' : '', detail: error.message }];
}
