/**
 * Keeps the two streams of one job open (events and tiles), off the main thread.
 */
import {
  Client,
  RequestError,
  type JobEvent,
  type Problem,
  type TileFrame,
} from 'tessera-render';
import type { FromFeed, LinkState, TilePlanes, ToFeed } from './feed_messages';

declare const self: DedicatedWorkerGlobalScope;

/** The folder of the page: proxies may place it below a path. This script is one folder deeper. */
const client = new Client(self.location.pathname.replace(/\/(assets|src\/live)\/[^/]*$/, '/'));

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
  private tiles = new AbortController();
  private planes: TilePlanes | null = null;
  private lastEventId: string | null = null;
  private link: LinkState | null = null;

  constructor(private readonly jobId: string) {}

  /** A new start requests every tile: meanwhile a restarted server may have reset its revisions. */
  start(): void {
    this.abort = new AbortController();
    const { signal } = this.abort;
    outbox.clear();
    void this.readEvents(signal).catch((error: unknown) => {
      if (signal.aborted) return;
      if (!(error instanceof RequestError)) throw error;
      this.setLink([404, 410].includes(error.status) ? 'gone' : 'refused', error.problem);
      this.stop();
    });
    if (this.planes) this.startTiles(this.planes);
  }

  /** While the feed is stopped, the next start requests them. */
  startTiles(planes: TilePlanes): void {
    this.planes = planes;
    this.tiles.abort();
    if (this.abort.signal.aborted) return;
    this.tiles = new AbortController();
    outbox.clear();
    // A job without tiles, as after its film was evicted, still has its events.
    void this.readTiles(planes, this.tiles.signal).catch(() => undefined);
  }

  stopTiles(): void {
    this.planes = null;
    this.tiles.abort();
  }

  stop(): void {
    this.abort.abort();
    this.tiles.abort();
  }

  private setLink(state: LinkState, problem?: Problem): void {
    if (state === this.link) return;
    this.link = state;
    post({ type: 'link', state, problem });
  }

  private async readEvents(signal: AbortSignal): Promise<void> {
    this.setLink('connecting');
    const { lastEventId } = this;
    const onLost = (): void => this.setLink('reconnecting');
    for await (const event of client.events(this.jobId, { signal, lastEventId, onLost })) {
      this.lastEventId = event.id;
      this.handle(event);
    }
    this.setLink('ended');
  }

  private handle({ type, data }: JobEvent): void {
    switch (type) {
      case 'snapshot':
        this.setLink('live');
        return post({ type: 'job', job: data });
      case 'state':
      case 'progress':
        return post({ type: 'patch', patch: data });
      case 'warning':
        return post({ type: 'warning', warning: data });
      case 'end':
        post({ type: 'patch', patch: data });
        return post({ type: 'complete' });
      case 'overloaded':
        return this.setLink('overloaded');
    }
  }

  private async readTiles(planes: TilePlanes, signal: AbortSignal): Promise<void> {
    const fireflies = planes === 'mean' ? 'set_aside' : undefined;
    for await (const tile of client.tiles(this.jobId, { signal, planes, fireflies }))
      outbox.add(tile);
  }
}

let feed: Feed | null = null;
self.onmessage = (message: MessageEvent<ToFeed>) => {
  const request = message.data;
  if (request.type === 'open') {
    feed?.stop();
    feed = new Feed(request.jobId);
    feed.start();
  } else if (request.type === 'tiles') {
    if (request.planes) feed?.startTiles(request.planes);
    else feed?.stopTiles();
  } else if (request.type === 'taken') {
    outbox.taken();
  } else if (request.type === 'wake') {
    feed?.start();
  } else {
    feed?.stop();
    if (request.type === 'close') feed = null;
  }
};
