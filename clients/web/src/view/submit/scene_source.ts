import type { Scene } from 'tessera-render';
import { explain } from '../../api/client';
import {
  isEnvironment,
  modelIn,
  uploadEnvironment,
  uploadScene,
  type DroppedFile,
  type UploadReport,
} from '../../api/upload';
import { isPhotometric, roomFor } from '../../api/luminaire';
import { go, route } from '../../ui/router';
import { say } from '../../ui/server_state';
import { persistent, Store } from '../../ui/store';
import { change, form, refusals } from './form_model';
import { panoramas } from './kept_settings';
import { forAnotherScene } from './reused_settings';

/** Models uploaded from this page or found on the server, newest first. */
export const models = new Store<Scene[]>([]);
export const sending = new Store<{ what: string; share: number } | null>(null);
export const sendFault = new Store<string | null>(null);
/** Files of the last drop that were ignored. */
export const sendNote = new Store<string | null>(null);
export const sceneDetails = new Store<Scene | null>(null);
export const isAnimated = (scene: Scene | null): boolean => (scene?.animations ?? []).length > 0;

const isNames = (v: unknown): v is Record<string, string> =>
  typeof v === 'object' && v !== null && Object.values(v).every((n) => typeof n === 'string');
/** Models are identified by a hash; the names of their files are stored in this browser. */
const fileNames = persistent<Record<string, string>>('tessera.names', {}, isNames);

export const isModel = (scene: string): boolean => /^[0-9a-f]{64}$/.test(scene);

/** The display name of a scene: its built-in name, its file, or its name inside the file. */
export function sceneName(scene: string): string {
  if (!isModel(scene)) return scene;
  const own = models.get().find((m) => m.id === scene)?.name;
  return fileNames.get()[scene] || own || `Model ${scene.slice(0, 8)}`;
}

/** Resolves when all drops so far have been uploaded. */
let lastDrop: Promise<void> = Promise.resolve();
let drops = 0;

/** Accepts dropped or selected files, after earlier drops. */
export function take(files: DroppedFile[]): Promise<void> {
  if (!files.length) return lastDrop;
  if (drops) say(`${files[0].file.name} is next.`);
  else sendFault.set(null);
  drops += 1;
  lastDrop = lastDrop.then(() => send(files)).finally(() => (drops -= 1));
  return lastDrop;
}

/** Uploads a model, an environment map, or one of each. Other files are reported. */
async function send(dropped: DroppedFile[]): Promise<void> {
  // A photometric file without a model that uses it is shown in a room.
  const profile = modelIn(dropped) ? undefined : dropped.find((f) => isPhotometric(f.path));
  const files = profile ? [...dropped, roomFor(profile.file)] : dropped;
  sendNote.set(null);
  const report = (what: string, share: number): void => sending.set({ what, share });
  report(files[0].file.name, 0);
  const panorama = files.find((f) => isEnvironment(f.path));
  const used: File[] = [];
  const news: string[] = [];
  const faults: string[] = [];
  const attempt = async (step: () => Promise<string>): Promise<void> => {
    try {
      news.push(await step());
    } catch (error) {
      faults.push(explain(error));
    }
  };
  if (panorama) {
    used.push(panorama.file);
    await attempt(() => takePanorama(panorama.file, report));
  }
  // Without an environment map the missing model is reported, too.
  if (modelIn(files) || !panorama) await attempt(() => takeModel(files, used, report));
  sending.set(null);
  const left = faults.length ? '' : leftOut(files, used);
  // Messages about an earlier drop stay visible.
  if (faults.length) sendFault.set([sendFault.get(), ...faults].filter(Boolean).join(' '));
  if (left) sendNote.set(left);
  if (news.length) say([...news, left].join(' ').trim());
}

const panoramasAtMost = 12;

async function takePanorama(file: File, report: UploadReport): Promise<string> {
  const asset = await uploadEnvironment(file, report);
  change({ environment: 'file', environmentAsset: asset, environmentName: file.name });
  const others = panoramas.get().filter((map) => map.asset !== asset);
  panoramas.set([{ asset, name: file.name }, ...others].slice(0, panoramasAtMost));
  return `Lighting set to ${file.name}.`;
}

/** used: the files that the model is made of are added to it. */
async function takeModel(
  files: DroppedFile[],
  used: File[],
  report: UploadReport,
): Promise<string> {
  const sent = await uploadScene(files, report);
  used.push(...sent.used);
  const { scene } = sent;
  const name = sent.used[0].name.replace(/\.\w+$/, '');
  fileNames.set({ ...fileNames.get(), [scene.id]: name });
  models.set([scene, ...models.get().filter((m) => m.id !== scene.id)]);
  chooseScene(scene.id);
  // Next the user will want to view it; without a form the user is busy elsewhere.
  if (['home', 'job', 'jobs', 'compose'].includes(route.get().view)) go(`/compose/${scene.id}`);
  return `${name} is ready to render.`;
}

/** Lights a model that brings no light by the studio, unless something else was chosen. */
export function lightUp(scene: Scene): void {
  const { environment, reused } = form.get();
  if (isModel(scene.id) && !bringsLight(scene) && environment === 'scene' && !reused)
    change({ environment: 'studio' });
}

const lightExtensions = ['KHR_materials_emissive_strength', 'EXT_lights_image_based'];

/** As for the API's default environment: an emissive texture alone is decoration. */
const bringsLight = (scene: Scene): boolean =>
  scene.lights.length > 0 || scene.extensions.some((name) => lightExtensions.includes(name));

const namedAtMost = 3;

/**
 * Reports ignored files; for a folder only models and environment maps, because it may contain
 * anything.
 */
function leftOut(files: DroppedFile[], used: File[]): string {
  const names = files
    .filter((f) => !used.includes(f.file))
    .filter((f) => !f.path.includes('/') || modelIn([f]) || isEnvironment(f.path))
    .map((f) => f.file.name);
  if (!names.length) return '';
  const more = names.length - namedAtMost;
  const list = names.slice(0, namedAtMost).join(', ') + (more > 0 ? ` and ${more} more` : '');
  return `Left out: ${list}. Only one model and one environment map can be added at a time.`;
}

export function chooseScene(scene: string): void {
  const still = { timeSeconds: 0, frames: 1 };
  const reused = forAnotherScene(form.get().reused);
  const places = { camera: '', pose: null, plane: null, points: '' };
  change({ scene, ...places, variant: '', allVariants: false, reused, ...still });
  sendNote.set(null);
  refusals.set(refusals.get().filter((r) => r.pointer !== '/scene'));
}
