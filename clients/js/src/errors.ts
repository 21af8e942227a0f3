import type { FieldError, Problem } from './types.js';

/** A problem of the server (RFC 9457): a request that it refused, or a job that failed. */
export class RequestError extends Error implements Problem {
  constructor(readonly problem: Problem) {
    super(problem.detail);
    this.name = 'RequestError';
  }
  get type(): string {
    return this.problem.type;
  }
  get title(): string {
    return this.problem.title;
  }
  get status(): number {
    return this.problem.status;
  }
  get detail(): string {
    return this.problem.detail;
  }
  get instance(): string | undefined {
    return this.problem.instance;
  }
  /** Where the input is wrong. */
  get errors(): FieldError[] {
    return this.problem.errors ?? [];
  }
}

/** The server did not respond. */
export class OfflineError extends Error {
  constructor() {
    super('The server is not responding.');
    this.name = 'OfflineError';
  }
}

/** Whether the same request may succeed later: the server did not respond or was busy. */
export const isTemporary = (error: unknown): boolean =>
  error instanceof OfflineError ||
  (error instanceof RequestError && [429, 502, 503, 504].includes(error.status));

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

/** A problem whose response has no body. */
export function plainProblem(status: number): Problem {
  const title = plainTitles[status] ?? `The server answered ${status}.`;
  return { type: 'about:blank', title, status, detail: title };
}

export async function problemOf(response: Response): Promise<Problem> {
  const body = (await response.json().catch(() => null)) as Partial<Problem> | null;
  return { ...plainProblem(response.status), ...(body?.title && body) };
}
