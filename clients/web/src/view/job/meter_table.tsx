import { useEffect, useState } from 'preact/hooks';
import type { Job, Meter } from 'tessera-render';
import { api, meterUrl } from '../../api/client';
import { isAvailable } from '../../api/states';
import { count, measured, number, percent } from '../../ui/format';
import { MeterMap } from './meter_map';
import { useRevision } from './server_image';

/** More are in the CSV. */
const rowsMost = 256;

function useMeter(job: Job): Meter | null {
  const [meter, setMeter] = useState<Meter | null>(null);
  const revision = useRevision(job, false, 'meter');
  const { id, state } = job;
  const ready = isAvailable(job, 'meter');
  useEffect(() => {
    if (!ready) return;
    const abort = new AbortController();
    api
      .meter(id, abort.signal)
      .then(setMeter)
      .catch(() => undefined); // Requested again at the next revision.
    return () => abort.abort();
  }, [id, state, revision, ready]);
  return meter;
}

/** Readings of the job's meter: irradiance and illuminance with their 95% intervals. */
export function MeterTable({ job }: { job: Job }) {
  const meter = useMeter(job);
  if (!meter) return null;
  const readings = meter.points;
  const lux = readings.map((r) => r.illuminance_lux);
  const range = `${number(Math.min(...lux))} to ${number(Math.max(...lux))}`;
  const plane = job.spec.meter?.plane;
  return (
    <section class="card" aria-labelledby="meter-title" data-testid="meter">
      <header class="card-head">
        <h2 id="meter-title">Meter</h2>
        <a class="link" href={meterUrl(job.id)} download={`meter-${job.id}.csv`}>
          CSV
        </a>
      </header>
      {readings.length > 1 && (
        <p class="hint" data-testid="meter-summary">
          {count(readings.length)} points: {range} lux, mean {number(meter.mean_lux)} lux.
          {meter.uniformity !== null && ` Uniformity ${number(meter.uniformity)}.`}
          {meter.daylight_factor !== null &&
            ` Daylight factor ${percent(meter.daylight_factor)} of ${number(meter.outdoor_lux)} ` +
              'lux outdoors.'}
        </p>
      )}
      {plane && (
        <MeterMap
          plane={plane}
          values={readings.map((r) => ({ lux: r.illuminance_lux, position: r.position }))}
        />
      )}
      <div class="lab-table meter-table" tabIndex={0} role="group" aria-label="Readings">
        <table>
          <thead>
            <tr>
              <th scope="col">Position, m</th>
              <th scope="col">lux</th>
              <th scope="col">W/m²</th>
            </tr>
          </thead>
          <tbody>
            {readings.slice(0, rowsMost).map((r, i) => {
              const [value, half] = measured(r.illuminance_lux, (r.high - r.low) / 2);
              return (
                <tr
                  key={i}
                  title={
                    `95% interval ${number(r.low)} to ${number(r.high)} lux` +
                    `${r.unreliable ? ', which is only a guess' : ''}; ${count(r.samples)} paths`
                  }
                >
                  <th scope="row">{r.position.map((v) => number(v)).join(', ')}</th>
                  <td class="mono">
                    {value}{' '}
                    <span class="dim">
                      ±&nbsp;{half}
                      {r.unreliable && '?'}
                    </span>
                  </td>
                  <td class="mono">{number(r.irradiance_w_m2)}</td>
                </tr>
              );
            })}
          </tbody>
        </table>
      </div>
      {readings.some((r) => r.unreliable) && (
        <p class="hint">
          A question mark means that few paths have found the light there, so the interval is only a
          guess.
        </p>
      )}
      {readings.length > rowsMost && (
        <p class="hint">The first {rowsMost} of them; all are in the CSV.</p>
      )}
    </section>
  );
}
