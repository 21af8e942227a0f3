/**
 * The view of one job that other pages show in a frame: /embed/JOB. It shows the image, its
 * progress and its error, and changes nothing. `?ticket=` (POST /v1/stream-tickets) replaces the
 * key, whose cookie browsers withhold from frames of other sites; a ticket opens streams for a
 * minute, so the image is then one stream as well.
 */
import type { Job } from 'tessera-render';
import '../style/embed.css';
import { doneShare, percent } from '../ui/format';

const [, root, id] = /^(.*)\/embed\/([^/]*)$/.exec(location.pathname) ?? ['', '', ''];
const ticket = new URLSearchParams(location.search).get('ticket');
const address = `${root}/v1/jobs/${id}`;

function urlOf(part: string, query: Record<string, string> = {}): string {
  const params = new URLSearchParams({ ...query, ...(ticket && { ticket }) });
  return `${address}/${part}?${params}`;
}

const find = <T extends Element>(selector: string): T => document.querySelector<T>(selector)!;
const image = find<HTMLImageElement>('.embed-image');
const link = find<HTMLAnchorElement>('.embed-name');
const state = find<HTMLElement>('[data-testid=embed-state]');
const bar = find<HTMLProgressElement>('progress');

/** Minimum interval of new images. */
const paceMs = 2000;

let job: Job | null = null;
let shownRevision = 0;
let timer = 0;

const look = { exposure: 'auto' };

function showImage(): void {
  timer = 0;
  if (!job || !job.available.includes('image')) return;
  if (ticket && shownRevision) return; // It is a stream.
  shownRevision = job.revision;
  image.src = ticket
    ? urlOf('image', { ...look, stream: '1' })
    : urlOf('image.webp', { ...look, revision: String(job.revision) });
  image.hidden = false;
}

function show(): void {
  if (!job) return;
  const name = job.spec.name || job.spec.scene;
  link.textContent = name;
  link.href = `${root}/#/jobs/${id}`;
  image.alt = `Render of ${name}`;
  document.title = `${name} · Tessera`;
  const error = job.error?.relative;
  const running = job.state === 'rendering';
  bar.hidden = !running;
  bar.value = job.progress.fraction;
  state.textContent = [
    running ? doneShare(job.progress.fraction) : job.state,
    error == null ? '' : `the average pixel is ${percent(error)} off`,
  ]
    .filter(Boolean)
    .join(', ');
  if (job.revision !== shownRevision)
    timer ||= window.setTimeout(showImage, shownRevision ? paceMs : 0);
}

function follow(): void {
  const events = new EventSource(urlOf('events'));
  const take = (merge: (data: object) => Job | null) => (event: MessageEvent<string>) => {
    job = merge(JSON.parse(event.data) as object);
    show();
  };
  events.addEventListener(
    'snapshot',
    take((data) => data as Job),
  );
  for (const type of ['state', 'progress', 'end'])
    events.addEventListener(
      type,
      take((data) => job && { ...job, ...data }),
    );
  events.addEventListener('end', () => events.close());
  // A refused request is not repeated: the job is gone, or needs a key or another ticket.
  events.onerror = () => {
    if (events.readyState === EventSource.CLOSED && !job) state.textContent = 'Not available';
  };
}

follow();
