import type { ComponentChildren } from 'preact';
import { useId } from 'preact/hooks';
import type { FieldError } from 'tessera-render';
import { useStore } from '../ui/store';
import { refusals } from './submit/form_model';

export const refusalsAt = (items: FieldError[], pointers: string[]): FieldError[] =>
  items.filter((item) =>
    pointers.some((p) => item.pointer === p || item.pointer.startsWith(`${p}/`)),
  );

export interface FieldProps {
  label: string;
  /** JSON pointers of the request's members that this field sets. */
  pointers?: string[];
  hint?: ComponentChildren;
  /** Refusals of the request; those of the job unless given. */
  refused?: FieldError[];
  children: (attributes: {
    id: string;
    'aria-describedby': string;
    'aria-invalid': boolean;
  }) => ComponentChildren;
}

/** A labelled control with its explanation and the server's refusals. */
export function Field({ label, pointers = [], hint, refused, children }: FieldProps) {
  const id = useId();
  const ofJob = useStore(refusals);
  const wrong = refusalsAt(refused ?? ofJob, pointers);
  return (
    <div class={`field${wrong.length ? ' field-wrong' : ''}`}>
      <label for={id}>{label}</label>
      {children({
        id,
        'aria-describedby': `${id}-hint ${id}-wrong`,
        'aria-invalid': wrong.length > 0,
      })}
      {hint && (
        <p class="hint" id={`${id}-hint`}>
          {hint}
        </p>
      )}
      <p class="wrong" id={`${id}-wrong`} role={wrong.length ? 'alert' : undefined}>
        {wrong.map((w) => w.detail).join(' ')}
      </p>
    </div>
  );
}

interface NumberProps {
  /** Undefined: not known yet. */
  value: number | undefined;
  min?: number;
  max?: number;
  step?: number | 'any';
  onValue: (value: number) => void;
  [attribute: string]: unknown;
}

/** A number field that allows free typing and passes on only numbers. */
export function NumberInput({ value, onValue, ...rest }: NumberProps) {
  return (
    <input
      type="number"
      inputMode="decimal"
      value={value}
      {...rest}
      onInput={(e) =>
        e.currentTarget.value !== '' &&
        Number.isFinite(e.currentTarget.valueAsNumber) &&
        onValue(e.currentTarget.valueAsNumber)
      }
    />
  );
}

/** A labelled number. */
export function NumberField({
  label,
  pointers,
  hint,
  refused,
  ...input
}: Omit<FieldProps, 'children'> & NumberProps) {
  return (
    <Field label={label} pointers={pointers} hint={hint} refused={refused}>
      {(a) => <NumberInput {...a} {...input} />}
    </Field>
  );
}
