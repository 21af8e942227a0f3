import { useEffect, useState } from 'preact/hooks';
import type { Server } from 'tessera-render';
import { api, resolved, type Description, type Member } from '../../api/client';
import { useStore } from '../../ui/store';
import { change, form, formRequest, requestOf } from './form_model';
import { hiddenSettings } from './reused_settings';

/** The defaults of a schema's members: "ground.color", "[0.8,0.8,0.8]". */
function defaultsOf(schema: Member, all: Description, prefix = ''): [string, string][] {
  return Object.entries(schema.properties ?? {}).flatMap(([key, member]) => {
    const part = resolved(member, all);
    return part.properties
      ? defaultsOf(part, all, `${prefix}${key}.`)
      : [[prefix + key, textOf(member['x-default'])]];
  });
}

const textOf = (value: unknown): string =>
  typeof value === 'string' ? value : JSON.stringify(value);

/** The defaults of a job request; none while they are unknown. */
function useDefaults(active: boolean): Map<string, string> {
  const [defaults, setDefaults] = useState(new Map<string, string>());
  useEffect(() => {
    if (!active) return;
    api
      .description<Description>()
      .then((d) => setDefaults(new Map(defaultsOf(d.components.schemas.JobRequest ?? {}, d))))
      .catch(() => undefined); // In that case settings with default values are listed, too.
  }, [active]);
  return defaults;
}

/** Settings of a reused render that the form has no field for, and the way to drop them. */
export function ReusedNote({ info }: { info: Server | null }) {
  const v = useStore(form);
  const defaults = useDefaults(v.reused !== null);
  if (!v.reused) return null;
  const hidden = hiddenSettings(requestOf(v, info?.options), formRequest(v, info?.options)).filter(
    ([name, value]) => defaults.get(name) !== value,
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
