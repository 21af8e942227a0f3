import type { JobSpec, Scene, SceneCamera } from 'tessera-render';
import { rounded } from '../../ui/format';
import type { Pose } from './form_model';

type Triple = [number, number, number];

/**
 * A camera on a sphere around its target. Angles in radians; azimuth 0 looks along -z, and roll
 * rotates the camera's right and up axes counter-clockwise as seen by the camera.
 */
export interface Orbit {
  target: Triple;
  distance: number;
  azimuth: number;
  elevation: number;
  roll: number;
  fovDegrees: number;
}

const maxElevation = Math.PI / 2 - 0.01;
const startFov = 45;
/** A camera with a smaller roll is level. */
const leastRoll = 1e-4;

/** Direction from the target to the camera, and right and up of a level camera. */
function axesOf(o: Pick<Orbit, 'azimuth' | 'elevation'>): Record<'back' | 'right' | 'up', Triple> {
  const [sin, cos] = [Math.sin(o.azimuth), Math.cos(o.azimuth)];
  const [rise, flat] = [Math.sin(o.elevation), Math.cos(o.elevation)];
  return {
    back: [flat * sin, rise, flat * cos],
    right: [cos, 0, -sin],
    up: [-rise * sin, flat, -rise * cos],
  };
}

const dot = (a: Triple, b: Triple): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Angles of a camera with these back and up vectors, of any length. */
function anglesOf(back: Triple, up: Triple | undefined) {
  const azimuth = Math.atan2(back[0], back[2]);
  const elevation = Math.atan2(back[1], Math.hypot(back[0], back[2]));
  const level = axesOf({ azimuth, elevation });
  const roll = up ? Math.atan2(-dot(up, level.right), dot(up, level.up)) : 0;
  return { azimuth, elevation, roll: Math.abs(roll) < leastRoll ? 0 : roll };
}

/** The server's view of a scene without a camera. */
export function framed(bounds: Scene['bounds'], aspect: number, fovDegrees = startFov): Orbit {
  const low = bounds?.min ?? [-1, -1, -1];
  const high = bounds?.max ?? [1, 1, 1];
  const centre = low.map((v, i) => (v + high[i]) / 2) as [number, number, number];
  const radius = Math.hypot(...low.map((v, i) => high[i] - v)) / 2 || 1;
  const vertical = (fovDegrees * Math.PI) / 180;
  const horizontal = 2 * Math.atan(Math.tan(vertical / 2) * aspect);
  const distance = radius / Math.sin(Math.min(vertical, horizontal) / 2);
  // A model that is flat and seen edge-on from the front is seen from its right.
  const isEdgeOn = high[2] > low[2] && high[0] - low[0] <= 1e-4 * (high[2] - low[2]);
  return {
    target: centre,
    distance,
    azimuth: isEdgeOn ? Math.PI / 2 : 0,
    elevation: Math.atan2(0.25, 1),
    roll: 0,
    fovDegrees,
  };
}

/** The pose of a job's `camera.orbit` in a scene with these bounds. */
export function poseOnOrbit(
  { camera, film }: Pick<JobSpec, 'camera' | 'film'>,
  bounds: Scene['bounds'],
): Pose | null {
  const { orbit, vertical_fov_degrees: fov } = camera;
  if (!orbit || !film) return null;
  const whole = framed(bounds, film.width / film.height, fov ?? startFov);
  return poseOf({
    ...whole,
    azimuth: (orbit.theta_degrees * Math.PI) / 180,
    elevation: ((90 - orbit.phi_degrees) * Math.PI) / 180,
    distance: typeof orbit.radius === 'number' ? orbit.radius : whole.distance,
    target: Array.isArray(orbit.target) ? (orbit.target as Triple) : whole.target,
  });
}

/**
 * Starts at a camera's pose; the target is the point on its axis nearest to the scene's centre. An
 * orthographic camera has no field of view: it is replaced by a perspective one that shows the
 * whole scene from there.
 */
export function fromCamera(
  camera: SceneCamera | undefined,
  bounds: Scene['bounds'],
  aspect: number,
): Orbit | null {
  const { position, direction: forward, vertical_fov_degrees: fovDegrees } = camera ?? {};
  if (!position || !forward) return null;
  const centre = bounds
    ? bounds.min.map((v, i) => (v + bounds.max[i]) / 2)
    : position.map((v, i) => v + forward[i]);
  const along = centre.reduce((sum, v, i) => sum + (v - position[i]) * forward[i], 0);
  const size = bounds ? Math.hypot(...bounds.min.map((v, i) => bounds.max[i] - v)) : 1;
  const away = along > 0.05 * size ? along : 0.3 * size;
  const whole = framed(bounds, aspect);
  return {
    target: position.map((v, i) => v + forward[i] * away) as Triple,
    distance: fovDegrees ? away : whole.distance,
    ...anglesOf(forward.map((v) => -v) as Triple, camera?.up),
    fovDegrees: fovDegrees || whole.fovDegrees,
  };
}

export function fromPose(pose: Pose): Orbit {
  const back = pose.position.map((v, i) => v - pose.target[i]) as Triple;
  return {
    target: pose.target,
    distance: Math.hypot(...back) || 1,
    ...anglesOf(back, pose.up),
    fovDegrees: pose.verticalFovDegrees,
  };
}

/** Right and up of the camera, in the axes of a level one. */
const leveled = (o: Orbit, right: number, up: number): [number, number] => [
  right * Math.cos(o.roll) - up * Math.sin(o.roll),
  right * Math.sin(o.roll) + up * Math.cos(o.roll),
];

export function poseOf(o: Orbit): Pose {
  const { back, right, up } = axesOf(o);
  // A camera that looks straight up or down has no horizon.
  const steep = Math.abs(o.elevation) > maxElevation;
  const [x, y] = leveled(o, 0, 1);
  return {
    position: o.target.map((v, i) => rounded(v + back[i] * o.distance)) as Triple,
    target: o.target.map(rounded) as Triple,
    ...((o.roll || steep) && { up: up.map((v, i) => rounded(x * right[i] + y * v)) as Triple }),
    verticalFovDegrees: rounded(o.fovDegrees),
  };
}

/** A pose in the format of an address. */
export const textOf = ({ position, target, verticalFovDegrees, up }: Pose): string =>
  [...position, ...target, verticalFovDegrees, ...(up ?? [])].join(',');

/** Null if it is not a pose. */
export function poseIn(text: string): Pose | null {
  const [px, py, pz, tx, ty, tz, verticalFovDegrees, ...up] = text.split(',').map(Number);
  const known = [px, py, pz, tx, ty, tz, verticalFovDegrees, ...up].every(Number.isFinite);
  if (!known || !(verticalFovDegrees > 0 && verticalFovDegrees < 180)) return null;
  if ((px === tx && py === ty && pz === tz) || (up.length !== 0 && up.length !== 3)) return null;
  return {
    position: [px, py, pz],
    target: [tx, ty, tz],
    ...(up.length && { up: up as Triple }),
    verticalFovDegrees,
  };
}

/** Rotates the camera to its right and up around the target, in radians. */
export function turned(o: Orbit, right: number, up: number): Orbit {
  const [azimuth, elevation] = leveled(o, right, up);
  const next = Math.max(-maxElevation, Math.min(maxElevation, o.elevation + elevation));
  return { ...o, azimuth: o.azimuth + azimuth, elevation: next };
}

export const nearer = (o: Orbit, factor: number): Orbit => ({
  ...o,
  distance: o.distance / factor,
});

/**
 * Moves camera and target together; right and up as fractions of the image's height at the target.
 */
export function shifted(o: Orbit, right: number, up: number): Orbit {
  const height = 2 * o.distance * Math.tan((o.fovDegrees * Math.PI) / 360);
  const axes = axesOf(o);
  const [x, y] = leveled(o, right, up);
  const target = o.target.map(
    (v, i) => v + height * (x * axes.right[i] + y * axes.up[i]),
  ) as Triple;
  return { ...o, target };
}
