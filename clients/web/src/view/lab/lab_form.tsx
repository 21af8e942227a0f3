import type { Experiment, FieldError } from 'tessera-render';
import { number } from '../../ui/format';
import { MathText } from '../../ui/math_text';
import { Field, NumberInput, type FieldProps } from '../field';
import type { LabForm } from './lab_model';

interface RowProps extends Omit<FieldProps, 'pointers'> {
  /** JSON pointer of the request. */
  pointer: string;
  hint: string;
}

function Row({ pointer, hint, ...rest }: RowProps) {
  return <Field pointers={[pointer]} hint={hint && <MathText text={hint} />} {...rest} />;
}

const biasWords: Record<string, string> = {
  none: 'Unbiased.',
  consistent: 'Biased for finite n; the bias vanishes as n grows.',
  biased: 'Biased, at any n.',
};

const named = (name: string): string => {
  const words = name.replace(/_/g, ' ');
  return words.charAt(0).toUpperCase() + words.slice(1);
};

interface ChoicesProps {
  experiment: Experiment;
  form: LabForm;
  wrong: FieldError[];
  onChange: (part: Partial<LabForm>) => void;
}

/** Settings of a run. */
export function Choices({ experiment, form, wrong, onChange }: ChoicesProps) {
  const estimator = experiment.estimators.find((e) => e.name === form.estimator);
  return (
    <>
      <Row
        label="Estimator"
        pointer="/estimator"
        refused={wrong}
        hint={`${estimator?.summary ?? ''} ${biasWords[estimator?.bias ?? ''] ?? ''}`}
      >
        {(attributes) => (
          <select
            {...attributes}
            value={form.estimator}
            onChange={(e) => onChange({ estimator: e.currentTarget.value })}
          >
            {experiment.estimators.map((e) => (
              <option key={e.name}>{e.name}</option>
            ))}
          </select>
        )}
      </Row>
      <Row
        label="Sampler"
        pointer="/sampler"
        refused={wrong}
        hint={experiment.samplers.length > 1 ? '' : 'The only one that this experiment takes.'}
      >
        {(attributes) => (
          <select
            {...attributes}
            value={form.sampler}
            onChange={(e) => onChange({ sampler: e.currentTarget.value })}
          >
            {experiment.samplers.map((s) => (
              <option key={s}>{s}</option>
            ))}
          </select>
        )}
      </Row>
      {experiment.params.map((p) => (
        <Row
          key={p.name}
          label={named(p.name)}
          pointer={`/params/${p.name}`}
          refused={wrong}
          hint={`${p.summary} ${number(p.min)} to ${number(p.max)}.`}
        >
          {(attributes) => (
            <NumberInput
              {...attributes}
              value={form.params[p.name]}
              min={p.min}
              max={p.max}
              step={p.integer ? 1 : 'any'}
              onValue={(value) => onChange({ params: { ...form.params, [p.name]: value } })}
            />
          )}
        </Row>
      ))}
      <Row
        label={`n, ${experiment.unit}`}
        pointer="/n"
        refused={wrong}
        hint="Comma-separated; one plot point per value."
      >
        {(attributes) => (
          <input
            type="text"
            inputMode="numeric"
            autocomplete="off"
            {...attributes}
            value={form.n}
            onInput={(e) => onChange({ n: e.currentTarget.value })}
          />
        )}
      </Row>
      <div class="pair">
        <Row label="Replicates" pointer="/replicates" refused={wrong} hint="Repetitions at each n.">
          {(attributes) => (
            <NumberInput
              {...attributes}
              value={form.replicates}
              min={2}
              step={1}
              onValue={(replicates) => onChange({ replicates })}
            />
          )}
        </Row>
        <Row
          label="Seed"
          pointer="/seed"
          refused={wrong}
          hint="The same seed gives the same numbers."
        >
          {(attributes) => (
            <NumberInput
              {...attributes}
              value={form.seed}
              min={0}
              step={1}
              onValue={(seed) => onChange({ seed })}
            />
          )}
        </Row>
      </div>
    </>
  );
}
