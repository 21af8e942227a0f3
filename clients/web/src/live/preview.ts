import { api, explain, RequestError } from '../api/client';
import type { FromFeed, ToFeed } from './feed_messages';
import { LiveFilm } from './film';

export type PreviewState = 'starting' | 'live' | 'unavailable' | 'failed';

/**
 * Small pictures of class `preview` for a camera that moves: the newest request wins, both here (one request is on
 * its way at most, the last wish waits) and on the server (all share one `preview_key`). Tiles of every preview go
 * into the same film, so that the old picture stands until the new one covers it.
 */
export class Preview {
  readonly film: LiveFilm;
  state: PreviewState = 'starting';
  detail = '';
  private readonly key = `page-${Math.random().toString(36).slice(2, 12)}`;
  private readonly worker: Worker;
  private wish: Record<string, unknown> | null = null;
  private busy = false;
  private closed = false;
  private jobId: string | null = null;

  constructor(
    width: number,
    height: number,
    private readonly onState: () => void,
  ) {
    this.film = new LiveFilm(width, height);
    this.worker = new Worker(new URL('./feed.worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = (e: MessageEvent<FromFeed>) => {
      if (e.data.type === 'tile') this.film.apply(e.data.tile);
      if (e.data.type === 'job' && e.data.job.state === 'failed') {
        this.say('failed', e.data.job.failure?.detail ?? 'The preview failed.');
      }
    };
  }

  /** request: a job request without film, class, stop and preview key. */
  show(request: Record<string, unknown>): void {
    this.wish = request;
    void this.work();
  }

  close(): void {
    this.closed = true;
    this.worker.terminate();
    if (this.jobId) void api.cancel(this.jobId).catch(() => undefined);
  }

  private async work(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    while (this.wish && !this.closed) {
      const request = this.wish;
      this.wish = null;
      await this.send(request);
    }
    this.busy = false;
  }

  private async send(request: Record<string, unknown>): Promise<void> {
    const film = { width: this.film.width, height: this.film.height, layers: [] };
    try {
      const job = await api.submit({
        ...request,
        film,
        class: 'preview',
        preview_key: this.key,
        stop: { samples_per_pixel: 64 },
      });
      this.jobId = job.id;
      const open: ToFeed = { type: 'open', jobId: job.id, tiles: true };
      if (this.closed) void api.cancel(job.id).catch(() => undefined);
      else this.worker.postMessage(open);
      this.say('live', '');
    } catch (error) {
      const missing =
        error instanceof RequestError &&
        error.errors.some((e) => e.pointer === '/class' || e.pointer === '/preview_key');
      this.say(missing ? 'unavailable' : 'failed', explain(error));
    }
  }

  private say(state: PreviewState, detail: string): void {
    if (state === this.state && detail === this.detail) return;
    this.state = state;
    this.detail = detail;
    this.onState();
  }
}
