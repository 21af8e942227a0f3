import { useRef } from 'preact/hooks';
import { filesOfInput } from '../api/upload';
import { useStore } from '../ui/store';
import { blackbodyColour } from './blackbody';
import { Field, NumberInput } from './field';
import { change, form, type EnvironmentMode } from './form_model';
import { take } from './scene_source';

const kinds = [
  { name: 'White', colour: '#ffffff' },
  ...[
    ['Blue sky', 10000],
    ['Sunlight', 5500],
    ['Halogen lamp', 3200],
    ['Light bulb', 2700],
    ['Candle', 1850],
  ].map(([name, kelvin]) => ({
    name: `${name}, ${kelvin} K`,
    colour: blackbodyColour(kelvin as number),
  })),
];

const environmentHints: Record<EnvironmentMode, string> = {
  scene: 'The scene’s own lights; a model without any gets a white sky.',
  colour: 'One colour from all sides, as in a light tent.',
  file: 'A panorama (.hdr or .exr) lights the scene and shows behind it.',
  none: 'Only lights that are in the scene.',
};

export function EnvironmentField() {
  const v = useStore(form);
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <Field
        label="Light around the scene"
        pointers={['/environment']}
        hint={
          v.environment === 'file' && v.environmentName
            ? v.environmentName
            : environmentHints[v.environment]
        }
      >
        {(a) => (
          <select
            {...a}
            value={v.environment}
            onChange={(e) => {
              const environment = e.currentTarget.value as EnvironmentMode;
              change({ environment });
              if (environment === 'file' && !v.environmentAsset) input.current?.click();
            }}
          >
            <option value="scene">As the scene has it</option>
            <option value="colour">Plain colour</option>
            <option value="file">Panorama file</option>
            <option value="none">None</option>
          </select>
        )}
      </Field>
      <input
        ref={input}
        class="visually-hidden"
        type="file"
        tabIndex={-1}
        accept=".hdr,.exr"
        aria-label="Environment file"
        onChange={(e) => {
          void take(filesOfInput(e.currentTarget));
          e.currentTarget.value = '';
        }}
      />
      {v.environment === 'file' && (
        <button type="button" class="quiet" onClick={() => input.current?.click()}>
          {v.environmentName ? 'Choose another file' : 'Choose a file'}
        </button>
      )}
      {v.environment === 'colour' && (
        <div class="pair pair-uneven">
          <Field label="Kind of light" pointers={[]}>
            {(a) => (
              <select
                {...a}
                data-testid="light-kind"
                value={
                  kinds.some((k) => k.colour === v.environmentColour) ? v.environmentColour : ''
                }
                onChange={(e) =>
                  e.currentTarget.value && change({ environmentColour: e.currentTarget.value })
                }
              >
                {kinds.map((k) => (
                  <option key={k.name} value={k.colour}>
                    {k.name}
                  </option>
                ))}
                <option value="">Own colour</option>
              </select>
            )}
          </Field>
          <Field label="Colour" pointers={[]}>
            {(a) => (
              <input
                {...a}
                type="color"
                value={v.environmentColour}
                onInput={(e) => change({ environmentColour: e.currentTarget.value })}
              />
            )}
          </Field>
        </div>
      )}
      {(v.environment === 'colour' || v.environment === 'file') && (
        <>
          <div class="pair">
            <Field label="Strength" pointers={[]}>
              {(a) => (
                <NumberInput
                  {...a}
                  value={v.environmentIntensity}
                  min={0}
                  step="any"
                  onValue={(environmentIntensity) => change({ environmentIntensity })}
                />
              )}
            </Field>
            <Field label="Turn (degrees)" pointers={[]}>
              {(a) => (
                <NumberInput
                  {...a}
                  value={v.environmentRotation}
                  step="any"
                  onValue={(environmentRotation) => change({ environmentRotation })}
                />
              )}
            </Field>
          </div>
          <label class="check">
            <input
              type="checkbox"
              checked={v.environmentVisible}
              onChange={(e) => change({ environmentVisible: e.currentTarget.checked })}
            />
            Show it behind the scene
          </label>
        </>
      )}
    </>
  );
}
