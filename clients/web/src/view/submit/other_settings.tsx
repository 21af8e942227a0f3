import type { Server } from 'tessera-render';
import { useStore } from '../../ui/store';
import { Field } from '../field';
import { change, form, formRequest } from './form_model';
import { useJobMembers } from './job_members';
import { linesOf } from './request_texts';

/** Members of the job request that the form has no field for, from the server's description. */
export function OtherSettings({ info }: { info: Server | null }) {
  const v = useStore(form);
  const members = useJobMembers(true);
  const set = (name: string, text: string): void =>
    change({ others: { ...form.get().others, [name]: text } });
  const shown = new Set(linesOf(formRequest(v, info?.options)).map(([name]) => name));
  const free = [...members.keys()].filter((name) => !shown.has(name) && !(name in v.others));
  return (
    <div data-testid="other-settings">
      {Object.entries(v.others).map(([name, text]) => (
        <Field
          key={name}
          label={name}
          pointers={[`/${name.replace(/\./g, '/')}`]}
          hint={members.get(name)?.description}
        >
          {(a) => <input {...a} value={text} onInput={(e) => set(name, e.currentTarget.value)} />}
        </Field>
      ))}
      <Field label="Other setting" hint="Any other member of the job request.">
        {(a) => (
          <select {...a} value="" onChange={(e) => set(e.currentTarget.value, '')}>
            <option value="">Add…</option>
            {free.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        )}
      </Field>
    </div>
  );
}
