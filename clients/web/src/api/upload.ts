import { api, upload } from './client';
import type { Scene } from './types';

/** A file with its path inside the drop, `/` between folders. */
export interface DroppedFile {
  path: string;
  file: File;
}

export type UploadReport = (what: string, share: number) => void;

/** A reason that the page found itself, without a request. */
export class UploadError extends Error {}

const environmentPattern = /\.(hdr|exr)$/i;
export const isEnvironment = (name: string): boolean => environmentPattern.test(name);

/** All files of a drop, including those in folders. Must be called inside the drop event. */
export async function filesOfDrop(data: DataTransfer): Promise<DroppedFile[]> {
  const entries = [...data.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const plain = [...data.files].map((file) => ({ path: file.name, file }));
  if (!entries.some((e) => e?.isDirectory)) return plain;
  const out: DroppedFile[] = [];
  for (const entry of entries) if (entry) await walk(entry, '', out);
  return out;
}

async function walk(entry: FileSystemEntry, folder: string, out: DroppedFile[]): Promise<void> {
  const path = folder + entry.name;
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) =>
      (entry as FileSystemFileEntry).file(resolve, reject),
    );
    out.push({ path, file });
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    const batch = await new Promise<FileSystemEntry[]>((resolve, reject) =>
      reader.readEntries(resolve, reject),
    );
    if (!batch.length) return;
    for (const child of batch) await walk(child, `${path}/`, out);
  }
}

export const filesOfInput = (input: HTMLInputElement): DroppedFile[] =>
  [...(input.files ?? [])].map((file) => ({ path: file.webkitRelativePath || file.name, file }));

/** The model among the dropped files: a .glb or .zip, else the outermost .gltf. */
export const modelIn = (files: DroppedFile[]): DroppedFile | undefined =>
  files.find((f) => /\.(glb|zip)$/i.test(f.path)) ??
  files
    .filter((f) => /\.gltf$/i.test(f.path))
    .sort((a, b) => a.path.length - b.path.length)[0];

const nameCharacters = 255;
/** The display name of a file's model, at most as long as the server accepts. */
const nameOf = (file: File): string =>
  [...file.name.replace(/\.\w+$/, '')].slice(0, nameCharacters).join('') || 'model';

/** The result of a drop: the scene and its files. */
export interface SentScene {
  scene: Scene;
  used: File[];
}

/**
 * Sends a model: one .glb, one .zip, one self-contained .gltf, or a .gltf with the files it names.
 */
export async function uploadScene(files: DroppedFile[], report: UploadReport): Promise<SentScene> {
  const model = modelIn(files);
  if (!model) throw new UploadError('There is no .glb, .gltf or .zip among these files.');
  const isDocument = /\.gltf$/i.test(model.path);
  const wanted = isDocument ? await namedFiles(model.file) : [];
  if (wanted.length) return uploadFolder(model, wanted, files, report);
  const type = isDocument
    ? 'model/gltf+json'
    : /\.zip$/i.test(model.path)
      ? 'application/zip'
      : 'model/gltf-binary';
  const query = `?name=${encodeURIComponent(nameOf(model.file))}`;
  const scene = await upload<Scene>(`v1/scenes${query}`, model.file, type, (share) =>
    report(model.file.name, share),
  );
  return { scene, used: [model.file] };
}

async function uploadFolder(
  gltf: DroppedFile,
  wanted: string[],
  files: DroppedFile[],
  report: UploadReport,
): Promise<SentScene> {
  const base = gltf.path.slice(0, gltf.path.lastIndexOf('/') + 1);
  const found = new Map<string, File>();
  const missing: string[] = [];
  for (const uri of wanted) {
    const path = base + decodeUri(uri);
    // A drop of single files has no folders: fall back to the name alone.
    const hit =
      files.find((f) => f.path === path) ??
      files.find((f) => f.file.name === decodeUri(uri).split('/').pop());
    if (hit) found.set(uri, hit.file);
    else missing.push(decodeUri(uri));
  }
  if (missing.length)
    throw new UploadError(
      `${gltf.file.name} needs files that were not dropped with it: ${missing.join(', ')}. ` +
        'Drop the whole folder.',
    );
  const total = [...found.values()].reduce((sum, f) => sum + f.size, gltf.file.size);
  let sent = 0;
  const send = async (file: File): Promise<string> => {
    const answer = await upload<{ id: string }>(
      'v1/assets',
      file,
      'application/octet-stream',
      (share) => report(file.name, (sent + share * file.size) / total),
    );
    sent += file.size;
    return answer.id;
  };
  const ids: Record<string, string> = {};
  for (const [uri, file] of found) {
    const id = await send(file);
    // As written in the document, and without escapes: a server may look for either.
    ids[uri] = id;
    ids[decodeUri(uri)] = id;
  }
  const root = await send(gltf.file);
  const scene = await api.createScene(root, ids, nameOf(gltf.file));
  return { scene, used: [gltf.file, ...found.values()] };
}

/** URIs of buffers and images that are not embedded. */
async function namedFiles(file: File): Promise<string[]> {
  let document: { buffers?: { uri?: string }[]; images?: { uri?: string }[] };
  try {
    document = JSON.parse(await file.text()) as typeof document;
  } catch {
    throw new UploadError(`${file.name} is not valid JSON, so it is not a glTF file.`);
  }
  const uris = [...(document.buffers ?? []), ...(document.images ?? [])]
    .map((e) => e.uri)
    .filter((u): u is string => !!u && !u.startsWith('data:'));
  return [...new Set(uris)];
}

function decodeUri(uri: string): string {
  try {
    return decodeURIComponent(uri).replace(/^\.\//, '');
  } catch {
    return uri;
  }
}

export async function uploadEnvironment(file: File, report: UploadReport): Promise<string> {
  const answer = await upload<{ id: string }>(
    'v1/assets',
    file,
    'application/octet-stream',
    (share) => report(file.name, share),
  );
  return answer.id;
}
