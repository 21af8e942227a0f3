import type { Job } from '../api/types';
import { Store, useStore } from '../ui/store';
import { isPart, shareModes } from './view_modes';

const most = 4;

/** Weights of the shares of a job's light, by job and layer; 1 where nothing was set. */
const weights = new Store<Record<string, number>>({});

const keyOf = (job: Job, layer: string): string => `${job.id} ${layer}`;
const sharesOf = (job: Job): string[] => (job.spec.film.layers ?? []).filter(isPart);

/** In the format of `mix` in the image's address. */
export function useMix(job: Job): string {
  const set = useStore(weights);
  return sharesOf(job)
    .map((layer) => set[keyOf(job, layer)] ?? 1)
    .join(',');
}

/** A slider for each light share: shows the lights dimmed or brightened. */
export function LightMixer({ job }: { job: Job }) {
  const set = useStore(weights);
  const turn = (layer: string, weight: number): void =>
    weights.set({ ...weights.get(), [keyOf(job, layer)]: weight });
  return (
    <fieldset class="mixer" data-testid="mixer">
      <legend class="visually-hidden">Shares of the light</legend>
      {shareModes(sharesOf(job)).map(({ mode, label, meaning }) => {
        const weight = set[keyOf(job, mode)] ?? 1;
        return (
          <label key={mode} class="exposure" title={`${meaning} Double-click resets.`}>
            <span>{label}</span>
            <input
              type="range"
              min={0}
              max={most}
              step={0.05}
              value={weight}
              data-testid={`mix-${mode}`}
              aria-valuetext={`${weight} times`}
              onChange={(e) => turn(mode, e.currentTarget.valueAsNumber)}
              onDblClick={() => turn(mode, 1)}
            />
            <output class="mono">{weight.toFixed(2)}</output>
          </label>
        );
      })}
    </fieldset>
  );
}
