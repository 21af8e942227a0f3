import { useEffect, useRef, useState } from 'preact/hooks';
import { nameOf, type Choice, type ServerInfo } from '../api/types';
import { filesOfInput } from '../api/upload';
import { useStore } from '../ui/store';
import { Field, NumberInput, refusalsAt } from './field';
import { change, form, refusals, type EnvironmentMode, type FormValues } from './form_model';
import { take } from './scene_source';

/** An option's own name is its last part; what is not unbiased says so. */
const choiceLabel = (c: Choice): string => {
  const name = c.type.slice(c.type.lastIndexOf('.') + 1);
  return c.bias && c.bias !== 'none' ? `${name} (${c.bias})` : name;
};
const asChoices = (list: unknown[] | undefined): Choice[] =>
  (list ?? []).map((c) =>
    typeof c === 'string'
      ? { type: c }
      : { ...(c as Choice), type: nameOf(c as { name?: string; type?: string }) },
  );

interface ChoiceFieldProps {
  label: string;
  pointer: string;
  /** What the empty choice means, in words. */
  standard: string;
  value: string;
  choices: Choice[];
  onValue: (value: string) => void;
}

function ChoiceField({ label, pointer, standard, value, choices, onValue }: ChoiceFieldProps) {
  if (choices.length === 0) return null;
  const chosen = choices.find((c) => c.type === value);
  return (
    <Field label={label} pointers={[pointer]} hint={chosen?.summary ?? standard}>
      {(a) => (
        <select {...a} value={value} onChange={(e) => onValue(e.currentTarget.value)}>
          <option value="">Standard</option>
          {choices.map((c) => (
            <option key={c.type} value={c.type}>
              {choiceLabel(c)}
            </option>
          ))}
        </select>
      )}
    </Field>
  );
}

const environmentHints: Record<EnvironmentMode, string> = {
  scene: 'The scene’s own lights; a model without any gets a white sky.',
  colour: 'One colour from all sides, as in a light tent.',
  file: 'A panorama (.hdr or .exr) lights the scene and shows behind it.',
  none: 'Only lights that are in the scene.',
};

function EnvironmentField({ v }: { v: FormValues }) {
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

const groupLabels: Record<string, string> = {
  'estimator.strategy': 'Strategy',
  'estimator.mis': 'Weights of strategies',
  'estimator.roulette': 'End of paths',
  'estimator.splitting': 'Splitting of paths',
  'estimator.expected_values': 'Expected values',
  'estimator.control_variate': 'Control variate',
};

/** Every other switch that the server lists, grouped by the part of its name before the last dot. */
function OptionFields({ info, v }: { info: ServerInfo | null; v: FormValues }) {
  const groups = new Map<string, Choice[]>();
  for (const option of info?.options ?? []) {
    const dot = option.name.lastIndexOf('.');
    const group = dot < 0 ? option.name : option.name.slice(0, dot);
    const list = groups.get(group) ?? [];
    groups.set(group, [...list, { type: option.name, bias: option.bias, summary: option.summary }]);
  }
  return (
    <>
      {[...groups].map(([group, choices]) => (
        <ChoiceField
          key={group}
          label={groupLabels[group] ?? group.replace(/[._]/g, ' ')}
          pointer={`/${group.replace(/\./g, '/')}`}
          standard="As the server does it by default."
          value={v.options[group] ?? ''}
          choices={choices}
          onValue={(name) => change({ options: { ...v.options, [group]: name } })}
        />
      ))}
    </>
  );
}

export function AdvancedFields({ info }: { info: ServerInfo | null }) {
  const v = useStore(form);
  const items = useStore(refusals);
  const [open, setOpen] = useState(false);
  const wrong =
    refusalsAt(items, [
      '/environment',
      '/integrator',
      '/sampler',
      '/estimator',
      '/light_sampler',
      '/adaptive',
      '/film/filter',
      '/seed',
      '/priority',
      '/name',
    ]).length > 0;
  // A refusal inside the folded part must be seen.
  useEffect(() => {
    if (wrong) setOpen(true);
  }, [wrong]);
  return (
    <details class="advanced" open={open} onToggle={(e) => setOpen(e.currentTarget.open)}>
      <summary>Light, method, seed</summary>
      <div class="advanced-body">
        <EnvironmentField v={v} />
        <ChoiceField
          label="Integrator"
          pointer="/integrator/type"
          standard="How light is followed. The standard one is right for nearly everything."
          value={v.integrator}
          choices={asChoices(info?.integrators)}
          onValue={(integrator) => change({ integrator })}
        />
        <Field
          label="Longest path"
          pointers={['/integrator/max_depth', '/integrator']}
          hint="How often light may bounce. 1 is direct light only; glass needs many."
        >
          {(a) => (
            <NumberInput
              {...a}
              value={v.maxDepth}
              min={0}
              max={1024}
              onValue={(maxDepth) => change({ maxDepth })}
            />
          )}
        </Field>
        <ChoiceField
          label="Sampler"
          pointer="/sampler"
          standard="How random numbers are spread. Even spreading means less grain."
          value={v.sampler}
          choices={asChoices(info?.samplers)}
          onValue={(sampler) => change({ sampler })}
        />
        <ChoiceField
          label="Light choice"
          pointer="/light_sampler"
          standard="Which lamp is asked first when there are many."
          value={v.lightSampler}
          choices={asChoices(info?.light_samplers)}
          onValue={(lightSampler) => change({ lightSampler })}
        />
        <ChoiceField
          label="Where samples go"
          pointer="/adaptive"
          standard="Noisy places can be given more samples than calm ones."
          value={v.adaptive}
          choices={asChoices(info?.adaptive)}
          onValue={(adaptive) => change({ adaptive })}
        />
        <ChoiceField
          label="Pixel filter"
          pointer="/film/filter"
          standard="How samples near a pixel’s edge are shared with its neighbours."
          value={v.filter}
          choices={asChoices(info?.filters)}
          onValue={(filter) => change({ filter })}
        />
        <OptionFields info={info} v={v} />
        <div class="pair">
          <Field label="Seed" pointers={['/seed']}>
            {(a) => (
              <NumberInput
                {...a}
                value={v.seed}
                min={0}
                max={Number.MAX_SAFE_INTEGER}
                step={1}
                onValue={(seed) => change({ seed })}
              />
            )}
          </Field>
          <Field label="Priority" pointers={['/priority']}>
            {(a) => (
              <NumberInput
                {...a}
                value={v.priority}
                min={-100}
                max={100}
                step={1}
                onValue={(priority) => change({ priority })}
              />
            )}
          </Field>
        </div>
        <p class="hint">
          The same seed gives the same picture, bit for bit. Another seed gives other grain.
        </p>
        <Field label="Name" pointers={['/name']}>
          {(a) => (
            <input
              {...a}
              type="text"
              value={v.name}
              maxLength={200}
              onInput={(e) => change({ name: e.currentTarget.value })}
            />
          )}
        </Field>
      </div>
    </details>
  );
}
