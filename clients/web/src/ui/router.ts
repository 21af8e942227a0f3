import { Store } from './store';

export type Route =
  | { view: 'home' }
  | { view: 'job'; id: string }
  | { view: 'jobs' }
  | { view: 'compose'; scene: string }
  | { view: 'compare'; a: string; b: string }
  | { view: 'lab'; name: string; query: string }
  | { view: 'guide'; chapter: string; section: string }
  | { view: 'settings' };

function parse(whole: string): Route {
  const [hash, query = ''] = whole.split('?', 2);
  const [head = '', ...rest] = hash
    .replace(/^#\/?/, '')
    .split('/')
    .map((part) => decodeURIComponent(part));
  if (head === 'jobs') return rest[0] ? { view: 'job', id: rest[0] } : { view: 'jobs' };
  if (head === 'compare') return { view: 'compare', a: rest[0] ?? '', b: rest[1] ?? '' };
  if (head === 'compose' && rest[0]) return { view: 'compose', scene: rest[0] };
  if (head === 'lab') return { view: 'lab', name: rest[0] ?? '', query };
  if (head === 'guide') return { view: 'guide', chapter: rest[0] ?? '', section: rest[1] ?? '' };
  if (head === 'settings') return { view: head };
  return { view: 'home' };
}

export const route = new Store<Route>(parse(location.hash));

const placeOf = (at: Route): string => JSON.stringify({ ...at, query: '' });

window.addEventListener('hashchange', () => {
  const before = placeOf(route.get());
  const next = parse(location.hash);
  route.set(next);
  // Another view begins at its top; the guide goes to its sections by itself.
  if (placeOf(next) !== before && next.view !== 'guide') window.scrollTo(0, 0);
});

export function go(path: string): void {
  location.hash = path;
}

/** Takes `#key=...` out of the address at once, so that it is not bookmarked or shared. */
export function takeKey(): string | null {
  const key = /^#key=(.+)$/.exec(location.hash)?.[1];
  if (!key) return null;
  history.replaceState(null, '', location.pathname);
  route.set({ view: 'home' });
  return decodeURIComponent(key);
}
