import { explain } from '../api/client';
import type { SceneInfo } from '../api/types';
import { isEnvironment, uploadEnvironment, uploadScene, type DroppedFile } from '../api/upload';
import { go, route } from '../ui/router';
import { say } from '../ui/server_state';
import { persistent, Store } from '../ui/store';
import { change, refusals } from './form_model';

/** Models sent from this page or found on the server; the newest first. */
export const models = new Store<SceneInfo[]>([]);
export const sending = new Store<{ what: string; share: number } | null>(null);
export const sendFault = new Store<string | null>(null);
export const sceneDetails = new Store<SceneInfo | null>(null);

const isNames = (v: unknown): v is Record<string, string> =>
  typeof v === 'object' && v !== null && Object.values(v).every((n) => typeof n === 'string');
/** Models are known by a hash; the names of the files they came from are kept in this browser. */
const fileNames = persistent<Record<string, string>>('tessera.names', {}, isNames);

export const isModel = (scene: string): boolean => /^[0-9a-f]{64}$/.test(scene);

/** What a person calls a scene: its built-in name, the file it came from, or its name inside the file. */
export function sceneName(scene: string): string {
  if (!isModel(scene)) return scene;
  const own = models.get().find((m) => m.id === scene)?.name;
  return fileNames.get()[scene] || own || `Model ${scene.slice(0, 8)}`;
}

/** Takes what was dropped or picked: a model, or an environment. */
export async function take(files: DroppedFile[]): Promise<void> {
  if (!files.length || sending.get()) return;
  sendFault.set(null);
  const report = (what: string, share: number): void => sending.set({ what, share });
  report(files[0].file.name, 0);
  try {
    if (files.length === 1 && isEnvironment(files[0].path)) {
      const asset = await uploadEnvironment(files[0].file, report);
      change({ environment: 'file', environmentAsset: asset, environmentName: files[0].file.name });
      say(`${files[0].file.name} now lights the scene.`);
    } else {
      await takeModel(files, report);
    }
  } catch (error) {
    sendFault.set(explain(error));
  } finally {
    sending.set(null);
  }
}

async function takeModel(
  files: DroppedFile[],
  report: (what: string, share: number) => void,
): Promise<void> {
  const scene = await uploadScene(files, report);
  const main = files.find((f) => /\.(glb|gltf|zip)$/i.test(f.path)) ?? files[0];
  const name = main.file.name.replace(/\.\w+$/, '');
  fileNames.set({ ...fileNames.get(), [scene.id]: name });
  models.set([scene, ...models.get().filter((m) => m.id !== scene.id)]);
  chooseScene(scene.id);
  // What a person wants next is to look at it; where there is no form, they are about something else.
  if (['home', 'job', 'jobs', 'compose'].includes(route.get().view)) go(`/compose/${scene.id}`);
  say(`${name} is ready to render.`);
}

export function chooseScene(scene: string): void {
  change({ scene, camera: '', pose: null, variant: '' });
  refusals.set(refusals.get().filter((r) => r.pointer !== '/scene'));
}
