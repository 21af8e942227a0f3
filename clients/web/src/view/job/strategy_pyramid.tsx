import { useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { imageUrl } from '../../api/client';
import { filmOf } from '../../api/states';
import { display } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { useRevision } from './server_image';
import { shareModes, strategyOf, type Mode, type Strategy } from './view_modes';

const thumbPx = 160;

interface Row {
  vertices: number;
  /** From fewest light vertices to most; null: a strategy that the job does not record. */
  cells: (Strategy | null)[];
}

/** A row for each number of vertices, so that paths of one length are side by side. */
function rowsOf(strategies: Strategy[]): Row[] {
  const lengths = [...new Set(strategies.map(({ s, t }) => s + t))].sort((a, b) => a - b);
  return lengths.map((vertices) => ({
    vertices,
    cells: Array.from(
      { length: vertices },
      (_, s) => strategies.find((one) => one.s === s && one.t === vertices - s) ?? null,
    ),
  }));
}

/**
 * The strategies of bidirectional path tracing that a job records, by the number of path vertices.
 * Source of the drawing: Veach 1997, figure 10.2.
 */
export function StrategyPyramid({
  job,
  mode,
  onMode,
}: {
  job: Job;
  mode: Mode;
  onMode: (mode: Mode) => void;
}) {
  const kept = filmOf(job).layers.flatMap((layer) => strategyOf(layer) ?? []);
  const alone = kept.filter((one) => one.unweighted);
  const weighted = kept.filter((one) => !one.unweighted);
  const [asksAlone, setAsksAlone] = useState(false);
  const { exposure, tone } = useStore(display);
  const revision = useRevision(job, false, 'st');
  if (!kept.length) return null;
  const isAlone = alone.length > 0 && (asksAlone || !weighted.length);
  return (
    <section class="card" aria-labelledby="strategies-title" data-testid="pyramid">
      <header class="card-head">
        <h2 id="strategies-title">Strategies</h2>
        {alone.length > 0 && weighted.length > 0 && (
          <label>
            <input
              type="checkbox"
              checked={isAlone}
              data-testid="pyramid-unweighted"
              onChange={(e) => setAsksAlone(e.currentTarget.checked)}
            />{' '}
            Without MIS weights
          </label>
        )}
      </header>
      <div class="pyramid">
        {rowsOf(isAlone ? alone : weighted).map(({ vertices, cells }) => (
          <div key={vertices} class="pyramid-row" role="group" aria-label={`${vertices} vertices`}>
            {cells.map((one, s) => {
              if (!one) return <span key={s} class="pyramid-gap" />;
              const { meaning } = shareModes([one.layer])[0];
              const query = { layer: one.layer, exposure, tonemap: tone, max_size: thumbPx };
              return (
                <button
                  key={s}
                  type="button"
                  class="pyramid-cell"
                  title={meaning}
                  aria-pressed={mode === one.layer}
                  data-testid={`pyramid-${one.layer}`}
                  onClick={() => onMode(mode === one.layer ? 'picture' : one.layer)}
                >
                  {revision > 0 && (
                    <img src={imageUrl(job.id, 'png', { ...query, revision })} alt="" />
                  )}
                  <span class="mono">{`s${one.s} t${one.t}`}</span>
                </button>
              );
            })}
          </div>
        ))}
      </div>
      <p class="hint">
        A row for each number of vertices; from left to right more of them are made from the light.
      </p>
    </section>
  );
}
