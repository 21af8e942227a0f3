import { useRef } from 'preact/hooks';
import { filesOfInput } from '../../api/upload';
import { useStore } from '../../ui/store';
import { blackbodyColour } from './blackbody';
import { Field, NumberField } from '../field';
import {
  change,
  form,
  type Background,
  type EnvironmentMode,
  type Ground,
  type Shadow,
} from './form_model';
import { panoramas } from './kept_settings';
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
  scene: 'Uses the lights in the file. If there are none, the model is lit by a plain white sky.',
  studio: 'Soft boxes before grey: key, fill, one above and one behind.',
  tent: 'Bright cloth all around, as for small products.',
  rim: 'Two strips behind the model draw its outline.',
  sun: 'Sun and clear sky. North is behind the model (−z).',
  colour: 'Even light of one colour from all directions, like a light tent.',
  file: 'An environment map (.hdr or .exr) lights the scene and is its background.',
  none: 'Only lights that are in the scene.',
};

export function EnvironmentField() {
  const v = useStore(form);
  const sent = useStore(panoramas);
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <Field
        label="Environment light"
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
              if (environment === 'file' && !v.environmentAsset && !sent.length)
                input.current?.click();
            }}
          >
            <option value="scene">From the scene file</option>
            <option value="studio">Studio</option>
            <option value="tent">Product tent</option>
            <option value="rim">Rim light</option>
            <option value="sun">Sun and sky</option>
            <option value="colour">Plain colour</option>
            <option value="file">Environment map (HDRI)…</option>
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
      {v.environment === 'file' && sent.length > 0 && (
        <Field label="Sent earlier">
          {(a) => (
            <select
              {...a}
              data-testid="sent-earlier"
              value={
                sent.some(({ asset }) => asset === v.environmentAsset) ? v.environmentAsset : ''
              }
              onChange={(e) => {
                const map = sent.find(({ asset }) => asset === e.currentTarget.value);
                if (map) change({ environmentAsset: map.asset, environmentName: map.name });
              }}
            >
              <option value="">Choose…</option>
              {sent.map(({ asset, name }) => (
                <option key={asset} value={asset}>
                  {name}
                </option>
              ))}
            </select>
          )}
        </Field>
      )}
      {v.environment === 'colour' && (
        <div class="pair pair-uneven">
          <Field label="Preset">
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
                <option value="">Custom</option>
              </select>
            )}
          </Field>
          <Field label="Colour">
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
      {v.environment === 'sun' && <SunFields />}
      {v.environment !== 'scene' && v.environment !== 'none' && (
        <div class="pair">
          <NumberField
            label="Strength"
            value={v.environmentIntensity}
            min={0}
            step="any"
            onValue={(environmentIntensity) => change({ environmentIntensity })}
          />
          <NumberField
            label="Rotation (°)"
            value={v.environmentRotation}
            step="any"
            onValue={(environmentRotation) => change({ environmentRotation })}
          />
        </div>
      )}
      <StageFields />
    </>
  );
}

/** The time zone of the browser. */
const zone = Intl.DateTimeFormat().resolvedOptions().timeZone;

function SunFields() {
  const v = useStore(form);
  return (
    <>
      <div class="pair">
        <NumberField
          label="Latitude (north)"
          value={v.sunLatitude}
          min={-90}
          max={90}
          step="any"
          onValue={(sunLatitude) => change({ sunLatitude })}
        />
        <NumberField
          label="Longitude (east)"
          value={v.sunLongitude}
          min={-180}
          max={180}
          step="any"
          onValue={(sunLongitude) => change({ sunLongitude })}
        />
      </div>
      <Field
        label={`Date and time (${zone})`}
        hint="Strength 1 is the real sun, about 100,000 lux at noon, which exposure Auto shows."
      >
        {(a) => (
          <input
            {...a}
            type="datetime-local"
            value={v.sunTime}
            onInput={(e) => change({ sunTime: e.currentTarget.value.slice(0, 16) })}
          />
        )}
      </Field>
    </>
  );
}

const polish =
  '0% is matte; 100% is polished and reflects the model, most strongly at shallow angles.';

/** Background and ground of the model. */
function StageFields() {
  const v = useStore(form);
  return (
    <>
      <div class="pair">
        <Field label="Background" pointers={['/background']}>
          {(a) => (
            <>
              <select
                {...a}
                data-testid="background"
                value={v.background}
                onChange={(e) => change({ background: e.currentTarget.value as Background })}
              >
                <option value="environment">Environment</option>
                <option value="blurred">Blurred environment</option>
                <option value="color">Colour</option>
                <option value="transparent">Transparent</option>
              </select>
              {v.background === 'color' && (
                <input
                  type="color"
                  aria-label="Colour of the background"
                  value={v.backgroundColour}
                  onInput={(e) => change({ backgroundColour: e.currentTarget.value })}
                />
              )}
            </>
          )}
        </Field>
        <Field label="Ground" pointers={['/ground']}>
          {(a) => (
            <select
              {...a}
              data-testid="ground"
              value={v.ground}
              onChange={(e) => {
                const ground = e.currentTarget.value as Ground;
                change(ground === 'catcher' ? { ground, background: 'transparent' } : { ground });
              }}
            >
              <option value="none">None</option>
              <option value="catcher">Shadow only</option>
              <option value="sweep">Studio sweep</option>
            </select>
          )}
        </Field>
      </div>
      {v.background === 'transparent' && (
        <label class="check">
          <input
            type="checkbox"
            data-testid="through-glass"
            checked={v.throughGlass}
            onChange={(e) => change({ throughGlass: e.currentTarget.checked })}
          />
          Glass lets the page behind the image show through
        </label>
      )}
      {v.ground === 'catcher' && <ShadowFields />}
      {v.ground !== 'none' && (
        <ShareField
          label="Ground reflection"
          hint={polish}
          testId="ground-reflection"
          value={v.groundReflection}
          onValue={(groundReflection) => change({ groundReflection })}
        />
      )}
    </>
  );
}

/** The shadow on a catcher. */
function ShadowFields() {
  const v = useStore(form);
  return (
    <>
      <Field
        label="Shadow"
        pointers={['/ground/shadow']}
        hint="Neutral darkens any background alike; physical has the colours of the light."
      >
        {(a) => (
          <select
            {...a}
            data-testid="shadow"
            value={v.shadow}
            onChange={(e) => change({ shadow: e.currentTarget.value as Shadow })}
          >
            <option value="neutral">Neutral</option>
            <option value="physical">Physical</option>
          </select>
        )}
      </Field>
      <ShareField
        label="Shadow strength"
        hint="0% is no shadow."
        testId="shadow-strength"
        value={v.shadowStrength}
        onValue={(shadowStrength) => change({ shadowStrength })}
      />
      <ShareField
        label="Shadow softness"
        hint="Widens every light for the shadow."
        testId="shadow-softness"
        value={v.shadowSoftness}
        onValue={(shadowSoftness) => change({ shadowSoftness })}
      />
    </>
  );
}

interface ShareFieldProps {
  label: string;
  hint: string;
  testId: string;
  value: number;
  onValue: (value: number) => void;
}

/** A slider from 0 to 1, in percent. */
function ShareField({ label, hint, testId, value, onValue }: ShareFieldProps) {
  return (
    <Field label={label} hint={hint}>
      {(a) => (
        <span class="slider">
          <input
            {...a}
            type="range"
            min={0}
            max={100}
            step={5}
            data-testid={testId}
            value={Math.round(100 * value)}
            onInput={(e) => onValue(e.currentTarget.valueAsNumber / 100)}
          />
          <output class="mono">{Math.round(100 * value)}%</output>
        </span>
      )}
    </Field>
  );
}
