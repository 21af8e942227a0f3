import { Store } from './store';

export type Route = (
  | { view: 'home' }
  | { view: 'job'; id: string }
  | { view: 'jobs' }
  | { view: 'series'; id: string }
  | { view: 'compose'; scene: string }
  | { view: 'compare'; a: string; b: string }
  | { view: 'convergence'; ids: string[] }
  | { view: 'lab'; name: string }
  | { view: 'guide'; chapter: string; section: string }
  | { view: 'settings' }
) & { query: string };

/** Addresses can be typed: a part with an invalid escape is used as it is. */
function decoded(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

function parse(whole: string): Route {
  const [hash, query = ''] = whole.split('?', 2);
  const [head = '', ...rest] = hash
    .replace(/^#\/?/, '')
    .split('/')
    .map(decoded);
  const [first = '', second = ''] = rest;
  if (head === 'jobs') return first ? { view: 'job', id: first, query } : { view: 'jobs', query };
  if (head === 'series' && first) return { view: 'series', id: first, query };
  if (head === 'compare') return { view: 'compare', a: first, b: second, query };
  if (head === 'convergence' && first)
    return { view: 'convergence', ids: first.split(',').filter(Boolean), query };
  if (head === 'compose' && first) return { view: 'compose', scene: first, query };
  if (head === 'lab') return { view: 'lab', name: first, query };
  if (head === 'guide') return { view: 'guide', chapter: first, section: second, query };
  if (head === 'settings') return { view: head, query };
  return { view: 'home', query };
}

export const route = new Store<Route>(parse(location.hash));

const placeOf = (at: Route): string => JSON.stringify({ ...at, query: '' });

window.addEventListener('hashchange', () => {
  const before = placeOf(route.get());
  const next = parse(location.hash);
  route.set(next);
  // Other views start at their top; the guide scrolls to its sections itself.
  if (placeOf(next) !== before && next.view !== 'guide') window.scrollTo(0, 0);
});

export function go(path: string): void {
  location.hash = path;
}

/** The same, replacing the current address: adds no history entry. */
export function goInstead(path: string): void {
  history.replaceState(null, '', `#${path}`);
  route.set(parse(location.hash));
}

/** A parameter in the address after the view, as in `#/jobs/ID?show=error`; empty if absent. */
export const choiceIn = (at: Route, name: string): string =>
  new URLSearchParams(at.query).get(name) ?? '';

/** Keeps a parameter in the address, so that a link restores it. It adds no history entry. */
export function keepChoice(name: string, value: string): void {
  const [hash = '', query = ''] = location.hash.split('?', 2);
  const params = new URLSearchParams(query);
  if (value) params.set(name, value);
  else params.delete(name);
  const tail = params.toString().replace(/%2C/g, ',');
  history.replaceState(null, '', `${hash || '#/'}${tail && `?${tail}`}`);
  route.set(parse(location.hash));
}

/** Removes `#key=...` from the address immediately, so that it is not bookmarked or shared. */
export function takeKey(): string | null {
  const key = /^#key=(.+)$/.exec(location.hash)?.[1];
  if (!key) return null;
  history.replaceState(null, '', location.pathname);
  route.set({ view: 'home', query: '' });
  return decoded(key);
}
