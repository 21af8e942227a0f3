import type { Job, Server } from 'tessera-render';
import { api, explain, OfflineError, RequestError } from '../api/client';
import { isFinal } from '../api/states';
import { persistent, Store } from './store';
import { toneMaps, type ToneMap } from '../live/tone';

/** State of the server, shared by the whole page. */
export type Connection = 'connecting' | 'online' | 'offline' | 'locked';

export const connection = new Store<Connection>('connecting');
export const serverInfo = new Store<Server | null>(null);
export const jobs = new Store<Job[] | null>(null);
/** Cursor of the next page of jobs; null after the last. */
export const jobsNext = new Store<string | null>(null);
/** Ids of that page whose stored records cannot be read. */
export const jobsDamaged = new Store<string[]>([]);
export const pageSize = 40;

export type Theme = 'auto' | 'dark' | 'light';
export const theme = persistent<Theme>(
  'tessera.theme',
  'auto',
  (v): v is Theme => v === 'auto' || v === 'dark' || v === 'light',
);

export interface Display {
  exposure: number;
  /** The exposure follows the image; not if false. */
  auto?: boolean;
  tone: ToneMap;
  showTiles: boolean;
  /** Frames around tiles that lack light; not if false. */
  showLacking?: boolean;
  /** Tiles that workers render, in the colours of the workers. */
  showWorkers?: boolean;
  /** The denoised image over the plain one, from the fraction `split` of the width on. */
  denoised?: boolean;
  /** full: as the denoiser made it; mixed (default): parts that it would spoil stay as rendered. */
  denoiseMode?: 'mixed' | 'full';
  /** Of the images of a series. */
  seriesMode?: 'mixed' | 'full' | 'video';
  split?: number;
}
const isDisplay = (v: unknown): v is Display =>
  typeof v === 'object' &&
  v !== null &&
  typeof (v as Display).exposure === 'number' &&
  toneMaps.includes((v as Display).tone);
export const display = persistent<Display>(
  'tessera.display',
  { exposure: 0, tone: 'khronos-neutral', showTiles: true, denoised: true, split: 0 },
  isDisplay,
);

/** A short line at the bottom of the page, read out by screen readers. */
export interface Toast {
  text: string;
  kind: 'info' | 'error';
}
export const toast = new Store<Toast | null>(null);
let toastTimer = 0;

export function say(text: string, kind: Toast['kind'] = 'info'): void {
  clearTimeout(toastTimer);
  toast.set({ text, kind });
  toastTimer = window.setTimeout(() => toast.set(null), kind === 'error' ? 9000 : 4000);
}

export const sayError = (error: unknown): void => say(explain(error), 'error');

let listTimer = 0;
let failures = 0;

/**
 * Requests server and jobs now and then regularly: often while something runs, otherwise rarely.
 */
export async function refresh(): Promise<void> {
  clearTimeout(listTimer);
  try {
    if (!serverInfo.get()) serverInfo.set(await api.server());
    const page = await api.jobs({ limit: pageSize });
    jobsNext.set(page.next);
    jobsDamaged.set(page.damaged);
    jobs.set(page.jobs);
    // After an outage the server may have another build.
    if (connection.get() === 'offline') serverInfo.set(await api.server());
    connection.set('online');
    failures = 0;
  } catch (error) {
    failures += 1;
    if (error instanceof RequestError && (error.status === 401 || error.status === 403))
      connection.set('locked');
    else if (error instanceof OfflineError || error instanceof RequestError)
      connection.set('offline');
  }
  const busy = jobs.get()?.some((job) => !isFinal(job.state)) ?? false;
  const wait = failures ? Math.min(8000, 700 * 1.6 ** failures) : busy ? 2500 : 8000;
  listTimer = window.setTimeout(() => (document.hidden ? undefined : void refresh()), wait);
}

document.addEventListener('visibilitychange', () => {
  if (!document.hidden) void refresh();
});
window.addEventListener('online', () => void refresh());
