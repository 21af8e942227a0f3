import { useEffect } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { api } from '../../api/client';
import { filmOf } from '../../api/states';
import { Store, useStore } from '../../ui/store';
import { familiesOf, firstFamily } from './mix_families';
import { isPart, shareModes } from './view_modes';

const most = 4;

/** Weights of the shares of a job's light, by job and layer, where they were set. */
const weights = new Store<Record<string, number>>({});
/** Names of the light groups, by scene. */
const lightGroups = new Store<Record<string, string[]>>({});

const keyOf = (job: Job, layer: string): string => `${job.id} ${layer}`;

/**
 * The weight of each part of a job's light. At first one family has 1 and the others 0, since each
 * is the whole image.
 */
function useWeights(job: Job): { weightOf: (layer: string) => number; isKnown: boolean } {
  const set = useStore(weights);
  const groups = useStore(lightGroups)[job.spec.scene];
  const families = familiesOf(job);
  const { scene } = job.spec;
  // The scene decides whether the lights are complete: asked for only if that matters.
  const asks = !groups && families.length > 1 && firstFamily(families, [])?.label === 'Lights';
  useEffect(() => {
    if (!asks) return;
    const tell = (found: string[]): void =>
      lightGroups.set({ ...lightGroups.get(), [scene]: found });
    api.scene(scene).then(
      (found) => tell(found.light_groups),
      () => tell([]),
    );
  }, [scene, asks]);
  const first = firstFamily(families, groups ?? []);
  const weightOf = (layer: string): number =>
    set[keyOf(job, layer)] ?? (first?.layers.includes(layer) ? 1 : 0);
  return { weightOf, isKnown: !asks };
}

/** In the format of `mix` in the image's address; null: not known yet. */
export function useMix(job: Job): string | null {
  const { weightOf, isKnown } = useWeights(job);
  return isKnown ? filmOf(job).layers.filter(isPart).map(weightOf).join(',') : null;
}

/** A slider for each light share: shows the lights dimmed or brightened. */
export function LightMixer({ job }: { job: Job }) {
  const { weightOf } = useWeights(job);
  const families = familiesOf(job);
  const turn = (layer: string, weight: number): void =>
    weights.set({ ...weights.get(), [keyOf(job, layer)]: weight });
  return (
    <div class="mixers" data-testid="mixer">
      {families.length > 1 && (
        <p class="hint">
          {new Intl.ListFormat('en').format(families.map(({ label }) => label))} are the same light
          sorted in different ways: together they would add up to more light than there is.
        </p>
      )}
      {families.map(({ label: name, layers }) => (
        <fieldset key={name} class="mixer">
          <legend>{name}</legend>
          {shareModes(layers).map(({ mode, label, meaning }) => {
            const weight = weightOf(mode);
            return (
              <label key={mode} class="exposure" title={`${meaning} Double-click sets 1.`}>
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
      ))}
    </div>
  );
}
