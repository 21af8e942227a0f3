import type { Job, Problem, TileFrame } from 'tessera-render';
import { api, RequestError } from '../api/client';
import { filmOf, isFinal } from '../api/states';
import type { FromFeed, LinkState, TilePlanes, ToFeed } from './feed_messages';
import { LiveFilm, maxLivePixels, type Rect } from './film';
import { takeTurn } from './turns';

export interface FeedState {
  job: Job | null;
  link: LinkState;
  problem: Problem | null;
  film: LiveFilm | null;
  /** Too many pixels for floats in the page: the server encodes the image. */
  tooLarge: boolean;
}

const sleepAfterMs = 20_000;

/**
 * One job in the page: its record, kept current by events, and its film, kept current by tiles.
 * While the page is hidden the streams are closed, because a browser has few connections per host.
 */
export class JobFeed {
  state: FeedState = { job: null, link: 'connecting', problem: null, film: null, tooLarge: false };
  private readonly worker: Worker;
  private readonly listeners = new Set<() => void>();
  private readonly tileListeners = new Set<(rect: Rect) => void>();
  private sleepTimer = 0;
  private asleep = false;
  /** Cancels the pending notification of listeners; null if there is none. */
  private unsaid: (() => void) | null = null;
  /** Tiles that arrived before the record with the size of the film. */
  private early: TileFrame[] = [];

  constructor(
    readonly jobId: string,
    /** Of the tiles that are streamed; null: none are needed yet. */
    private planes: TilePlanes | null,
    /** The record as far as it is known, so that something is shown at once. */
    known: Job | null = null,
  ) {
    this.worker = new Worker(new URL('./feed.worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = (e: MessageEvent<FromFeed>) => this.receive(e.data);
    this.open();
    if (known) {
      this.makeFilm(known);
      this.state = { ...this.state, job: known };
    } else {
      // An answer comes sooner than the first event of a stream that has yet to open.
      void api.job(jobId).then(
        (job) => !this.state.job && this.receive({ type: 'job', job }),
        () => undefined,
      );
    }
    document.addEventListener('visibilitychange', this.onVisibility);
    window.addEventListener('online', this.onOnline);
  }

  subscribe(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  onTile(listener: (rect: Rect) => void): () => void {
    this.tileListeners.add(listener);
    return () => this.tileListeners.delete(listener);
  }

  /** After an operation that returned the job. An extended job streams again. */
  adopt(job: Job): void {
    const revived = this.state.job && isFinal(this.state.job.state) && !isFinal(job.state);
    this.set({ job });
    if (revived) this.open();
  }

  /**
   * The stored record: at the end with digest and final numbers; later, to see whether it still
   * exists.
   */
  async check(): Promise<void> {
    try {
      const job = await api.job(this.jobId);
      this.makeFilm(job);
      this.set({ job });
    } catch (error) {
      const gone = error instanceof RequestError && [404, 410].includes(error.status);
      if (gone) this.set({ link: 'gone' });
      else this.notify();
    }
  }

  /** Tiles are streamed from now on. All planes have more than four times the bytes of means. */
  want(planes: TilePlanes): void {
    if (this.planes === 'all' || this.planes === planes) return;
    this.planes = planes;
    this.askForTiles();
  }

  close(): void {
    document.removeEventListener('visibilitychange', this.onVisibility);
    window.removeEventListener('online', this.onOnline);
    clearTimeout(this.sleepTimer);
    this.unsaid?.();
    this.worker.terminate();
    this.listeners.clear();
  }

  private open(): void {
    this.send({ type: 'open', jobId: this.jobId });
    this.askForTiles();
  }

  private askForTiles(): void {
    this.send({ type: 'tiles', planes: this.state.tooLarge ? null : this.planes });
  }

  private receiveTile(tile: TileFrame): void {
    const { film } = this.state;
    if (!film) {
      if (!this.state.tooLarge) this.early.push(tile);
      return;
    }
    const first = film.tilesSeen === 0;
    film.apply(tile);
    for (const listener of this.tileListeners) listener(tile);
    // The image listens to the film itself; the rest of the page only needs to know that there is
    // one.
    if (first) this.notify();
  }

  private send(message: ToFeed): void {
    this.worker.postMessage(message);
  }

  private readonly onVisibility = (): void => {
    clearTimeout(this.sleepTimer);
    if (document.hidden) {
      this.sleepTimer = window.setTimeout(() => {
        this.asleep = true;
        this.send({ type: 'sleep' });
      }, sleepAfterMs);
    } else {
      this.wake();
    }
  };

  private readonly onOnline = (): void => {
    this.send({ type: 'sleep' });
    this.asleep = true;
    this.wake();
  };

  private wake(): void {
    if (!this.asleep) return;
    this.asleep = false;
    const { job } = this.state;
    if (!job || !isFinal(job.state)) this.send({ type: 'wake' });
    else void this.check();
  }

  private receive(message: FromFeed): void {
    switch (message.type) {
      case 'job':
        this.makeFilm(message.job);
        return this.set({ job: message.job, problem: null });
      case 'patch':
        return this.state.job
          ? this.set({ job: { ...this.state.job, ...message.patch } })
          : undefined;
      case 'warning': {
        const { job } = this.state;
        return job
          ? this.set({ job: { ...job, warnings: [...job.warnings, message.warning.message] } })
          : undefined;
      }
      case 'link':
        // No stream for now: read at least the record.
        if (message.state === 'overloaded') void this.check();
        return this.set({ link: message.state, problem: message.problem ?? this.state.problem });
      case 'complete':
        return void this.check();
      case 'tiles':
        for (const tile of message.tiles) this.receiveTile(tile);
        return this.send({ type: 'taken' });
    }
  }

  private makeFilm(job: Job): void {
    if (this.state.film || this.state.tooLarge) return;
    const { width, height } = filmOf(job);
    if (!width) return;
    if (width * height > maxLivePixels) {
      this.state = { ...this.state, tooLarge: true };
      this.askForTiles();
    } else {
      this.state = { ...this.state, film: new LiveFilm(width, height) };
      for (const tile of this.early) this.receiveTile(tile);
    }
    this.early = [];
  }

  private set(change: Partial<FeedState>): void {
    this.state = { ...this.state, ...change };
    this.notify();
  }

  private notify(): void {
    this.unsaid ??= takeTurn(() => {
      this.unsaid = null;
      for (const listener of this.listeners) listener();
    });
  }
}
