import type { Scene } from 'tessera-render';
import { zipOf } from '../ui/zip';
import { api, RequestError, upload } from './client';

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

/** A file in which macOS keeps what belongs to another file. */
const isFromMacos = (path: string): boolean => /(^|\/)(\._[^/]*$|__MACOSX\/)/.test(path);

/** Formats that the server's converter reads. */
const convertedPattern = /\.(stl|obj|ply|3mf)$/i;

/** The model among the dropped files: a .glb or .zip, else the outermost .gltf, else another. */
export const modelIn = (files: DroppedFile[]): DroppedFile | undefined => {
  const own = files.filter((f) => !isFromMacos(f.path));
  return (
    own.find((f) => /\.(glb|zip)$/i.test(f.path)) ??
    own
      .filter((f) => /\.gltf$/i.test(f.path))
      .sort((a, b) => a.path.length - b.path.length)[0] ??
    own.find((f) => convertedPattern.test(f.path))
  );
};

const nameCharacters = 255;
/** The display name of a file's model, at most as long as the server accepts. */
const nameOf = (file: File): string =>
  [...file.name.replace(/\.\w+$/, '')].slice(0, nameCharacters).join('') || 'model';

/** The result of a drop: the scene and its files. */
export interface SentScene {
  scene: Scene;
  used: File[];
}

const filesPointer = '/files/';

/** Names of the files that the server lacks for a scene: pointers into `files` of a request. */
const missingIn = (error: unknown): string[] =>
  error instanceof RequestError && error.status === 424
    ? error.errors
        .filter((e) => e.pointer.startsWith(filesPointer))
        .map((e) => e.pointer.slice(filesPointer.length).replace(/~1/g, '/').replace(/~0/g, '~'))
    : [];

/** The materials and textures that were dropped with an OBJ. */
const besideObj = (model: DroppedFile, files: DroppedFile[]): DroppedFile[] =>
  /\.obj$/i.test(model.path) ? files.filter((f) => /\.(mtl|png|jpe?g)$/i.test(f.path)) : [];

const packed = async (files: DroppedFile[]): Promise<Blob> =>
  zipOf(
    await Promise.all(
      files.map(async ({ path, file }) => ({
        name: path,
        bytes: new Uint8Array(await file.arrayBuffer()),
      })),
    ),
  );

/**
 * Sends a model: one .glb, .zip or .gltf, and the files beside a document that the server asks for.
 */
export async function uploadScene(files: DroppedFile[], report: UploadReport): Promise<SentScene> {
  const model = modelIn(files);
  if (!model) {
    throw new UploadError(
      'There is no model among these files: .glb, .gltf, .zip, .stl, .obj, .ply or .3mf.',
    );
  }
  const beside = besideObj(model, files);
  const body = beside.length ? await packed([model, ...beside]) : model.file;
  const isArchive = beside.length > 0 || /\.zip$/i.test(model.path);
  const other = convertedPattern.exec(model.path)?.[1]?.toLowerCase();
  const type = /\.gltf$/i.test(model.path)
    ? 'model/gltf+json'
    : isArchive
      ? 'application/zip'
      : `model/${other ?? 'gltf-binary'}`;
  const query = `?name=${encodeURIComponent(nameOf(model.file))}`;
  const known = /\.gltf$/i.test(model.path) ? await namedIn(model, files) : [];
  if (known.length) return uploadWithFiles(model, known, files, report);
  try {
    const scene = await upload<Scene>(`v1/scenes${query}`, body, type, (share) =>
      report(model.file.name, share),
    );
    return { scene, used: [model, ...beside].map((f) => f.file) };
  } catch (error) {
    const missing = missingIn(error);
    if (isArchive || !missing.length) throw error;
    return uploadWithFiles(model, missing, files, report);
  }
}

/** The name as Windows and macOS compare it. */
const folded = (name: string): string =>
  name.replace(/\\/g, '/').normalize('NFC').toLowerCase().normalize('NFC');

/** The file of that path, else the only one that Windows or macOS would take for it. */
function fileAt(path: string, files: DroppedFile[]): DroppedFile | undefined {
  const same = files.find((f) => f.path === path);
  const alike = files.filter((f) => folded(f.path) === folded(path));
  return same ?? (alike.length === 1 ? alike[0] : undefined);
}

/** Resolves `.` and `..`. */
function plainPath(path: string): string {
  const out: string[] = [];
  for (const part of path.split(/[\\/]/)) {
    if (part === '..') out.pop();
    else if (part !== '.' && part !== '') out.push(part);
  }
  return out.join('/');
}

/** The path of the document's folder, which ends with a slash or is empty. */
const baseOf = (document: DroppedFile): string =>
  document.path.slice(0, document.path.lastIndexOf('/') + 1);

function fileFor(name: string, base: string, files: DroppedFile[]): File | undefined {
  const whole = fileAt(base + name, files) ?? fileAt(plainPath(base + name), files);
  if (whole) return whole.file;
  // A drop of single files has no folders: fall back to the name alone.
  const last = name.split(/[\\/]/).pop() ?? '';
  const alone = files.map(({ file }) => ({ path: file.name, file }));
  return fileAt(last, alone)?.file;
}

/** The files of the drop to which a glTF document refers, as it names them. */
async function namedIn(document: DroppedFile, files: DroppedFile[]): Promise<string[]> {
  if (files.length < 2) return [];
  const base = baseOf(document);
  const names = new Set<string>();
  try {
    JSON.parse(await document.file.text(), (key, value) => {
      if (key === 'uri' && typeof value === 'string' && !value.startsWith('data:'))
        names.add(decodeURIComponent(value));
      return value as unknown;
    });
  } catch {
    return []; // The server says what is wrong.
  }
  return [...names].filter((name) => fileFor(name, base, files));
}

async function uploadWithFiles(
  document: DroppedFile,
  wanted: string[],
  files: DroppedFile[],
  report: UploadReport,
): Promise<SentScene> {
  const base = baseOf(document);
  const found = new Map<string, File>();
  const ids: Record<string, string> = {};
  let root = '';
  for (let missing = wanted; ; ) {
    const absent = missing.filter((name) => !fileFor(name, base, files));
    if (absent.length)
      throw new UploadError(
        `${document.file.name} needs files that were not dropped with it: ${absent.join(', ')}. ` +
          'Drop the whole folder.',
      );
    for (const name of missing) found.set(name, fileFor(name, base, files) as File);
    const total = [...found.values()].reduce((sum, f) => sum + f.size, document.file.size);
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
    for (const name of missing) ids[name] = await send(found.get(name) as File);
    root ||= await send(document.file);
    try {
      const scene = await api.createScene(root, ids, nameOf(document.file));
      return { scene, used: [document.file, ...found.values()] };
    } catch (error) {
      missing = missingIn(error);
      if (!missing.length || missing.some((name) => name in ids)) throw error;
    }
  }
}

export async function uploadEnvironment(file: File, report: UploadReport): Promise<string> {
  const answer = await upload<{ id: string }>(
    'v1/assets',
    file,
    /\.exr$/i.test(file.name) ? 'image/x-exr' : 'image/vnd.radiance',
    (share) => report(file.name, share),
  );
  return answer.id;
}
