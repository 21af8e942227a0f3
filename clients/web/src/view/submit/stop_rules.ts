import type { Server } from 'tessera-render';
import type { FormValues } from './form_model';

type Members<T> = {
  [Key in keyof FormValues]: FormValues[Key] extends T ? Key : never;
}[keyof FormValues];

/** A stop rule of the form: form, request and "use again" walk the rows. */
interface StopRule {
  /** In the job's `stop`; a percentage of the form is a fraction there. */
  member:
    | 'relative_error'
    | 'denoised_error'
    | 'light_not_found'
    | 'meter_error'
    | 'samples_per_pixel'
    | 'seconds'
    | 'cpu_seconds';
  use: Members<boolean>;
  value: Members<number>;
  /** What the job must make for the rule to apply. */
  of?: 'image' | 'meter';
  label: string;
  unit: '%' | 's' | '';
  min: number;
  step: number | 'any';
  limit?: 'samples_per_pixel' | 'stop_seconds' | 'stop_cpu_seconds';
  testId: string;
}

const percentage = { unit: '%', min: 0.01, step: 'any' } as const;

export const stopRules: readonly StopRule[] = [
  {
    ...percentage,
    member: 'relative_error',
    use: 'useError',
    value: 'errorPercent',
    of: 'image',
    label: 'error is below',
    testId: 'stop-error',
  },
  {
    ...percentage,
    member: 'denoised_error',
    use: 'useDenoisedError',
    value: 'denoisedErrorPercent',
    of: 'image',
    label: 'denoised error is below',
    testId: 'stop-denoised-error',
  },
  {
    ...percentage,
    member: 'light_not_found',
    use: 'useLightNotFound',
    value: 'lightNotFoundPercent',
    of: 'image',
    label: 'light not found is below',
    testId: 'stop-light-not-found',
  },
  {
    ...percentage,
    member: 'meter_error',
    use: 'useMeterError',
    value: 'meterErrorPercent',
    of: 'meter',
    label: 'meter’s intervals are below',
    testId: 'stop-meter-error',
  },
  {
    member: 'samples_per_pixel',
    use: 'useSamples',
    value: 'samples',
    label: 'samples per pixel reach',
    unit: '',
    min: 1,
    step: 1,
    limit: 'samples_per_pixel',
    testId: 'stop-samples',
  },
  {
    member: 'seconds',
    use: 'useSeconds',
    value: 'seconds',
    label: 'time reaches',
    unit: 's',
    min: 0.1,
    step: 'any',
    limit: 'stop_seconds',
    testId: 'stop-seconds',
  },
  {
    member: 'cpu_seconds',
    use: 'useCpuSeconds',
    value: 'cpuSeconds',
    label: 'CPU time reaches',
    unit: 's',
    min: 0.1,
    step: 'any',
    limit: 'stop_cpu_seconds',
    testId: 'stop-cpu-seconds',
  },
];

/** The rules that apply to what the form's job makes. */
export const rulesFor = ({ output }: FormValues): readonly StopRule[] =>
  stopRules.filter(({ of }) => !of || output === 'both' || output === of);

export const greatestOf = (rule: StopRule, info: Server | null): number | undefined =>
  rule.unit === '%' ? 100 : rule.limit && info?.limits[rule.limit];

/** The form's value in a job's unit, and back. */
export const perUnit = ({ unit }: StopRule): number => (unit === '%' ? 100 : 1);
