import { useEffect, useState } from 'preact/hooks';
import type { Job, MeterComparison } from 'tessera-render';
import { api, explain } from '../../api/client';
import { isAvailable } from '../../api/states';
import { number, percent } from '../../ui/format';
import { MeterMap } from '../job/meter_map';

/** The meters of two designs, side by side and as their difference; nothing without meters. */
export function MeterCompare({ a, b }: { a: Job | null; b: Job | null }) {
  const [found, setFound] = useState<MeterComparison | null>(null);
  const [trouble, setTrouble] = useState('');
  const ready = isAvailable(a, 'meter') && isAvailable(b, 'meter');
  useEffect(() => {
    if (!ready || !a || !b) return;
    const abort = new AbortController();
    api.compareMeters(a.id, b.id, abort.signal).then(
      (answer) => {
        setFound(answer);
        setTrouble('');
      },
      (error: unknown) => !abort.signal.aborted && setTrouble(explain(error)),
    );
    return () => abort.abort();
  }, [a?.id, b?.id, a?.revision, b?.revision, ready]);
  if (trouble) return <p class="compare-note">The meters are not compared: {trouble}</p>;
  if (!found || !a) return null;
  const plane = a.spec.meter?.plane;
  const { points } = found;
  const rows: [string, (side: MeterComparison['a']) => string][] = [
    ['Mean, lux', (side) => number(side.mean_lux)],
    ['Uniformity', (side) => number(side.uniformity)],
    ['Daylight factor', (side) => percent(side.daylight_factor)],
  ];
  const changed = points.filter((p) => p.low > 0 || p.high < 0).length;
  const map = (lux: (p: MeterComparison['points'][number]) => number, meaning: string) =>
    plane && (
      <MeterMap
        plane={plane}
        values={points.map((p) => ({ lux: lux(p), position: p.position }))}
        meaning={meaning}
      />
    );
  return (
    <section class="card" aria-labelledby="meters-title" data-testid="meter-compare">
      <header class="card-head">
        <h2 id="meters-title">Meters</h2>
      </header>
      <table class="figures-table">
        <thead>
          <tr>
            <th scope="col">Figure</th>
            <th scope="col">A</th>
            <th scope="col">B</th>
          </tr>
        </thead>
        <tbody>
          {rows.map(([name, text]) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td class="mono">{text(found.a)}</td>
              <td class="mono">{text(found.b)}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <p class="hint" data-testid="meter-difference">
        A − B is {number(found.difference_lux)} lux on average; {changed} of {points.length} points
        differ by more than their 95% intervals.
      </p>
      <div class="meter-compare">
        {map((p) => p.a_lux, 'Illuminance in A.')}
        {map((p) => p.b_lux, 'Illuminance in B.')}
        {map((p) => Math.abs(p.difference_lux), 'Difference between A and B, without its sign.')}
      </div>
    </section>
  );
}
