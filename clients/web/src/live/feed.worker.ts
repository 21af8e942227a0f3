/**
 * Keeps the two streams of one job open (events and tiles), off the main thread. Events are read
 * with fetch, not EventSource, so that pings are seen (a stream that is silent for longer than
 * `silenceMs` is dead, as after a laptop's sleep), status codes can be read, and the page sends
 * `Last-Event-ID` itself.
 */
import { EventParser, type ServerEvent } from './event_parser';
import type { FromFeed, LinkState, TilePlanes, ToFeed } from './feed_messages';
import { FrameParser, type TileFrame } from './frames';
import { plainProblem } from '../api/client';
import type { Job, Problem, WarningEvent } from '../api/types';

declare const self: DedicatedWorkerGlobalScope;

/** The folder of the page: proxies may place it below a path. This script is one folder deeper. */
const root = self.location.pathname.replace(/\/(assets|src\/live)\/[^/]*$/, '');

const silenceMs = 40_000;
const maxDelayMs = 6_000;
const steadyMs = 5_000;
const overloadedMs = 5_000;
/** A row of tiles of an image of 1024 pixels: a page draws it within a frame. */
const batchTiles = 32;

const post = (message: FromFeed, transfer: Transferable[] = []): void =>
  self.postMessage(message, transfer);

/**
 * Tiles on their way to the page, which takes one batch at a time: a page that is slower than the
 * renderer gets the newest of each tile, and stays responsive. Posted without limit, they would
 * queue before all that a person does.
 */
class Outbox {
  private readonly waiting = new Map<string, TileFrame>();
  private isTaken = true;

  add(tile: TileFrame): void {
    this.waiting.set(`${tile.x},${tile.y}`, tile);
    this.send();
  }

  /** The page has taken the last batch. */
  taken(): void {
    this.isTaken = true;
    this.send();
  }

  clear(): void {
    this.waiting.clear();
  }

  private send(): void {
    if (!this.isTaken || this.waiting.size === 0) return;
    const batch = [...this.waiting].slice(0, batchTiles);
    for (const [place] of batch) this.waiting.delete(place);
    const tiles = batch.map(([, tile]) => tile);
    this.isTaken = false;
    post(
      { type: 'tiles', tiles },
      tiles.map((tile) => tile.planes.buffer as ArrayBuffer),
    );
  }
}

const outbox = new Outbox();

class Feed {
  private abort = new AbortController();
  private lastEventId: string | null = null;
  private revision = 0;
  private link: LinkState | null = null;
  /** When to reconnect to a server with too many viewers, as stated by the server. */
  private retryMs = overloadedMs;
  private readonly address: string;

  constructor(
    jobId: string,
    private readonly tiles: boolean,
    private readonly planes: TilePlanes,
  ) {
    this.address = `${root}/v1/jobs/${encodeURIComponent(jobId)}`;
  }

  /** A new start requests every tile: meanwhile a restarted server may have reset its revisions. */
  start(): void {
    this.abort = new AbortController();
    this.revision = 0;
    outbox.clear();
    void this.runEvents(this.abort.signal);
    if (this.tiles) void this.runTiles(this.abort.signal);
  }

  stop(): void {
    this.abort.abort();
  }

  private setLink(state: LinkState, problem?: Problem): void {
    if (state === this.link) return;
    this.link = state;
    post({ type: 'link', state, problem });
  }

  /** Reopens the event stream until the job has ended or has been deleted. */
  private async runEvents(signal: AbortSignal): Promise<void> {
    this.setLink('connecting');
    for (let attempt = 0; !signal.aborted; ++attempt) {
      const began = Date.now();
      const outcome = await this.readEvents(signal).catch(() => 'lost' as const);
      if (signal.aborted || outcome === 'done') return;
      if (outcome !== 'overloaded') this.setLink('reconnecting');
      // Do not reconnect immediately after a stream that broke immediately.
      if (Date.now() - began > steadyMs) attempt = 0;
      await delay(outcome === 'overloaded' ? this.retryMs : backoff(attempt), signal);
    }
  }

  private async readEvents(signal: AbortSignal): Promise<'done' | 'lost' | 'overloaded'> {
    const watchdog = new Watchdog(signal);
    const headers: Record<string, string> = { accept: 'text/event-stream' };
    if (this.lastEventId) headers['last-event-id'] = this.lastEventId;
    const response = await fetch(`${this.address}/events`, {
      headers,
      signal: watchdog.signal,
      cache: 'no-store',
    });
    if (response.status === 204) return this.finish();
    if (!response.ok || !response.body) return this.refused(response);
    const parser = new EventParser();
    const text = new TextDecoder();
    const reader = response.body.getReader();
    let outcome: 'done' | 'lost' | 'overloaded' = 'lost';
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      watchdog.feed();
      parser.push(text.decode(value, { stream: true }), (event) => {
        if (event.id) this.lastEventId = event.id;
        const result = this.handle(event);
        if (result) outcome = result;
      });
    }
    watchdog.stop();
    this.retryMs = parser.retryMs ?? overloadedMs;
    return outcome;
  }

  private finish(): 'done' {
    this.setLink('ended');
    return 'done';
  }

  private async refused(response: Response): Promise<'done' | 'lost'> {
    if (response.status >= 500 || response.status === 429) return 'lost';
    const problem = (await response.json().catch(() => null)) as Problem | null;
    this.setLink(
      response.status === 404 || response.status === 410 ? 'gone' : 'refused',
      problem ?? plainProblem(response.status),
    );
    this.stop();
    return 'done';
  }

  private handle(event: ServerEvent): 'done' | 'overloaded' | null {
    const data = parse(event.data);
    switch (event.type) {
      case 'snapshot':
        this.setLink('live');
        post({ type: 'job', job: (data.job ?? data) as Job });
        return null;
      case 'state':
      case 'progress':
        post({ type: 'patch', patch: 'fraction' in data ? { progress: data as never } : data });
        return null;
      case 'warning':
        post({ type: 'warning', warning: data as unknown as WarningEvent });
        return null;
      case 'end':
        post({ type: 'patch', patch: 'state' in data ? data : {} });
        post({ type: 'complete' });
        return this.finish();
      case 'overloaded':
        this.setLink('overloaded');
        return 'overloaded';
      default:
        return null;
    }
  }

  private async runTiles(signal: AbortSignal): Promise<void> {
    for (let attempt = 0; !signal.aborted; ++attempt) {
      const ended = await this.readTiles(signal, () => (attempt = 0)).catch(() => {
        // After a restart revisions may continue from an older checkpoint: request every tile
        // again.
        this.revision = 0;
        return false;
      });
      if (ended) return;
      await delay(backoff(attempt), signal);
    }
  }

  private async readTiles(signal: AbortSignal, onLife: () => void): Promise<boolean> {
    const headers = { accept: 'application/vnd.tessera.tiles' };
    const calm = this.planes === 'mean' ? '&fireflies=set_aside' : '';
    const query = `after=${this.revision}&planes=${this.planes}${calm}`;
    const response = await fetch(`${this.address}/tiles?${query}`, {
      headers,
      signal,
      cache: 'no-store',
    });
    // 204: the job renders no image.
    if ([204, 404, 410].includes(response.status)) return true;
    if (!response.ok || !response.body) return false;
    const parser = new FrameParser();
    const reader = response.body.getReader();
    let ended = false;
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return ended;
      onLife();
      parser.push(value, (tile) => {
        ended ||= tile.end;
        if (tile.end) return;
        this.revision = Math.max(this.revision, tile.revision);
        outbox.add(tile);
      });
    }
  }
}

/** Aborts a request that is silent for `silenceMs`. */
class Watchdog {
  private readonly own = new AbortController();
  private timer = 0;
  readonly signal = this.own.signal;

  constructor(outer: AbortSignal) {
    outer.addEventListener('abort', () => this.stop(true), { once: true });
    this.feed();
  }

  feed(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.stop(true), silenceMs) as unknown as number;
  }

  stop(abort = false): void {
    clearTimeout(this.timer);
    if (abort) this.own.abort();
  }
}

function parse(text: string): Record<string, unknown> {
  try {
    return JSON.parse(text) as Record<string, unknown>;
  } catch {
    return {};
  }
}

const backoff = (attempt: number): number =>
  Math.min(maxDelayMs, 300 * 1.7 ** attempt) * (0.8 + 0.4 * Math.random());

function delay(ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, ms);
    signal.addEventListener('abort', () => (clearTimeout(timer), resolve()), { once: true });
  });
}

let feed: Feed | null = null;
self.onmessage = (message: MessageEvent<ToFeed>) => {
  const request = message.data;
  if (request.type === 'open') {
    feed?.stop();
    feed = new Feed(request.jobId, request.tiles, request.planes);
    feed.start();
  } else if (request.type === 'taken') {
    outbox.taken();
  } else if (request.type === 'wake') {
    feed?.start();
  } else {
    feed?.stop();
    if (request.type === 'close') feed = null;
  }
};
