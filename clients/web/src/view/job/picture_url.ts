import type { Job, PresetRequest } from 'tessera-render';
import { api } from '../../api/client';

const degrees = (rad: number): number => Number(((rad * 180) / Math.PI).toFixed(4));

type Spec = Job['spec'];
type Vector = [number, number, number];

/** The camera's orbit; null for a camera of the file, whose place only the file knows. */
export function orbitOf({ camera }: Spec): NonNullable<Spec['camera']['orbit']> | null {
  if (camera.orbit) return camera.orbit;
  if (!camera.position || !camera.target) return null;
  const [x, y, z] = camera.position.map((p, i) => p - camera.target![i]!) as Vector;
  const radius = Math.hypot(x, y, z);
  return {
    theta_degrees: degrees(Math.atan2(x, z)),
    phi_degrees: degrees(Math.acos(y / radius)),
    radius,
    target: camera.target,
  };
}

/**
 * Stores the job's settings as a public preset, and returns the address of its image. The scene,
 * the variant and the view are in the address, so that it also shows other scenes and sides.
 */
export async function storeAsUrl({ id, spec }: Job): Promise<{ name: string; url: string }> {
  const orbit = orbitOf(spec);
  if (!orbit) throw new Error('The camera of the file has no angles: choose a view of your own.');
  const name = `render-${id.slice(0, 8)}`;
  const { theta_degrees, phi_degrees } = orbit;
  const { scene, variant, ...settings } = spec;
  const job: PresetRequest['job'] = {
    ...settings,
    name: '',
    labels: {},
    webhook: null,
    camera: { ...spec.camera, position: null, target: null, orbit },
  };
  await api.putPreset(name, { job, public: true });
  const what = encodeURIComponent(scene) + (variant ? `:${encodeURIComponent(variant)}` : '');
  const path = `i/public/${name}/${what}/${theta_degrees},${phi_degrees}.webp`;
  return { name, url: new URL(path, document.baseURI).href };
}
