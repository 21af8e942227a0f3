import type {
  Batch,
  BatchList,
  Comparison,
  Convergence,
  DryRun,
  FieldError,
  Job,
  JobList,
  JobState,
  Meter,
  MeterComparison,
  Pixel,
  Problem,
  Scene,
  SceneList,
  Server,
  WorkerList,
  WorkerTiles,
} from './types';

/** A member of a request, as JSON Schema. */
export interface Member {
  type?: string;
  description?: string;
  minimum?: number;
  maximum?: number;
  'x-default'?: unknown;
  properties?: Record<string, Member>;
  /** The address of a named part; `anyOf` has one and null. */
  $ref?: string;
  anyOf?: Member[];
}
export interface Description {
  components: { schemas: Record<string, Member> };
}
/** The member itself, or the named part that it refers to. */
export function resolved(member: Member, { components: { schemas } }: Description): Member {
  const name = (member.anyOf?.[0] ?? member).$ref?.split('/').at(-1);
  return (name && schemas[name]) || member;
}

/** The server refused the request. */
export class RequestError extends Error {
  constructor(readonly problem: Problem) {
    super(problem.detail);
  }
  get status(): number {
    return this.problem.status;
  }
  get errors(): FieldError[] {
    return this.problem.errors ?? [];
  }
}

/** The server did not respond. */
export class OfflineError extends Error {
  constructor() {
    super('The server is not responding.');
  }
}

const plainTitles: Record<number, string> = {
  401: 'This server asks for an access key.',
  403: 'The access key does not allow this.',
  404: 'There is no such thing on this server.',
  409: 'This does not fit the present state.',
  413: 'This is larger than the server allows.',
  429: 'The server is busy; try again in a moment.',
  503: 'The server is not ready.',
  507: 'The server has no room left.',
};

/** A refusal without a body. */
export function plainProblem(status: number): Problem {
  const title = plainTitles[status] ?? `The server answered ${status}.`;
  return { type: 'about:blank', title, status, detail: title };
}

export async function problemOf(response: Response): Promise<Problem> {
  const fallback = plainProblem(response.status);
  try {
    const body: unknown = await response.json();
    return typeof body === 'object' && body !== null && 'title' in body
      ? { ...fallback, ...(body as Problem) }
      : fallback;
  } catch {
    return fallback;
  }
}

interface Options {
  method?: string;
  json?: unknown;
  headers?: Record<string, string>;
  signal?: AbortSignal;
}

async function call(path: string, options: Options = {}): Promise<Response> {
  const init: RequestInit = {
    method: options.method ?? 'GET',
    headers: { accept: 'application/json', ...options.headers },
    signal: options.signal,
    credentials: 'same-origin',
  };
  if (options.json !== undefined) {
    init.body = JSON.stringify(options.json);
    (init.headers as Record<string, string>)['content-type'] = 'application/json';
  }
  let response: Response;
  try {
    response = await fetch(path, init);
  } catch (e) {
    if (options.signal?.aborted) throw e;
    throw new OfflineError();
  }
  if (!response.ok) throw new RequestError(await problemOf(response));
  return response;
}

async function json<T>(path: string, options?: Options): Promise<T> {
  return (await call(path, options)).json() as Promise<T>;
}

/** A link of an answer, relative to the page, which a proxy may place below a path. */
export const relative = (link: string): string => link.replace(/^\//, '');

// Addresses are relative to the page.
const job = (id: string): string => `v1/jobs/${encodeURIComponent(id)}`;
const batch = (id: string): string => `v1/batches/${encodeURIComponent(id)}`;

export const api = {
  /** The description of the interface; only what the page reads of it. */
  description: () => json<Description>('openapi.json'),
  server: (signal?: AbortSignal) => json<Server>('v1/server', { signal }),
  workers: (signal?: AbortSignal) => json<WorkerList>('v1/workers', { signal }),
  workerTiles: (id: string, signal?: AbortSignal) =>
    json<WorkerTiles>(`${job(id)}/workers`, { signal }),
  scene: (id: string, signal?: AbortSignal) =>
    json<Scene>(`v1/scenes/${encodeURIComponent(id)}`, { signal }),
  scenes: () => json<SceneList>('v1/scenes'),
  jobs: (
    query: { limit: number; cursor?: string | null; states?: JobState[] | null; name?: string },
    signal?: AbortSignal,
  ) => {
    // Without camera previews.
    const params = new URLSearchParams({ class: 'normal', limit: String(query.limit) });
    if (query.cursor) params.set('cursor', query.cursor);
    if (query.states) params.set('state', query.states.join());
    if (query.name) params.set('name', query.name);
    return json<JobList>(`v1/jobs?${params}`, { signal });
  },
  job: (id: string, signal?: AbortSignal) => json<Job>(job(id), { signal }),
  submit: (request: unknown) =>
    json<Job>('v1/jobs', {
      method: 'POST',
      json: request,
      headers: { 'idempotency-key': crypto.randomUUID?.() ?? String(Math.random()) },
    }),
  dryRun: (request: unknown, signal?: AbortSignal) =>
    json<DryRun>('v1/jobs?dry_run=1', { method: 'POST', json: request, signal }),
  patch: (id: string, patch: unknown) => json<Job>(job(id), { method: 'PATCH', json: patch }),
  cancel: (id: string) => json<Job>(`${job(id)}/cancel`, { method: 'POST' }),
  retry: (id: string) => json<Job>(`${job(id)}/retry`, { method: 'POST' }),
  extend: (id: string, stop: unknown) =>
    json<Job>(`${job(id)}/extend`, { method: 'POST', json: { stop } }),
  submitBatch: (request: unknown) =>
    json<Batch>('v1/batches', {
      method: 'POST',
      json: request,
      headers: { 'idempotency-key': crypto.randomUUID?.() ?? String(Math.random()) },
    }),
  batch: (id: string, signal?: AbortSignal) => json<Batch>(batch(id), { signal }),
  batches: (limit: number, signal?: AbortSignal) =>
    json<BatchList>(`v1/batches?limit=${limit}`, { signal }),
  cancelBatch: (id: string) => json<Batch>(`${batch(id)}/cancel`, { method: 'POST' }),
  retryBatch: (id: string) => json<Batch>(`${batch(id)}/retry`, { method: 'POST' }),
  removeBatch: async (id: string) => void (await call(batch(id), { method: 'DELETE' })),
  remove: async (id: string) => void (await call(job(id), { method: 'DELETE' })),
  convergence: (id: string, signal?: AbortSignal) =>
    json<Convergence>(`${job(id)}/convergence`, { signal }),
  pixel: (id: string, x: number, y: number, signal?: AbortSignal) =>
    json<Pixel>(`${job(id)}/pixels/${x}/${y}`, { signal }),
  meter: (id: string, signal?: AbortSignal) => json<Meter>(`${job(id)}/meter`, { signal }),
  compareMeters: (a: string, b: string, signal?: AbortSignal) =>
    json<MeterComparison>(`v1/comparisons?${new URLSearchParams({ a, b })}`, { signal }),
  compare: (a: string, b: string) =>
    json<Comparison>('v1/comparisons', { method: 'POST', json: { a, b } }),
  openSession: async (key: string) =>
    void (await call('v1/session', {
      method: 'POST',
      headers: { authorization: `Bearer ${key}` },
    })),
  createScene: (gltf: string, files: Record<string, string>, name: string) =>
    json<Scene>(`v1/scenes?name=${encodeURIComponent(name)}`, {
      method: 'POST',
      json: { gltf, files },
    }),
};

export const meterUrl = (id: string): string => `${job(id)}/meter.csv`;

export function imageUrl(
  id: string,
  extension: string,
  query: Record<string, string | number | undefined> = {},
): string {
  const params = new URLSearchParams();
  for (const [key, value] of Object.entries(query))
    if (value !== undefined) params.set(key, String(value));
  const tail = params.toString();
  return `${job(id)}/image${extension ? `.${extension}` : ''}${tail ? `?${tail}` : ''}`;
}

/** Sends bytes and reports the fraction sent. fetch() cannot do that yet. */
export function upload<T>(
  path: string,
  body: Blob,
  type: string,
  onProgress: (share: number) => void,
): Promise<T> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('POST', path);
    request.setRequestHeader('content-type', type);
    request.upload.onprogress = (e) => e.lengthComputable && onProgress(e.loaded / e.total);
    request.onerror = () => reject(new OfflineError());
    request.onload = () => {
      let answer: unknown = null;
      try {
        answer = JSON.parse(request.responseText);
      } catch {
        answer = null;
      }
      if (request.status >= 200 && request.status < 300) return resolve(answer as T);
      reject(new RequestError({ ...plainProblem(request.status), ...(answer as Problem | null) }));
    };
    request.send(body);
  });
}

/** One sentence for the user. */
export function explain(error: unknown): string {
  if (error instanceof RequestError) {
    // The server's message tells programs which header to send.
    if (error.status === 401) return plainTitles[401];
    const { title, detail } = error.problem;
    return detail && detail !== title ? `${title.replace(/\.?$/, '.')} ${capital(detail)}` : title;
  }
  return error instanceof Error ? error.message : String(error);
}

/** The same for a key that the user has just entered. */
export const explainKey = (error: unknown): string =>
  error instanceof RequestError && error.status === 401
    ? 'This key is not known or has expired.'
    : explain(error);

const capital = (s: string): string => s.charAt(0).toUpperCase() + s.slice(1);
