import { useEffect, useState } from 'preact/hooks';
import type { Server, TypeInfo } from 'tessera-render';
import { useStore } from '../../ui/store';
import { Field, NumberField, refusalsAt } from '../field';
import { change, form, refusals, type FormValues } from './form_model';
import { IntegratorOptions } from './integrator_options';
import { OtherSettings } from './other_settings';
import { isAnimated, sceneDetails } from './scene_source';

/** An entry of the server's lists; if only its name is known, the rest is omitted. */
type Choice = Pick<TypeInfo, 'type'> & Partial<TypeInfo>;

/** An option's name is its last part; a bias is stated. */
const choiceLabel = (c: Choice): string => {
  const name = c.type.slice(c.type.lastIndexOf('.') + 1);
  return c.bias && c.bias !== 'none' ? `${name} (${c.bias})` : name;
};
const named = (names: string[] | undefined): Choice[] => (names ?? []).map((type) => ({ type }));

interface ChoiceFieldProps {
  label: string;
  pointer: string;
  /** Description of the empty choice. */
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
          <option value="">Default</option>
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

const groupLabels: Record<string, string> = {
  'estimator.strategy': 'Strategy',
  'estimator.mis': 'MIS weighting',
  'estimator.roulette': 'Russian roulette',
  'estimator.splitting': 'Path splitting',
  'estimator.expected_values': 'Expected values',
  'estimator.control_variate': 'Control variate',
  'adaptive.granularity': 'Adaptive granularity',
  spectral: 'Wavelengths',
};

/**
 * All other options that the server lists, grouped by the part of their name before the last dot.
 */
function OptionFields({ info, v }: { info: Server | null; v: FormValues }) {
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
          standard="Server default."
          value={v.options[group] ?? ''}
          choices={choices}
          onValue={(name) => change({ options: { ...v.options, [group]: name } })}
        />
      ))}
    </>
  );
}

/** Rarely needed settings; created when opened. */
export function AdvancedFields({ info }: { info: Server | null }) {
  const items = useStore(refusals);
  const [open, setOpen] = useState(false);
  const wrong =
    refusalsAt(items, [
      '/integrator',
      '/sampler',
      '/estimator',
      '/light_sampler',
      '/adaptive',
      '/film/filter',
      '/time_seconds',
      '/shutter_seconds',
      '/seed',
      '/priority',
    ]).length > 0;
  // A refusal inside the collapsed part must be visible.
  useEffect(() => {
    if (wrong) setOpen(true);
  }, [wrong]);
  return (
    <details class="advanced" open={open} onToggle={(e) => setOpen(e.currentTarget.open)}>
      <summary>Advanced settings</summary>
      {open && <AdvancedBody info={info} />}
    </details>
  );
}

function AdvancedBody({ info }: { info: Server | null }) {
  const v = useStore(form);
  const animated = isAnimated(useStore(sceneDetails)) || v.shutterSeconds > 0;
  return (
    <div class="advanced-body">
      <ChoiceField
        label="Integrator"
        pointer="/integrator/type"
        standard="How light paths are traced. The default suits nearly every scene."
        value={v.integrator}
        choices={info?.integrators ?? []}
        onValue={(integrator) => change({ integrator, integratorOptions: {} })}
      />
      <IntegratorOptions key={v.integrator} info={info} />
      <NumberField
        label="Maximum bounces"
        pointers={['/integrator/max_depth']}
        hint="How many times light may bounce. 1 is direct light only; glass needs many."
        value={v.maxDepth ?? info?.defaults.integrator.max_depth}
        min={0}
        max={info?.limits.max_depth}
        onValue={(maxDepth) => change({ maxDepth })}
      />
      <ChoiceField
        label="Sampler"
        pointer="/sampler"
        standard="How sample points are distributed. More even points give less noise."
        value={v.sampler}
        choices={info?.samplers ?? []}
        onValue={(sampler) => change({ sampler })}
      />
      <ChoiceField
        label="Light selection"
        pointer="/light_sampler"
        standard="How a light is picked when there are many."
        value={v.lightSampler}
        choices={info?.light_samplers ?? []}
        onValue={(lightSampler) => change({ lightSampler })}
      />
      <ChoiceField
        label="Adaptive sampling"
        pointer="/adaptive"
        standard={
          'Every pixel gets the same number of samples. With an error target, noisy areas get more.'
        }
        value={v.adaptive}
        choices={info?.adaptive ?? []}
        onValue={(adaptive) => change({ adaptive })}
      />
      <ChoiceField
        label="Pixel filter"
        pointer="/film/filter"
        standard="How samples near a pixel’s edge are shared with its neighbours."
        value={v.filter}
        choices={named(info?.filters)}
        onValue={(filter) => change({ filter })}
      />
      {animated && <TimeFields v={v} />}
      <OptionFields info={info} v={v} />
      <div class="pair">
        <NumberField
          label="Seed"
          pointers={['/seed']}
          value={v.seed}
          min={0}
          max={info?.limits.seed}
          step={1}
          onValue={(seed) => change({ seed })}
        />
        <NumberField
          label="Priority"
          pointers={['/priority']}
          value={v.priority}
          min={info ? -info.limits.priority : undefined}
          max={info?.limits.priority}
          step={1}
          onValue={(priority) => change({ priority })}
        />
      </div>
      <p class="hint">
        The same seed gives exactly the same image. A different seed gives different noise.
      </p>
      <OtherSettings info={info} />
    </div>
  );
}

/** Time in the animation, and exposure time. */
function TimeFields({ v }: { v: FormValues }) {
  return (
    <>
      <div class="pair">
        <NumberField
          label="Animation time (s)"
          pointers={['/time_seconds']}
          data-testid="time-seconds"
          value={v.timeSeconds ?? 0}
          disabled={v.timeSeconds === null}
          step="any"
          onValue={(timeSeconds) => change({ timeSeconds })}
        />
        <NumberField
          label="Shutter (s)"
          pointers={['/shutter_seconds']}
          data-testid="shutter-seconds"
          value={v.shutterSeconds}
          min={0}
          step="any"
          onValue={(shutterSeconds) => change({ shutterSeconds })}
        />
      </div>
      <p class="hint">Whatever moves while the shutter is open is blurred; 0 blurs nothing.</p>
      <label class="check">
        <input
          type="checkbox"
          data-testid="rest-pose"
          checked={v.timeSeconds === null}
          onChange={(e) => change({ timeSeconds: e.currentTarget.checked ? null : 0 })}
        />
        Rest pose: no animation
      </label>
    </>
  );
}
