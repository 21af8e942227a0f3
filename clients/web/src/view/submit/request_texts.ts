import type { Job, Server } from 'tessera-render';

export type Members = Record<string, unknown>;

export const isMembers = (value: unknown): value is Members =>
  typeof value === 'object' && value !== null && !Array.isArray(value);

export const same = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

/** RFC 7396. */
function merged(target: unknown, patch: unknown): unknown {
  if (!isMembers(patch)) return patch;
  const out: Members = isMembers(target) ? { ...target } : {};
  for (const [key, value] of Object.entries(patch))
    if (value === null) delete out[key];
    else out[key] = merged(out[key], value);
  return out;
}

/** Members of `value` that differ from `usual`. */
function difference(value: Members, usual: Members): Members {
  const out: Members = {};
  for (const [key, own] of Object.entries(value)) {
    const other = usual[key];
    if (same(own, other)) continue;
    const inner = isMembers(own) && isMembers(other) ? difference(own, other) : own;
    if (!isMembers(inner) || Object.keys(inner).length || !isMembers(other)) out[key] = inner;
  }
  return out;
}

/** Whether the merge patch `part` leaves `value` unchanged. null removes a member. */
export const holds = (value: unknown, part: unknown): boolean =>
  part === null
    ? (value ?? null) === null
    : isMembers(part)
      ? isMembers(value) && Object.entries(part).every(([key, own]) => holds(value[key], own))
      : same(value, part);

/** Effective defaults for the job's integrator. */
export function usualSettings(job: Job, info: Server | null): Members {
  const row = info?.integrators.find((i) => i.type === job.spec.integrator.type);
  return merged(info?.defaults ?? {}, row?.defaults ?? {}) as Members;
}

/**
 * The request that creates the same job: members that differ from the server's defaults, and those
 * whose defaults depend on the rest of the request.
 */
export function requestFor(job: Job, info: Server | null): Members {
  const spec = job.spec as unknown as Members;
  const out = difference(spec, usualSettings(job, info));
  // Given rules replace all default ones, and an error target enables adaptive sampling.
  out.stop = Object.fromEntries(
    Object.entries(job.spec.stop).filter(([, value]) => value !== null),
  );
  out.adaptive = { ...(out.adaptive as Members | undefined), type: job.spec.adaptive.type };
  for (const key of ['webhook', 'preview_key', 'class']) delete out[key];
  if (!out.name) delete out.name;
  return { scene: spec.scene, ...out };
}

/** A line for each number and word of a request: "film.width", "512". */
export function linesOf(request: Members, prefix = ''): [string, string][] {
  return Object.entries(request).flatMap(([key, value]): [string, string][] =>
    isMembers(value)
      ? linesOf(value, `${prefix}${key}.`)
      : [[prefix + key, typeof value === 'string' ? value : JSON.stringify(value)]],
  );
}

const quoted = (text: string): string => `'${text.replace(/'/g, "'\\''")}'`;

/** In Python syntax. */
function python(value: unknown, indent = ''): string {
  if (value === null) return 'None';
  if (typeof value === 'boolean') return value ? 'True' : 'False';
  const inner = `${indent}    `;
  if (Array.isArray(value)) return `[${value.map((v) => python(v, inner)).join(', ')}]`;
  if (!isMembers(value)) return JSON.stringify(value);
  const members = Object.entries(value).map(
    ([key, own]) => `${inner}${JSON.stringify(key)}: ${python(own, inner)},\n`,
  );
  return members.length ? `{\n${members.join('')}${indent}}` : '{}';
}

export type TextKind = 'json' | 'curl' | 'command' | 'python';
export const textKinds: Record<TextKind, string> = {
  json: 'JSON',
  curl: 'curl',
  command: 'Command line',
  python: 'Python',
};

/** The same job for other clients. server: its address. */
export function textOf(kind: TextKind, request: Members, server: string): string {
  const json = JSON.stringify(request, null, 2);
  if (kind === 'json') return json;
  if (kind === 'curl')
    return `curl ${server}/v1/jobs -H 'Content-Type: application/json' -d ${quoted(json)}`;
  if (kind === 'command')
    return `tessera submit --server ${server} --job /dev/stdin <<'END'\n${json}\nEND`;
  const { scene, ...rest } = request;
  return [
    'from tessera_render import Client',
    '',
    `with Client(${JSON.stringify(server)}) as client:`,
    `    job = client.submit(${JSON.stringify(scene)}, request=${python(rest, '    ')})`,
    '    job.wait()',
  ].join('\n');
}
