import { isMembers, linesOf, same, type Members } from './request_texts';

/** Settings of an earlier render that the form overrides. */
export interface Reused {
  /** The request of the earlier render. */
  request: Members;
  /** The form's own request when it had just been filled in from it. */
  form: Members;
}

/** Objects whose other members belong to their type. */
const ofTheirType = new Set([
  'integrator',
  'light_sampler',
  'adaptive',
  'filter',
  'mis',
  'roulette',
  'splitting',
  'control_variate',
]);

/** Members of cameras without perspective. */
const ofOtherCameras = ['type', 'orthographic_height', 'fx', 'fy', 'cx', 'cy', 'distortion'];

const membersOf = (value: unknown): Members => (isMembers(value) ? value : {});

/** `own` with the changes from `before` to `now`. */
function changed(own: Members, before: Members, now: Members): Members {
  const out = { ...own };
  for (const key of new Set([...Object.keys(before), ...Object.keys(now)])) {
    const [was, is] = [before[key], now[key]];
    if (same(was, is)) continue;
    const merges = isMembers(is) || (is === undefined && key === 'camera');
    const retyped = ofTheirType.has(key) && membersOf(was).type !== membersOf(is).type;
    if (merges && !retyped) out[key] = changed(membersOf(own[key]), membersOf(was), membersOf(is));
    else if (is === undefined) delete out[key];
    else out[key] = is;
  }
  return out;
}

const pose = ({ vertical_fov_degrees: _, ...rest }: Members): Members => rest;

/**
 * The request of a form that was filled in from an earlier render: members without a field in the
 * form, and those whose field is unchanged, are taken from the earlier render. now: the form's own
 * request.
 */
export function withReused({ request, form }: Reused, now: Members): Members {
  const out = changed(request, form, now);
  const [before, camera] = [membersOf(form.camera), membersOf(now.camera)];
  if (!same(before, camera)) {
    // A camera set in the form has perspective.
    const kept = { ...membersOf(out.camera) };
    for (const key of ofOtherCameras) delete kept[key];
    if (!same(pose(before), pose(camera))) {
      delete kept.orbit;
      delete kept.pose;
    }
    if (Object.keys(kept).length) out.camera = kept;
    else delete out.camera;
  }
  if (!same(form.background, now.background) && isMembers(out.environment)) {
    const { visible: _, ...rest } = out.environment;
    out.environment = rest;
  }
  return out;
}

/** Settings that depend on the scene: cameras and meter points. */
export function forAnotherScene(reused: Reused | null): Reused | null {
  if (!reused) return null;
  const without = ({ camera: _, meter: __, ...rest }: Members): Members => rest;
  return { request: without(reused.request), form: without(reused.form) };
}

/** Names of the settings in `whole` that `form`, the form's own request, does not show. */
export function hiddenSettings(whole: Members, form: Members): [string, string][] {
  const shown = new Set(linesOf(form).map(([name]) => name));
  return linesOf(whole).filter(([name]) => !shown.has(name));
}
