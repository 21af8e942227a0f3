import type { Server } from 'tessera-render';
import { useStore } from '../../ui/store';
import { change, form, formRequest, requestOf } from './form_model';
import { useJobMembers } from './job_members';
import { hiddenSettings } from './reused_settings';

const textOf = (value: unknown): string =>
  typeof value === 'string' ? value : JSON.stringify(value);

/** Settings of a reused render that the form has no field for, and the way to drop them. */
export function ReusedNote({ info }: { info: Server | null }) {
  const v = useStore(form);
  const members = useJobMembers(v.reused !== null);
  if (!v.reused) return null;
  const hidden = hiddenSettings(requestOf(v, info?.options), formRequest(v, info?.options)).filter(
    ([name, value]) => textOf(members.get(name)?.['x-default']) !== value,
  );
  if (!hidden.length) return null;
  return (
    <div class="reused" data-testid="reused">
      <p class="hint">
        Also kept from the earlier render:{' '}
        {hidden.map(([name, value]) => `${name.replace(/[._]/g, ' ')} ${value}`).join(', ')}.
      </p>
      <button type="button" class="quiet small" onClick={() => change({ reused: null })}>
        Drop these settings
      </button>
    </div>
  );
}
