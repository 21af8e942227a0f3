import { useState } from 'preact/hooks';
import { say } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { Field } from '../field';
import { form } from './form_model';
import { applyPreset, lookPresets, presetOf } from './kept_settings';

const nameCharacters = 60;

const contents =
  'Keeps size, light, background, ground, views and stop rules in this browser, not the model ' +
  'and its camera.';

/** Settings of a look under a name, for other models: size, light, ground, stop rules. */
export function LookPresets() {
  const known = useStore(lookPresets);
  const [name, setName] = useState('');
  const names = Object.keys(known).sort();
  const save = (): void => {
    lookPresets.set({ ...lookPresets.get(), [name.trim()]: presetOf(form.get()) });
    say(`Preset ${name.trim()} saved in this browser.`);
  };
  const remove = (): void => {
    const { [name.trim()]: gone, ...rest } = lookPresets.get();
    if (gone) lookPresets.set(rest);
    setName('');
  };
  return (
    <details class="advanced" data-testid="presets">
      <summary>Presets</summary>
      <div class="advanced-body">
        {names.length > 0 && (
          <Field label="Use a preset">
            {(a) => (
              <select
                {...a}
                data-testid="preset"
                value={known[name] ? name : ''}
                onChange={(e) => {
                  const chosen = e.currentTarget.value;
                  setName(chosen);
                  if (known[chosen]) applyPreset(known[chosen]);
                }}
              >
                <option value="">Choose…</option>
                {names.map((one) => (
                  <option key={one} value={one}>
                    {one}
                  </option>
                ))}
              </select>
            )}
          </Field>
        )}
        <Field label="Name of a preset" hint={contents}>
          {(a) => (
            <input
              {...a}
              type="text"
              data-testid="preset-name"
              maxLength={nameCharacters}
              value={name}
              onInput={(e) => setName(e.currentTarget.value)}
            />
          )}
        </Field>
        <div class="pair">
          <button
            type="button"
            class="quiet"
            data-testid="preset-save"
            disabled={!name.trim()}
            onClick={save}
          >
            {known[name.trim()] ? 'Replace' : 'Save'}
          </button>
          <button type="button" class="quiet" disabled={!known[name.trim()]} onClick={remove}>
            Delete
          </button>
        </div>
      </div>
    </details>
  );
}
