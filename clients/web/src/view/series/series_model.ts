import { sunTimes, type FormValues } from '../submit/form_model';
import { fromPose } from '../submit/orbit';

/** The request of POST /v1/batches. */
export interface SeriesRequest {
  template: Record<string, unknown>;
  matrix: Record<string, unknown[]>;
  name: string;
}

/** Polar angle of views around a model without a placed camera, the default of model-viewer. */
const usualPhi = 75;

const hundredths = (degrees: number): number => Math.round(degrees * 100) / 100;

/** A full turn in equal steps. */
export const turntable = (views: number, from = 0): number[] =>
  Array.from({ length: views }, (_, i) => hundredths((from + (i * 360) / views) % 360));

/** Whether more than one image is requested. */
export const picturesOf = (v: FormValues, variants: string[]): number =>
  Math.max(1, v.views) *
  Math.max(1, v.frames) *
  Math.max(1, sunTimes(v).length) *
  (v.allVariants && variants.length ? variants.length : 1);

const micro = (seconds: number): number => Math.round(seconds * 1e6) / 1e6;

/** Times of an animation's frames; the first is the form's own time. */
export const frameTimes = (v: FormValues): number[] =>
  Array.from({ length: v.frames }, (_, i) => micro((v.timeSeconds ?? 0) + i / v.framesPerSecond));

/** A camera without its position. */
function lensOf(camera: unknown): Record<string, unknown> {
  const lens = { ...(camera as Record<string, unknown> | undefined) };
  for (const key of ['name', 'index', 'position', 'target', 'up', 'orbit']) delete lens[key];
  return lens;
}

/**
 * The jobs of a series: all views of each variant at each time. request: that of one image. A
 * camera placed by hand keeps its height and distance.
 */
export function seriesOf(
  v: FormValues,
  variants: string[],
  request: Record<string, unknown>,
): SeriesRequest {
  const template = { ...request };
  const matrix: Record<string, unknown[]> = {};
  const parts: string[] = [];
  if (v.allVariants && variants.length) {
    matrix.variant = variants;
    parts.push('{variant}');
    delete template.variant;
  }
  if (v.views > 1) {
    const placed = v.pose ? fromPose(v.pose) : null;
    const theta = placed ? hundredths((placed.azimuth * 180) / Math.PI) : 0;
    template.camera = {
      ...lensOf(request.camera),
      orbit: {
        phi_degrees: placed ? hundredths(90 - (placed.elevation * 180) / Math.PI) : usualPhi,
        ...(placed && { radius: placed.distance, target: placed.target }),
      },
    };
    matrix['camera.orbit.theta_degrees'] = turntable(v.views, (theta + 360) % 360);
    parts.push('{theta_degrees}');
  }
  if (v.frames > 1) {
    delete template.time_seconds;
    matrix.time_seconds = frameTimes(v);
    parts.push('{time_seconds} s');
  }
  const times = sunTimes(v);
  if (times.length > 1) {
    matrix['environment.sun.time'] = times;
    parts.push('{time}');
  }
  // Braces would be parsed as placeholders.
  const title = v.name.replace(/[{}]/g, '');
  return { template, matrix, name: [title, ...parts].filter(Boolean).join(' ') };
}
