import { isTemporary, type Job } from 'tessera-render';
import { api, explain, OfflineError, RequestError } from '../api/client';
import { assembled, enlarged, tilesOf } from './coarse';
import type { FromFeed, ToFeed } from './feed_messages';
import { LiveFilm } from './film';

export type PreviewState = 'starting' | 'live' | 'waiting' | 'unavailable' | 'failed';

/** Size of the fine image relative to the coarse one, per side. */
const divisors = [1, 2, 4, 8];
const coarseMs = { least: 35, most: 90 };
const waitMs = { first: 400, most: 6000 };

/**
 * Small images of class `preview` for a moving camera. Each is rendered in two steps: a coarse one
 * with few samples, shown when it is complete and small enough for an immediate response; then, if
 * the camera rests, a fine one whose tiles are drawn over it as they converge. The newest request
 * wins, both here (at most one coarse image is in progress, and the last request waits) and on the
 * server (all share one `preview_key`). An unanswered request waits until the server responds.
 */
export class Preview {
  readonly film: LiveFilm;
  state: PreviewState = 'starting';
  detail = '';
  private readonly key = `page-${Math.random().toString(36).slice(2, 12)}`;
  private readonly worker: Worker;
  private wish: Record<string, unknown> | null = null;
  /** The displayed image, or the one in progress. */
  private last: Record<string, unknown> | null = null;
  private endWait: (() => void) | null = null;
  private busy = false;
  private closed = false;
  private jobId: string | null = null;
  private divisor = 2;

  constructor(
    width: number,
    height: number,
    private readonly onState: () => void,
  ) {
    this.film = new LiveFilm(width, height);
    this.worker = new Worker(new URL('./feed.worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = (e: MessageEvent<FromFeed>) => {
      if (e.data.type === 'tiles') {
        for (const tile of e.data.tiles) this.film.apply(tile);
        this.worker.postMessage({ type: 'taken' });
      }
      if (e.data.type === 'job') this.sayIfFailed(e.data.job);
      // A restarted server does not know the fine image.
      if (e.data.type === 'link' && e.data.state === 'gone' && !this.busy && this.last)
        this.show(this.last);
    };
  }

  /** request: a job request without film, class, stop and preview key. */
  show(request: Record<string, unknown>): void {
    this.wish = request;
    void this.work();
  }

  /** The server is back: sends the waiting request immediately. */
  wake(): void {
    this.endWait?.();
  }

  close(): void {
    this.closed = true;
    this.wake();
    this.worker.terminate();
    if (this.jobId) void api.cancel(this.jobId).catch(() => undefined);
  }

  private async work(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    let failures = 0;
    while (this.wish && !this.closed) {
      const request = this.wish;
      this.wish = null;
      this.last = request;
      try {
        await this.coarse(request);
        if (!this.wish && !this.closed) await this.fine(request);
        failures = 0;
      } catch (error) {
        if (isTemporary(error)) {
          // A newer request replaces it.
          this.wish ??= request;
          this.say('waiting', error instanceof RequestError ? explain(error) : '');
          await this.wait(failures++);
          continue;
        }
        const missing =
          error instanceof RequestError &&
          error.errors.some((e) => e.pointer === '/class' || e.pointer === '/preview_key');
        this.say(missing ? 'unavailable' : 'failed', explain(error));
      }
    }
    this.busy = false;
  }

  private wait(failures: number): Promise<void> {
    return new Promise((resolve) => {
      const end = (): void => {
        clearTimeout(timer);
        this.endWait = null;
        resolve();
      };
      const timer = setTimeout(end, Math.min(waitMs.most, waitMs.first * 1.7 ** failures));
      this.endWait = end;
    });
  }

  private async coarse(request: Record<string, unknown>): Promise<void> {
    // Otherwise the fine image of an older camera would be drawn over this one.
    this.post({ type: 'close' });
    const began = performance.now();
    const width = Math.max(8, Math.round(this.film.width / divisors[this.divisor]));
    const height = Math.max(8, Math.round(this.film.height / divisors[this.divisor]));
    const job = await this.submit(request, { width, height }, 2);
    const tiles = await tilesOf(job.id).catch((error: unknown) => {
      // A restarted server does not know the job; bytes that break off are a TypeError.
      const lost =
        error instanceof RequestError ? error.status === 404 : error instanceof TypeError;
      throw lost ? new OfflineError() : error;
    });
    if (this.closed) return;
    if (!tiles.length) return this.sayIfFailed(await api.job(job.id));
    this.film.apply(enlarged(assembled(tiles, width, height), this.film.width, this.film.height));
    this.say('live', '');
    this.adapt(performance.now() - began);
  }

  private async fine(request: Record<string, unknown>): Promise<void> {
    const { width, height } = this.film;
    const job = await this.submit(request, { width, height }, 64);
    this.post({ type: 'open', jobId: job.id });
    this.post({ type: 'tiles', planes: 'mean' });
  }

  /** Fewer pixels if a response took too long, more if there is time for four times as many. */
  private adapt(tookMs: number): void {
    if (tookMs > coarseMs.most) this.divisor = Math.min(divisors.length - 1, this.divisor + 1);
    else if (tookMs < coarseMs.least) this.divisor = Math.max(0, this.divisor - 1);
  }

  private async submit(
    request: Record<string, unknown>,
    size: { width: number; height: number },
    samples: number,
  ): Promise<Job> {
    const job = await api.submitRequest({
      ...request,
      film: { ...size, layers: [] },
      class: 'preview',
      preview_key: this.key,
      stop: { samples_per_pixel: samples },
    });
    this.jobId = job.id;
    if (this.closed) void api.cancel(job.id).catch(() => undefined);
    return job;
  }

  private post(message: ToFeed): void {
    if (!this.closed) this.worker.postMessage(message);
  }

  private sayIfFailed(job: Job): void {
    if (job.state === 'failed') this.say('failed', job.failure?.detail ?? 'The preview failed.');
  }

  private say(state: PreviewState, detail: string): void {
    if (state === this.state && detail === this.detail) return;
    this.state = state;
    this.detail = detail;
    this.onState();
  }
}
