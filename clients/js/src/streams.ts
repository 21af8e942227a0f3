/**
 * The streams of a job, reopened where they broke. They are read with fetch, not EventSource, so
 * that status codes and pings are seen: a stream that is silent for longer than `silenceMs` is
 * dead, as after a laptop's sleep.
 */
import { EventParser } from './event_parser.js';
import { isTemporary, RequestError } from './errors.js';
import { FrameParser, type TileFrame } from './frames.js';
import type {
  EndEvent,
  Job,
  OverloadedEvent,
  ProgressEvent,
  ResetEvent,
  StateEvent,
  TileEvent,
  WarningEvent,
} from './types.js';

const silenceMs = 40_000;
const maxDelayMs = 6_000;
const steadyMs = 5_000;
const overloadedMs = 5_000;

interface EventData {
  snapshot: Job;
  state: StateEvent;
  progress: ProgressEvent;
  tile: TileEvent;
  warning: WarningEvent;
  end: EndEvent;
  reset: ResetEvent;
  overloaded: OverloadedEvent;
}

/** An event with its id, for `Last-Event-ID`. Every connection begins with a `snapshot`. */
export type JobEvent = {
  [Type in keyof EventData]: { type: Type; data: EventData[Type]; id: string | null };
}[keyof EventData];

export interface Follow {
  signal?: AbortSignal;
  /** Id of the last event that is known: the stream goes on after it. */
  lastEventId?: string | null;
  /** The connection broke and will be opened again. */
  onLost?: () => void;
}

export interface FollowTiles {
  signal?: AbortSignal;
  /** Only tiles that changed after this revision of the image. Default: 0, all. */
  after?: number;
  /** `mean`: without variances and sample counts, a fourth of the bytes. Default: `all`. */
  planes?: 'mean' | 'all';
  /** `set_aside`: without fireflies, as in PNG. Default: `keep`. */
  fireflies?: 'set_aside' | 'keep';
}

/** Opens the stream; throws RequestError if the server refuses. */
type Open<Place> = (place: Place, signal: AbortSignal) => Promise<Response>;

/** The events of a job until it has ended. */
export async function* followEvents(
  open: Open<string | null>,
  { signal, lastEventId = null, onLost }: Follow,
): AsyncGenerator<JobEvent> {
  for (let attempt = 0; ; ++attempt) {
    const began = Date.now();
    const line = new Line(signal);
    const parser = new EventParser();
    let isOverloaded = false;
    try {
      const response = await open(lastEventId, line.signal);
      if (response.status === 204) return;
      for await (const text of texts(response)) {
        line.feed();
        for (const event of parser.push(text)) {
          lastEventId = event.id || lastEventId;
          isOverloaded ||= event.type === 'overloaded';
          yield { ...event, data: JSON.parse(event.data) } as JobEvent;
          if (event.type === 'end') return;
        }
      }
    } catch (error) {
      if (isFinalError(error, signal)) throw error;
    } finally {
      line.close();
    }
    if (!isOverloaded) onLost?.();
    // Do not reconnect immediately after a stream that broke immediately.
    if (Date.now() - began > steadyMs) attempt = 0;
    await delay(isOverloaded ? (parser.retryMs ?? overloadedMs) : backoff(attempt), signal);
  }
}

/** Every tile as it changes, until the job has ended. After a break tiles may come again. */
export async function* followTiles(
  open: Open<number>,
  { signal, after = 0 }: FollowTiles,
): AsyncGenerator<TileFrame> {
  for (let attempt = 0; ; ++attempt) {
    const line = new Line(signal);
    const parser = new FrameParser();
    try {
      const response = await open(after, line.signal);
      line.hold();
      if (response.status === 204) return; // The job renders no image.
      for await (const bytes of chunks(response)) {
        attempt = 0;
        for (const tile of parser.push(bytes)) {
          if (tile.end) return;
          after = Math.max(after, tile.revision);
          yield tile;
        }
      }
    } catch (error) {
      if (isFinalError(error, signal)) throw error;
      // A restarted server may continue from an older revision: request every tile again.
      after = 0;
    } finally {
      line.close();
    }
    await delay(backoff(attempt), signal);
  }
}

/** The bytes of a response as they arrive. */
async function* chunks(response: Response): AsyncGenerator<Uint8Array> {
  const reader = response.body!.getReader();
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      yield value;
    }
  } finally {
    reader.cancel().catch(() => undefined); // Of a broken stream.
  }
}

/** The same as text. */
export async function* texts(response: Response): AsyncGenerator<string> {
  const decoder = new TextDecoder();
  for await (const bytes of chunks(response)) yield decoder.decode(bytes, { stream: true });
}

/** A connection that is cut by the caller's signal, or if it is silent for `silenceMs`. */
class Line {
  private readonly own = new AbortController();
  private timer?: ReturnType<typeof setTimeout>;
  readonly signal = this.own.signal;
  readonly close = (): void => {
    this.hold();
    this.outer?.removeEventListener('abort', this.close);
    this.own.abort();
  };

  constructor(private readonly outer?: AbortSignal) {
    outer?.throwIfAborted();
    outer?.addEventListener('abort', this.close);
    this.feed();
  }

  feed(): void {
    this.hold();
    this.timer = setTimeout(this.close, silenceMs);
  }

  /** Silence is allowed until the next feed(). */
  hold(): void {
    clearTimeout(this.timer);
  }
}

/** A server in trouble may recover: the stream is opened again. */
const isFinalError = (error: unknown, signal?: AbortSignal): boolean =>
  signal?.aborted ||
  (error instanceof RequestError && error.status < 500 && !isTemporary(error));

/** Milliseconds to wait after some failed attempts. */
export const backoff = (attempt: number): number =>
  Math.min(maxDelayMs, 300 * 1.7 ** attempt) * (0.8 + 0.4 * Math.random());

export function delay(ms: number, signal?: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const done = (): void => {
      clearTimeout(timer);
      signal?.removeEventListener('abort', done);
      resolve();
    };
    const timer = setTimeout(done, ms);
    signal?.addEventListener('abort', done);
  });
}
