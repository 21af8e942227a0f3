import { serverInfo } from '../ui/server_state';
import { useStore } from '../ui/store';
import { NumberInput, refusalsAt } from './field';
import { change, form, refusals } from './form_model';

interface RuleProps {
  on: boolean;
  label: string;
  unit: string;
  value: number;
  min: number;
  max?: number;
  step: number | 'any';
  testId: string;
  onToggle: (on: boolean) => void;
  onValue: (value: number) => void;
}

function Rule(p: RuleProps) {
  return (
    <div class={`rule${p.on ? ' rule-on' : ''}`}>
      <label class="check">
        <input
          type="checkbox"
          checked={p.on}
          onChange={(e) => p.onToggle(e.currentTarget.checked)}
        />
        {p.label}
      </label>
      <NumberInput
        aria-label={`${p.label}, ${p.unit}`}
        data-testid={p.testId}
        value={p.value}
        min={p.min}
        max={p.max}
        step={p.step}
        disabled={!p.on}
        onValue={p.onValue}
      />
      <span class="unit" aria-hidden="true">
        {p.unit}
      </span>
    </div>
  );
}

export function StopField() {
  const v = useStore(form);
  const info = useStore(serverInfo);
  const wrong = refusalsAt(useStore(refusals), ['/stop']);
  return (
    <fieldset class={`stop${wrong.length ? ' field-wrong' : ''}`}>
      <legend>Stop rendering when</legend>
      {v.output !== 'meter' && (
        <>
          <Rule
            on={v.useError}
            label="error is below"
            unit="%"
            value={v.errorPercent}
            min={0.01}
            max={100}
            step="any"
            testId="stop-error"
            onToggle={(useError) => change({ useError })}
            onValue={(errorPercent) => change({ errorPercent })}
          />
          <Rule
            on={v.useDenoisedError}
            label="denoised error is below"
            unit="%"
            value={v.denoisedErrorPercent}
            min={0.01}
            max={100}
            step="any"
            testId="stop-denoised-error"
            onToggle={(useDenoisedError) => change({ useDenoisedError })}
            onValue={(denoisedErrorPercent) => change({ denoisedErrorPercent })}
          />
          <Rule
            on={v.useLightNotFound}
            label="light not found is below"
            unit="%"
            value={v.lightNotFoundPercent}
            min={0.01}
            max={100}
            step="any"
            testId="stop-light-not-found"
            onToggle={(useLightNotFound) => change({ useLightNotFound })}
            onValue={(lightNotFoundPercent) => change({ lightNotFoundPercent })}
          />
        </>
      )}
      {v.output !== 'image' && (
        <Rule
          on={v.useMeterError}
          label="meter’s intervals are below"
          unit="%"
          value={v.meterErrorPercent}
          min={0.01}
          max={100}
          step="any"
          testId="stop-meter-error"
          onToggle={(useMeterError) => change({ useMeterError })}
          onValue={(meterErrorPercent) => change({ meterErrorPercent })}
        />
      )}
      <Rule
        on={v.useSamples}
        label="samples per pixel reach"
        unit=""
        value={v.samples}
        min={1}
        max={info?.limits.samples_per_pixel}
        step={1}
        testId="stop-samples"
        onToggle={(useSamples) => change({ useSamples })}
        onValue={(samples) => change({ samples })}
      />
      <Rule
        on={v.useSeconds}
        label="time reaches"
        unit="s"
        value={v.seconds}
        min={0.1}
        max={info?.limits.stop_seconds}
        step="any"
        testId="stop-seconds"
        onToggle={(useSeconds) => change({ useSeconds })}
        onValue={(seconds) => change({ seconds })}
      />
      <Rule
        on={v.useCpuSeconds}
        label="CPU time reaches"
        unit="s"
        value={v.cpuSeconds}
        min={0.1}
        max={info?.limits.stop_cpu_seconds}
        step="any"
        testId="stop-cpu-seconds"
        onToggle={(useCpuSeconds) => change({ useCpuSeconds })}
        onValue={(cpuSeconds) => change({ cpuSeconds })}
      />
      <p class="hint">
        Rendering stops at whichever comes first. Halving the error takes about four times as many
        samples.
      </p>
      <p class="wrong" role={wrong.length ? 'alert' : undefined}>
        {wrong.map((w) => w.detail).join(' ')}
      </p>
    </fieldset>
  );
}
