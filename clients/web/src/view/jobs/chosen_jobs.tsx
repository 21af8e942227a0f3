import { useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { api } from '../../api/client';
import { isAvailable, isFinal } from '../../api/states';
import { go } from '../../ui/router';
import { refresh, say, sayError } from '../../ui/server_state';
import { distinct, zipOf } from '../../ui/zip';
import { curvesAtMost } from '../lab/convergence_view';
import { sceneTitle } from './job_words';

/** Requests at a time: browsers open six connections to a host, and the page needs some. */
const atOnce = 3;

/** Runs all, a few at a time; the first failure is thrown when those in progress have ended. */
async function forAll<T, R>(items: T[], work: (item: T) => Promise<R>): Promise<R[]> {
  const out: R[] = [];
  let next = 0;
  const lane = async (): Promise<void> => {
    while (next < items.length) {
      const i = next++;
      out[i] = await work(items[i]);
    }
  };
  const lanes = await Promise.allSettled(Array.from({ length: atOnce }, lane));
  const failed = lanes.find((l) => l.status === 'rejected');
  if (failed?.status === 'rejected') throw failed.reason;
  return out;
}

async function imageOf(job: Job): Promise<Uint8Array> {
  return new Uint8Array(await (await api.image(job.id)).arrayBuffer());
}

async function download(jobs: Job[]): Promise<void> {
  const names = distinct(jobs.map(sceneTitle), 'png');
  const images = await forAll(jobs, imageOf);
  const url = URL.createObjectURL(zipOf(images.map((bytes, i) => ({ name: names[i], bytes }))));
  const link = Object.assign(document.createElement('a'), { href: url, download: 'renders.zip' });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

interface ChosenJobsProps {
  list: Job[];
  chosen: Set<string>;
  onChoose: (ids: Set<string>) => void;
  onDone: () => void;
}

/** Actions for several renders at once. Each button shows the number it applies to. */
export function ChosenJobs({ list, chosen, onChoose, onDone }: ChosenJobsProps) {
  const [busy, setBusy] = useState(false);
  const [sure, setSure] = useState(false);
  const jobs = list.filter((j) => chosen.has(j.id));
  const running = jobs.filter((j) => !isFinal(j.state));
  const ended = jobs.filter((j) => isFinal(j.state));
  const shown = jobs.filter((j) => isAvailable(j, 'image'));
  const act = async (work: () => Promise<unknown>, said: string): Promise<void> => {
    setBusy(true);
    setSure(false);
    await work().then(() => said && say(said), sayError);
    await refresh();
    setBusy(false);
  };
  return (
    <div class="chosen-bar" role="group" aria-label="Selected renders" data-testid="chosen">
      <span role="status">{jobs.length} selected</span>
      <button
        type="button"
        class="quiet"
        onClick={() =>
          onChoose(jobs.length === list.length ? new Set() : new Set(list.map((j) => j.id)))
        }
      >
        {jobs.length === list.length && list.length > 0 ? 'Select none' : 'Select all'}
      </button>
      <button
        type="button"
        class="quiet"
        disabled={busy || !running.length}
        onClick={() => void act(() => forAll(running, (j) => api.cancel(j.id)), 'Cancelled.')}
      >
        Cancel ({running.length})
      </button>
      <button
        type="button"
        class="quiet"
        data-testid="chosen-download"
        disabled={busy || !shown.length}
        onClick={() => void act(() => download(shown), '')}
      >
        Download zip ({shown.length})
      </button>
      <button
        type="button"
        class="quiet"
        data-testid="chosen-convergence"
        disabled={!shown.length || shown.length > curvesAtMost}
        title={`Error curves of up to ${curvesAtMost} renders in one plot`}
        onClick={() => go(`/convergence/${shown.map((j) => j.id).join(',')}`)}
      >
        Plot errors ({shown.length})
      </button>
      <button
        type="button"
        class="quiet"
        disabled={busy || !ended.length}
        onBlur={() => setSure(false)}
        onClick={() =>
          sure
            ? void act(() => forAll(ended, (j) => api.remove(j.id)), 'Renders deleted.')
            : setSure(true)
        }
      >
        {sure ? `Delete ${ended.length} permanently?` : `Delete (${ended.length})`}
      </button>
      <button type="button" class="quiet" onClick={onDone}>
        Done
      </button>
    </div>
  );
}
