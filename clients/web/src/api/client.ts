import { Client, OfflineError, plainProblem, RequestError, type Problem } from 'tessera-render';

export { OfflineError, RequestError };

/** Its addresses are relative to the page, which a proxy may place below a path. */
export const api = new Client();

/** A member of a request, as JSON Schema. */
export interface Member {
  type?: string;
  description?: string;
  minimum?: number;
  maximum?: number;
  enum?: string[];
  'x-default'?: unknown;
  properties?: Record<string, Member>;
  /** The address of a named part; `anyOf` has one and null. */
  $ref?: string;
  anyOf?: Member[];
}
/** The description of the interface; only what the page reads of it. */
export interface Description {
  components: { schemas: Record<string, Member> };
}
/** The member itself, or the named part that it refers to. */
export function resolved(member: Member, { components: { schemas } }: Description): Member {
  const name = (member.anyOf?.[0] ?? member).$ref?.split('/').at(-1);
  return (name && schemas[name]) || member;
}

/** A link of an answer, relative to the page. */
export const relative = (link: string): string => link.replace(/^\//, '');

export const meterUrl = (id: string): string => `v1/jobs/${encodeURIComponent(id)}/meter.csv`;

export const imageUrl: Client['imageUrl'] = (...image) => api.imageUrl(...image);

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
    const { title, detail } = error.status === 401 ? plainProblem(401) : error;
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
