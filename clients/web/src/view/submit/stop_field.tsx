import { serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { NumberInput, refusalsAt } from '../field';
import { change, form, refusals } from './form_model';
import { greatestOf, rulesFor, stopRules } from './stop_rules';

function Rule({ rule }: { rule: (typeof stopRules)[number] }) {
  const v = useStore(form);
  const on = v[rule.use];
  return (
    <div class={`rule${on ? ' rule-on' : ''}`}>
      <label class="check">
        <input
          type="checkbox"
          checked={on}
          onChange={(e) => change({ [rule.use]: e.currentTarget.checked })}
        />
        {rule.label}
      </label>
      <NumberInput
        aria-label={`${rule.label}, ${rule.unit}`}
        data-testid={rule.testId}
        value={v[rule.value]}
        min={rule.min}
        max={greatestOf(rule, useStore(serverInfo))}
        step={rule.step}
        disabled={!on}
        onValue={(value) => change({ [rule.value]: value })}
      />
      <span class="unit" aria-hidden="true">
        {rule.unit}
      </span>
    </div>
  );
}

export function StopField() {
  const v = useStore(form);
  const wrong = refusalsAt(useStore(refusals), ['/stop']);
  return (
    <fieldset class={`stop${wrong.length ? ' field-wrong' : ''}`}>
      <legend>Stop rendering when</legend>
      {rulesFor(v).map((rule) => (
        <Rule key={rule.member} rule={rule} />
      ))}
      <p class="hint">
        Rendering stops at whichever comes first
        {v.useLightNotFound && '; error targets wait for the bound on light not found'}. Halving the
        error takes about four times as many samples.
      </p>
      <p class="wrong" role={wrong.length ? 'alert' : undefined}>
        {wrong.map((w) => w.detail).join(' ')}
      </p>
    </fieldset>
  );
}
