import type { Server } from '../api/types';
import { useStore } from '../ui/store';
import { change, form, formRequest, requestOf } from './form_model';
import { hiddenSettings } from './reused_settings';

/** Settings of a reused render that the form has no field for, and the way to drop them. */
export function ReusedNote({ info }: { info: Server | null }) {
  const v = useStore(form);
  if (!v.reused) return null;
  const hidden = hiddenSettings(requestOf(v, info?.options), formRequest(v, info?.options));
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
