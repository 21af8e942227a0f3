import { render } from 'preact';
import { api, explainKey, RequestError } from './api/client';
import './style/main.css';
import { hasGraphicsProcessor } from './live/painter';
import { takeKey } from './ui/router';
import { refresh, say } from './ui/server_state';
import { followTheme } from './ui/theme';
import { App } from './view/app';

async function start(): Promise<void> {
  followTheme();
  render(<App />, document.getElementById('app')!);
  // The query takes tens of milliseconds, so not in the task that opens the first image.
  setTimeout(hasGraphicsProcessor, 0);
  await useKey();
  await refresh();
  // A link with a key may also be opened in a page that is already loaded.
  window.addEventListener(
    'hashchange',
    () => void useKey().then((used) => (used ? refresh() : undefined)),
  );
}

/** Exchanges `#key=...` for a cookie; servers without keys do not have the path, and need none. */
async function useKey(): Promise<boolean> {
  const key = takeKey();
  if (!key) return false;
  await api.openSession(key).catch((error: unknown) => {
    if (!(error instanceof RequestError && error.status === 404)) say(explainKey(error), 'error');
  });
  return true;
}

void start();
