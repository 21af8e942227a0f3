import { isTemporary, OfflineError, problemOf, RequestError } from './errors.js';
import type { TileFrame } from './frames.js';
import {
  backoff,
  delay,
  followEvents,
  followTiles,
  texts,
  type Follow,
  type FollowTiles,
  type JobEvent,
} from './streams.js';
import type {
  Asset,
  Batch,
  BatchList,
  Comparison,
  Convergence,
  DryRun,
  Job,
  JobList,
  JobRequest,
  JobState,
  LabCancelled,
  LabOutcome,
  LabPoint,
  LabRequest,
  Meter,
  MeterComparison,
  Pixel,
  Preset,
  PresetRequest,
  Scene,
  SceneList,
  Server,
  WorkerList,
  WorkerTiles,
} from './types.js';

/** The bytes of a file. */
export type Bytes = Blob | ArrayBuffer | Uint8Array;

/** Members of a job request, and short forms of the common ones. */
export interface JobOptions extends Omit<JobRequest, 'scene'> {
  /** Width and height of the image in pixels: `film.width` and `film.height`. */
  size?: [number, number];
  /** `stop.relative_error`: 0.03 ends the job when the average pixel is at most 3% off. */
  error?: number;
  /** `stop.seconds`. */
  seconds?: number;
  /** `stop.samples_per_pixel`. */
  samples?: number;
}

export interface RenderOptions extends JobOptions {
  /** Extension of the image file. Default: `png`. */
  format?: string;
  /** Query of the image, such as `{ exposure: 'auto', denoise: 'mixed' }`. */
  query?: Query;
  /** Stops waiting, and cancels a job that no other request has been answered with. */
  signal?: AbortSignal;
}

/** An image file and its job, whose `error` says how accurate the image is. */
export interface RenderedImage {
  bytes: Uint8Array;
  /** Media type. */
  type: string;
  job: Job;
}

export type Query = Record<string, string | number | undefined>;

interface Options extends RequestInit {
  headers?: Record<string, string>;
  /** The body, as a value. */
  json?: unknown;
}

/** What is read of the OpenAPI document. */
interface Description {
  paths: Record<string, { post?: { parameters?: { name: string }[] } } | undefined>;
}

export const isFinal = (state: JobState): boolean =>
  state === 'finished' || state === 'failed' || state === 'cancelled';

/** A complete job request. */
export function requestOf(scene: string, options: JobOptions = {}): JobRequest {
  const { size, error, seconds, samples, ...request } = options;
  const film = size && { width: size[0], height: size[1] };
  const rules = { relative_error: error, seconds, samples_per_pixel: samples };
  const stop = Object.fromEntries(Object.entries(rules).filter(([, value]) => value !== undefined));
  return {
    ...request,
    scene,
    ...(film && { film: { ...request.film, ...film } }),
    ...(Object.keys(stop).length && { stop: { ...request.stop, ...stop } }),
  };
}

const hasRule = ({ error, seconds, samples, stop }: JobOptions): boolean =>
  [error, seconds, samples, stop].some((rule) => rule !== undefined);
const hasExposure = (format: string): boolean => /^(png|jpe?g|webp|avif)$/.test(format);
function raiseUnlessFinished(job: Job): void {
  const title = `The job was ${job.state}.`;
  if (job.state !== 'finished')
    throw new RequestError(
      job.failure ?? { type: 'about:blank', title, status: 409, detail: title },
    );
}
/** Of the job that an answer names. */
const idOf = (answer: Response): string => answer.headers.get('location')!.split('/').at(-1)!;
const jobPath = (id: string): string => `v1/jobs/${encodeURIComponent(id)}`;
const batchPath = (id: string): string => `v1/batches/${encodeURIComponent(id)}`;
const queryOf = (query: Query): string => {
  const known = Object.entries(query).filter(([, value]) => value !== undefined);
  return known.length ? `?${new URLSearchParams(known as [string, string][])}` : '';
};
const once = (): Record<string, string> => ({
  'idempotency-key': globalThis.crypto?.randomUUID?.() ?? `${Date.now()}-${Math.random()}`,
});

/** One server. Refused requests are thrown as RequestError, lost ones as OfflineError. */
export class Client {
  private readonly root: string;
  private readonly key?: string;
  private described?: Promise<Description>;

  /**
   * url: address of the server, with the path below which a proxy places it; empty: relative to
   * the page.
   * key: access key, if the server requires one.
   */
  constructor(url = '', { key }: { key?: string } = {}) {
    this.root = url && url.replace(/\/*$/, '/');
    this.key = key;
  }

  /** Sends any request; path is relative to the server's address. */
  async send(path: string, { json, headers, ...init }: Options = {}): Promise<Response> {
    const all: Record<string, string> = { ...headers };
    if (this.key) all.authorization = `Bearer ${this.key}`;
    if (json !== undefined) all['content-type'] = 'application/json';
    const body = json === undefined ? init.body : JSON.stringify(json);
    let response: Response;
    try {
      response = await fetch(this.root + path, { ...init, headers: all, body });
    } catch (error) {
      if (init.signal?.aborted) throw error;
      throw new OfflineError();
    }
    if (!response.ok) throw new RequestError(await problemOf(response));
    return response;
  }

  /** The same, for the value of an answer in JSON. */
  async json<T>(path: string, options: Options = {}): Promise<T> {
    const headers = { accept: 'application/json', ...options.headers };
    return (await this.send(path, { ...options, headers })).json() as Promise<T>;
  }

  /**
   * Renders an image. Without a stop rule the job ends when the average pixel is at most 3% off, or
   * after 10 s. Unless `query` has an exposure, png, jpg, webp and avif are exposed automatically.
   */
  async render(scene: string | Bytes, options: RenderOptions = {}): Promise<RenderedImage> {
    const { format = 'png', query, signal, ...members } = options;
    const look: Query = { ...(hasExposure(format) && { exposure: 'auto' }), ...query };
    const request = { ...members, ...(!hasRule(members) && { error: 0.03, seconds: 10 }) };
    while (await this.rendersAtOnce({ format, ...query })) {
      const answer = await this.renderAtOnce(scene, request, { format, ...query }, signal);
      const job = await this.wait(idOf(answer), signal);
      raiseUnlessFinished(job);
      if (answer.status !== 200) continue; // The same request gets the image of the ended job.
      const bytes = new Uint8Array(await answer.arrayBuffer());
      return { bytes, type: answer.headers.get('content-type') ?? '', job };
    }
    const made = (await this.submit(scene, request, signal)).id;
    try {
      const job = await this.wait(made, signal);
      raiseUnlessFinished(job);
      const image = await this.image(made, format, look, signal);
      return { bytes: new Uint8Array(await image.arrayBuffer()), type: image.type, job };
    } catch (error) {
      if (signal?.aborted) await this.cancel(made).catch(() => undefined); // The abort is the news.
      throw error;
    }
  }

  /** Whether the server has POST /v1/render with these parameters; its description is read once. */
  private async rendersAtOnce(query: Query): Promise<boolean> {
    this.described ??= this.description<Description>();
    this.described.catch(() => (this.described = undefined));
    const names = (await this.described).paths['/v1/render']?.post?.parameters?.map((p) => p.name);
    return !!names && Object.keys(query).every((name) => names.includes(name));
  }

  /** 200 with the image, or 202; `Location` is the job's. */
  private renderAtOnce(
    scene: string | Bytes,
    members: JobOptions,
    query: Query,
    signal?: AbortSignal,
  ): Promise<Response> {
    const path = `v1/render${queryOf(query)}`;
    if (typeof scene === 'string')
      return this.send(path, { method: 'POST', json: requestOf(scene, members), signal });
    const { scene: _, ...job } = requestOf('', members);
    const body = new FormData();
    const name = scene instanceof Blob && 'name' in scene ? String(scene.name) : 'scene';
    body.set('scene', new Blob([scene as BlobPart]), name);
    body.set('job', JSON.stringify(job));
    return this.send(path, { method: 'POST', body, signal });
  }

  /** Submits a job. scene: a built-in name, the id of a scene, or the bytes of a file. */
  async submit(
    scene: string | Bytes,
    options: JobOptions = {},
    signal?: AbortSignal,
  ): Promise<Job> {
    const id = typeof scene === 'string' ? scene : (await this.uploadScene(scene, { signal })).id;
    return this.submitRequest(requestOf(id, options), signal);
  }

  /** Submits a complete job request. */
  submitRequest(request: object, signal?: AbortSignal): Promise<Job> {
    return this.json('v1/jobs', { method: 'POST', json: request, headers: once(), signal });
  }

  /**
   * Waits until the job has ended; also through a restart of the server. A paused job waits for its
   * `PATCH`: `AbortSignal.timeout(ms)` limits the wait.
   */
  async wait(id: string, signal?: AbortSignal): Promise<Job> {
    for (let attempt = 0; ; ++attempt) {
      signal?.throwIfAborted();
      try {
        const job = await this.json<Job>(`${jobPath(id)}?wait=30`, { signal });
        if (isFinal(job.state)) return job;
        attempt = -1;
      } catch (error) {
        if (!isTemporary(error)) throw error;
        await delay(backoff(attempt), signal);
      }
    }
  }

  /** The job's events until it has ended; a broken stream goes on after its last event. */
  events(id: string, options: Follow = {}): AsyncGenerator<JobEvent> {
    const open = (last: string | null, signal: AbortSignal): Promise<Response> =>
      this.send(`${jobPath(id)}/events`, {
        headers: { accept: 'text/event-stream', ...(last && { 'last-event-id': last }) },
        signal,
        cache: 'no-store',
      });
    return followEvents(open, options);
  }

  /** The job's tiles as they change, until it has ended: linear light, not encoded for display. */
  tiles(id: string, options: FollowTiles = {}): AsyncGenerator<TileFrame> {
    const { planes = 'all', fireflies } = options;
    const open = (after: number, signal: AbortSignal): Promise<Response> =>
      this.send(`${jobPath(id)}/tiles${queryOf({ after, planes, fireflies })}`, {
        headers: { accept: 'application/vnd.tessera.tiles' },
        signal,
        cache: 'no-store',
      });
    return followTiles(open, options);
  }

  /** The image as a file. format: its extension. */
  async image(
    id: string,
    format = 'png',
    query: Query = {},
    signal?: AbortSignal,
  ): Promise<Blob> {
    return (await this.send(this.imagePath(id, format, query), { signal })).blob();
  }

  /** The address of the image. */
  imageUrl(id: string, format = 'png', query: Query = {}): string {
    return this.root + this.imagePath(id, format, query);
  }

  private imagePath(id: string, format: string, query: Query): string {
    return `${jobPath(id)}/image${format && `.${format}`}${queryOf(query)}`;
  }

  /** Sends a .glb, .zip, or .gltf without side files, or what the server converts, by its name. */
  uploadScene(
    file: Bytes,
    { name, signal }: { name?: string; signal?: AbortSignal } = {},
  ): Promise<Scene> {
    return this.json(`v1/scenes${queryOf({ name })}`, {
      method: 'POST',
      body: new Blob([file as BlobPart]),
      headers: { 'content-type': 'application/octet-stream' },
      signal,
    });
  }

  /** Sends any file: an environment, or a part of a scene. */
  uploadAsset(file: Bytes, signal?: AbortSignal): Promise<Asset> {
    const headers = { 'content-type': 'application/octet-stream' };
    const body = new Blob([file as BlobPart]);
    return this.json('v1/assets', { method: 'POST', body, headers, signal });
  }

  /** A scene of uploaded assets. files: asset ids by the names in the document. */
  createScene(gltf: string, files: Record<string, string>, name?: string): Promise<Scene> {
    return this.json(`v1/scenes${queryOf({ name })}`, { method: 'POST', json: { gltf, files } });
  }

  /** The OpenAPI document. */
  description<T = unknown>(signal?: AbortSignal): Promise<T> {
    return this.json('openapi.json', { signal });
  }
  server(signal?: AbortSignal): Promise<Server> {
    return this.json('v1/server', { signal });
  }
  workers(signal?: AbortSignal): Promise<WorkerList> {
    return this.json('v1/workers', { signal });
  }
  workerTiles(id: string, signal?: AbortSignal): Promise<WorkerTiles> {
    return this.json(`${jobPath(id)}/workers`, { signal });
  }

  scene(id: string, signal?: AbortSignal): Promise<Scene> {
    return this.json(`v1/scenes/${encodeURIComponent(id)}`, { signal });
  }
  scenes(): Promise<SceneList> {
    return this.json('v1/scenes');
  }

  /** Newest first, without previews. */
  jobs(
    query: { limit?: number; cursor?: string | null; states?: JobState[] | null; name?: string },
    signal?: AbortSignal,
  ): Promise<JobList> {
    const { limit, cursor, states, name } = query;
    const known = {
      limit,
      cursor: cursor || undefined,
      state: states?.join(),
      name: name || undefined,
    };
    return this.json(`v1/jobs${queryOf({ class: 'normal', ...known })}`, { signal });
  }
  job(id: string, signal?: AbortSignal): Promise<Job> {
    return this.json(jobPath(id), { signal });
  }
  /** Checks a request and estimates its cost. */
  dryRun(request: object, signal?: AbortSignal): Promise<DryRun> {
    return this.json('v1/jobs?dry_run=1', { method: 'POST', json: request, signal });
  }
  patch(id: string, patch: object): Promise<Job> {
    return this.json(jobPath(id), { method: 'PATCH', json: patch });
  }
  cancel(id: string): Promise<Job> {
    return this.json(`${jobPath(id)}/cancel`, { method: 'POST' });
  }
  retry(id: string): Promise<Job> {
    return this.json(`${jobPath(id)}/retry`, { method: 'POST' });
  }
  extend(id: string, stop: object): Promise<Job> {
    return this.json(`${jobPath(id)}/extend`, { method: 'POST', json: { stop } });
  }
  async remove(id: string): Promise<void> {
    await this.send(jobPath(id), { method: 'DELETE' });
  }
  convergence(id: string, signal?: AbortSignal): Promise<Convergence> {
    return this.json(`${jobPath(id)}/convergence`, { signal });
  }
  pixel(id: string, x: number, y: number, signal?: AbortSignal): Promise<Pixel> {
    return this.json(`${jobPath(id)}/pixels/${x}/${y}`, { signal });
  }
  meter(id: string, signal?: AbortSignal): Promise<Meter> {
    return this.json(`${jobPath(id)}/meter`, { signal });
  }

  submitBatch(request: object): Promise<Batch> {
    return this.json('v1/batches', { method: 'POST', json: request, headers: once() });
  }
  batch(id: string, signal?: AbortSignal): Promise<Batch> {
    return this.json(batchPath(id), { signal });
  }
  batches(limit: number, signal?: AbortSignal): Promise<BatchList> {
    return this.json(`v1/batches?limit=${limit}`, { signal });
  }
  cancelBatch(id: string): Promise<Batch> {
    return this.json(`${batchPath(id)}/cancel`, { method: 'POST' });
  }
  retryBatch(id: string): Promise<Batch> {
    return this.json(`${batchPath(id)}/retry`, { method: 'POST' });
  }
  async removeBatch(id: string): Promise<void> {
    await this.send(batchPath(id), { method: 'DELETE' });
  }

  /** Stores a preset: a job without its scene, for images by URL. */
  putPreset(name: string, preset: PresetRequest): Promise<Preset> {
    return this.json(`v1/presets/${encodeURIComponent(name)}`, { method: 'PUT', json: preset });
  }

  compare(a: string, b: string): Promise<Comparison> {
    return this.json('v1/comparisons', { method: 'POST', json: { a, b } });
  }
  compareMeters(a: string, b: string, signal?: AbortSignal): Promise<MeterComparison> {
    return this.json(`v1/comparisons${queryOf({ a, b })}`, { signal });
  }

  /** An experiment of the laboratory, line by line. Aborting the signal ends it on the server. */
  async *lab(
    request: LabRequest,
    signal?: AbortSignal,
  ): AsyncGenerator<LabPoint | LabOutcome | LabCancelled> {
    const response = await this.send('v1/lab/runs', {
      method: 'POST',
      json: request,
      headers: { accept: 'application/x-ndjson' },
      signal,
    });
    let rest = '';
    for await (const text of texts(response)) {
      const lines = (rest + text).split('\n');
      rest = lines.pop() ?? '';
      for (const line of lines) yield JSON.parse(line) as LabPoint | LabOutcome | LabCancelled;
    }
  }

  /** Exchanges an access key for a cookie of the browser, for images and streams of a page. */
  async openSession(key: string): Promise<void> {
    await this.send('v1/session', { method: 'POST', headers: { authorization: `Bearer ${key}` } });
  }
}
