import type { Job } from 'tessera-render';
import { serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { linesOf, requestFor } from '../submit/request_texts';

/** Settings that do not affect the image. */
const besides = /^(name|labels|priority|retention_seconds)\b/;

/** Settings in which two jobs differ: name, A, B; null: left at the default. */
export function settingsApart(
  a: Record<string, unknown>,
  b: Record<string, unknown>,
): [string, string | null, string | null][] {
  const left = new Map(linesOf(a));
  const right = new Map(linesOf(b));
  return [...new Set([...left.keys(), ...right.keys()])]
    .filter((name) => !besides.test(name) && left.get(name) !== right.get(name))
    .map((name) => [name, left.get(name) ?? null, right.get(name) ?? null]);
}

export function CompareSettings({ a, b }: { a: Job; b: Job }) {
  const info = useStore(serverInfo);
  const rows = settingsApart(requestFor(a, info), requestFor(b, info));
  return (
    <section class="compare-settings" data-testid="compare-settings">
      <h2>Different settings</h2>
      {rows.length === 0 ? (
        <p class="dim">A and B have the same settings.</p>
      ) : (
        <table>
          <thead>
            <tr>
              <th scope="col">Setting</th>
              <th scope="col">A</th>
              <th scope="col">B</th>
            </tr>
          </thead>
          <tbody>
            {rows.map(([name, left, right]) => (
              <tr key={name}>
                <th scope="row">{name.replace(/[._]/g, ' ')}</th>
                <td class="mono">{left ?? <span class="dim">default</span>}</td>
                <td class="mono">{right ?? <span class="dim">default</span>}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}
