import type { Job, Server } from 'tessera-render';
import {
  cropOf,
  initial,
  integratorOptions,
  localTime,
  type Background,
  type Shadow,
  type EnvironmentMode,
  type FormValues,
  type Ground,
} from './form_model';
import { gridOf, textOfPoints } from './meter_model';
import { holds, usualSettings } from './request_texts';
import { perUnit, stopRules } from './stop_rules';

/** "#rrggbb" of a colour in linear Rec.709, rounded to eight bits. */
function hexOf(linear: number[]): string {
  const channel = (v: number): string => {
    const clipped = Math.min(1, Math.max(0, v));
    const s = clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * clipped ** (1 / 2.4) - 0.055;
    return Math.round(255 * s)
      .toString(16)
      .padStart(2, '0');
  };
  return `#${linear.map(channel).join('')}`;
}

function cameraOf(spec: Job['spec']): Partial<FormValues> {
  const { position, target, up, name, index, vertical_fov_degrees } = spec.camera;
  if (position && target)
    return {
      pose: {
        position: position as [number, number, number],
        target: target as [number, number, number],
        ...(up && { up: up as [number, number, number] }),
        verticalFovDegrees: vertical_fov_degrees ?? 45,
      },
    };
  return { camera: name ?? (index === null ? '' : `#${index}`) };
}

function environmentOf(spec: Job['spec']): Partial<FormValues> {
  const { environment } = spec;
  if (environment === undefined) return { environment: 'scene' };
  if (environment === null) return { environment: 'none' };
  const { preset, sun } = environment;
  const mode = environment.asset ? 'file' : sun ? 'sun' : (preset ?? 'colour');
  return {
    environment: mode as EnvironmentMode,
    ...(sun && {
      sunLatitude: sun.latitude,
      sunLongitude: sun.longitude,
      sunTime: localTime(new Date(sun.time)),
    }),
    environmentAsset: environment.asset ?? '',
    environmentName: environment.asset ? environment.asset.slice(0, 8) : '',
    environmentColour: hexOf(environment.color),
    environmentIntensity: environment.intensity,
    environmentRotation: environment.rotation_degrees,
  };
}

function stageOf(spec: Job['spec']): Partial<FormValues> {
  const { background, ground } = spec;
  return {
    background: (background?.type ?? 'environment') as Background,
    ...(background?.color && { backgroundColour: hexOf(background.color) }),
    ground: (ground?.type ?? 'none') as Ground,
    groundReflection: ground?.reflection ?? 0,
    shadow: (ground?.shadow?.color ?? 'neutral') as Shadow,
    shadowStrength: ground?.shadow?.strength ?? 1,
    shadowSoftness: ground?.shadow?.softness ?? 0,
    throughGlass: background?.through_glass ?? true,
  };
}

/** Estimator options of the job that differ from the usual settings. */
function optionsOf(job: Job, info: Server | null): Record<string, string> {
  const usual = usualSettings(job, info);
  const chosen: Record<string, string> = {};
  for (const { name, patch } of info?.options ?? [])
    if (holds(job.spec, patch) && !holds(usual, patch)) {
      const dot = name.lastIndexOf('.');
      chosen[dot < 0 ? name : name.slice(0, dot)] = name;
    }
  return chosen;
}

function optionsOfIntegrator(
  spec: Job['spec'],
  info: Server | null,
): Record<string, number | string> {
  const own = { ...spec.integrator } as Record<string, number | string | undefined>;
  return Object.fromEntries(
    integratorOptions(info, spec.integrator.type).flatMap(({ name }) => {
      const value = own[name];
      return value === undefined ? [] : [[name, value]];
    }),
  );
}

function stopValues(stop: Job['spec']['stop']): Partial<FormValues> {
  return Object.fromEntries(
    stopRules.flatMap((rule) => {
      const given = stop[rule.member];
      const value = given == null ? initial[rule.value] : given * perUnit(rule);
      return [
        [rule.use, given != null],
        [rule.value, value],
      ];
    }),
  );
}

/** The form as it would have been filled in for this job. */
export function formOf(job: Job, info: Server | null): FormValues {
  const { spec } = job;
  const { stop, film } = spec;
  return {
    ...initial,
    scene: spec.scene,
    name: spec.name,
    output: !film ? 'meter' : spec.meter ? 'both' : 'image',
    plane: spec.meter?.plane ? gridOf(spec.meter.plane) : null,
    points: textOfPoints(spec.meter?.points ?? []),
    ...(film && {
      width: film.width,
      height: film.height,
      crop: film.crop && cropOf(film.crop, film.width, film.height),
      filter: film.filter.type,
    }),
    ...stopValues(stop),
    variant: spec.variant ?? '',
    timeSeconds: spec.time_seconds === undefined ? 0 : spec.time_seconds,
    shutterSeconds: spec.shutter_seconds ?? 0,
    ...cameraOf(spec),
    apertureMm: 1000 * (spec.camera.aperture_radius ?? 0),
    focusM: spec.camera.focus_distance ?? null,
    ...environmentOf(spec),
    ...stageOf(spec),
    integrator: spec.integrator.type,
    maxDepth: spec.integrator.max_depth,
    integratorOptions: optionsOfIntegrator(spec, info),
    sampler: spec.sampler.type,
    lightSampler: spec.light_sampler.type,
    adaptive: spec.adaptive.type,
    seed: spec.seed,
    priority: spec.priority,
    options: optionsOf(job, info),
  };
}
