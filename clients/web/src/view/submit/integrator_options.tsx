import { useEffect, useState } from 'preact/hooks';
import type { Server } from 'tessera-render';
import { api, resolved, type Description, type Member } from '../../api/client';
import { Store, useStore } from '../../ui/store';
import { Field, NumberInput } from '../field';
import { change, form, integratorOptions } from './form_model';

/** Members of `integrator` in the server's description; null: not requested yet. */
const described = new Store<Record<string, Member> | null>(null);

/** "radius_m" is "Radius, m". */
function labelOf(name: string): string {
  const text = name.replace(/_m$/, ', m').replace(/_/g, ' ');
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** The options that only some integrators have. */
export function IntegratorOptions({ info }: { info: Server | null }) {
  const v = useStore(form);
  const members = useStore(described);
  const options = integratorOptions(info, v.integrator);
  const [chosen, setChosen] = useState(options[0]?.name);
  const asks = options.length > 0 && members === null;
  useEffect(() => {
    if (!asks) return;
    api.description<Description>().then(
      (d) => {
        const member = d.components.schemas.JobRequest?.properties?.integrator ?? {};
        described.set(resolved(member, d).properties ?? {});
      },
      () => described.set({}), // The fields work without it.
    );
  }, [asks]);
  if (!options.length) return null;
  return (
    <div data-testid="integrator-options">
      <div class="pair options">
        {options.map(({ name, pointer, standard }) => {
          const { type, description, minimum, maximum, enum: choices } = members?.[name] ?? {};
          const value = v.integratorOptions[name] ?? standard;
          const set = (given: number | string): void =>
            change({ integratorOptions: { ...form.get().integratorOptions, [name]: given } });
          const shared = {
            'data-testid': `integrator-${name}`,
            title: description,
            onFocus: () => setChosen(name),
          };
          return (
            <Field key={name} label={labelOf(name)} pointers={[pointer]}>
              {(a) =>
                standard === undefined ? (
                  <select
                    {...a}
                    {...shared}
                    value={value}
                    onChange={(e) => set(e.currentTarget.value)}
                  >
                    {choices?.map((choice) => (
                      <option key={choice} value={choice}>
                        {choice}
                      </option>
                    ))}
                  </select>
                ) : (
                  <NumberInput
                    {...a}
                    {...shared}
                    value={Number(value)}
                    min={minimum}
                    max={maximum}
                    step={type === 'integer' ? 1 : 'any'}
                    onValue={set}
                  />
                )
              }
            </Field>
          );
        })}
      </div>
      {chosen && members?.[chosen]?.description && (
        <p class="hint" aria-live="polite">
          {labelOf(chosen)}: {members[chosen].description}
        </p>
      )}
    </div>
  );
}
