import { useEffect, useState } from 'preact/hooks';
import type { Worker as Machine } from 'tessera-render';
import { api } from '../../api/client';
import { count } from '../../ui/format';
import { display, jobs } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { sceneTitle } from './job_words';
import { workerColour } from '../job/worker_tiles';

const lookEveryMs = 2000;
const columns = [
  'Worker',
  'Build',
  'State',
  'Threads',
  'Parts',
  'Renders',
  'Samples/s',
  'Done',
  'Faults',
];

/** Links to the renders that a worker has parts of. */
function Renders({ ids }: { ids: string[] }) {
  const list = useStore(jobs) ?? [];
  return (
    <>
      {ids.map((id) => {
        const job = list.find((j) => j.id === id);
        return (
          <a key={id} href={`#/jobs/${id}`}>
            {job ? sceneTitle(job) : id.slice(0, 8)}
          </a>
        );
      })}
    </>
  );
}

/** Machines that render parts of this server's images; nothing if there are none. */
export function WorkersCard() {
  const [workers, setWorkers] = useState<Machine[]>([]);
  const shown = useStore(display);
  useEffect(() => {
    const leaving = new AbortController();
    const look = async (): Promise<void> => {
      try {
        setWorkers((await api.workers(leaving.signal)).workers);
      } catch {
        setWorkers([]); // Other parts of the page report problems of the server.
      }
    };
    void look();
    const timer = setInterval(() => void look(), lookEveryMs);
    return () => {
      clearInterval(timer);
      leaving.abort();
    };
  }, []);
  if (workers.length === 0) return null;
  return (
    <section class="card" data-testid="workers">
      <h2>Workers</h2>
      <label class="check">
        <input
          type="checkbox"
          checked={shown.showWorkers ?? false}
          data-testid="show-workers"
          onChange={(e) => display.set({ ...shown, showWorkers: e.currentTarget.checked })}
        />
        Colour tiles by the worker that renders them
      </label>
      <div class="lab-table">
        <table>
          <thead>
            <tr>
              {columns.map((name) => (
                <th key={name} scope="col">
                  {name}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {workers.map((w) => (
              <tr key={w.id} title={w.arithmetic}>
                <th scope="row" class="mono">
                  <span class="worker-dot" style={{ background: workerColour(w.id) }} />{' '}
                  {w.id.slice(0, 8)}
                </th>
                <td class="mono">{w.build.slice(0, 8)}</td>
                <td>
                  {w.state}
                  {w.reason !== null && `: ${w.reason}`}
                </td>
                <td>{w.threads}</td>
                <td>{w.leases}</td>
                <td>
                  <Renders ids={[...new Set(w.held.map((unit) => unit.split('.')[0]))]} />
                </td>
                <td>{count(w.rate)}</td>
                <td>{count(w.units)}</td>
                <td>{count(w.faults)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}
