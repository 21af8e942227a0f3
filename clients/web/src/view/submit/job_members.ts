import { useEffect, useState } from 'preact/hooks';
import { api, resolved, type Description, type Member } from '../../api/client';

/** The members of a schema that are no objects: "ground.color". */
function membersOf(schema: Member, all: Description, prefix = ''): [string, Member][] {
  return Object.entries(schema.properties ?? {}).flatMap(([key, member]): [string, Member][] => {
    const part = resolved(member, all);
    return part.properties
      ? membersOf(part, all, `${prefix}${key}.`)
      : [[prefix + key, { ...part, ...member }]];
  });
}

/** The members of a job request by name, as the server describes them; none while unknown. */
export function useJobMembers(active: boolean): Map<string, Member> {
  const [members, setMembers] = useState(new Map<string, Member>());
  useEffect(() => {
    if (!active) return;
    api
      .description<Description>()
      .then((d) => setMembers(new Map(membersOf(d.components.schemas.JobRequest ?? {}, d))))
      .catch(() => undefined); // The form works without it.
  }, [active]);
  return members;
}
