import type { SceneCamera, SceneInfo } from '../api/types';
import type { Pose } from './form_model';

/** A camera on a sphere around the point it looks at. Angles in radians; azimuth 0 looks along -z. */
export interface Orbit {
  target: [number, number, number];
  distance: number;
  azimuth: number;
  elevation: number;
  fovDegrees: number;
}

const maxElevation = Math.PI / 2 - 0.01;
const startFov = 45;

/** As the server frames a scene without a camera. */
export function framed(bounds: SceneInfo['bounds'], aspect: number): Orbit {
  const low = bounds?.min ?? [-1, -1, -1];
  const high = bounds?.max ?? [1, 1, 1];
  const centre = low.map((v, i) => (v + high[i]) / 2) as [number, number, number];
  const radius = Math.hypot(...low.map((v, i) => high[i] - v)) / 2 || 1;
  const vertical = (startFov * Math.PI) / 180;
  const horizontal = 2 * Math.atan(Math.tan(vertical / 2) * aspect);
  const distance = radius / Math.sin(Math.min(vertical, horizontal) / 2);
  return {
    target: centre,
    distance,
    azimuth: 0,
    elevation: Math.atan2(0.25, 1),
    fovDegrees: startFov,
  };
}

/**
 * Starts where a camera stands; it turns around the point on its axis that is nearest to the scene's centre. Null for
 * an orthographic one, which has no field of view.
 */
export function fromCamera(
  camera: SceneCamera | undefined,
  bounds: SceneInfo['bounds'],
): Orbit | null {
  const { position, direction: forward, vertical_fov_degrees: fovDegrees } = camera ?? {};
  if (!position || !forward || !fovDegrees) return null;
  const centre = bounds
    ? bounds.min.map((v, i) => (v + bounds.max[i]) / 2)
    : position.map((v, i) => v + forward[i]);
  const along = centre.reduce((sum, v, i) => sum + (v - position[i]) * forward[i], 0);
  const size = bounds ? Math.hypot(...bounds.min.map((v, i) => bounds.max[i] - v)) : 1;
  const distance = along > 0.05 * size ? along : 0.3 * size;
  return {
    target: position.map((v, i) => v + forward[i] * distance) as [number, number, number],
    distance,
    azimuth: Math.atan2(-forward[0], -forward[2]),
    elevation: Math.asin(Math.max(-1, Math.min(1, -forward[1]))),
    fovDegrees,
  };
}

export function fromPose(pose: Pose): Orbit {
  const back = pose.position.map((v, i) => v - pose.target[i]);
  const distance = Math.hypot(...back) || 1;
  return {
    target: pose.target,
    distance,
    azimuth: Math.atan2(back[0], back[2]),
    elevation: Math.asin(back[1] / distance),
    fovDegrees: pose.verticalFovDegrees,
  };
}

export function poseOf(o: Orbit): Pose {
  const flat = Math.cos(o.elevation);
  const back = [flat * Math.sin(o.azimuth), Math.sin(o.elevation), flat * Math.cos(o.azimuth)];
  const exact = (v: number): number => Number(v.toPrecision(7));
  return {
    position: o.target.map((v, i) => exact(v + back[i] * o.distance)) as Pose['position'],
    target: o.target.map(exact) as Pose['target'],
    verticalFovDegrees: exact(o.fovDegrees),
  };
}

export function turned(o: Orbit, azimuth: number, elevation: number): Orbit {
  const next = Math.max(-maxElevation, Math.min(maxElevation, o.elevation + elevation));
  return { ...o, azimuth: o.azimuth + azimuth, elevation: next };
}

export const nearer = (o: Orbit, factor: number): Orbit => ({
  ...o,
  distance: o.distance / factor,
});

/** Moves camera and target together; right and up in shares of the picture's height at the target. */
export function shifted(o: Orbit, right: number, up: number): Orbit {
  const height = 2 * o.distance * Math.tan((o.fovDegrees * Math.PI) / 360);
  const sin = Math.sin(o.azimuth);
  const cos = Math.cos(o.azimuth);
  const rise = Math.sin(o.elevation);
  const axisRight = [cos, 0, -sin];
  const axisUp = [-rise * sin, Math.cos(o.elevation), -rise * cos];
  const target = o.target.map(
    (v, i) => v + height * (right * axisRight[i] + up * axisUp[i]),
  ) as Orbit['target'];
  return { ...o, target };
}
