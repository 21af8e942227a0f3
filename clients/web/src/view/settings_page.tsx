import { useState } from 'preact/hooks';
import { api, explainKey } from '../api/client';
import {
  connection,
  display,
  refresh,
  say,
  serverInfo,
  theme,
  type Theme,
} from '../ui/server_state';
import { useStore } from '../ui/store';
import { limitName, limitText } from './limit_names';
import { WorkersCard } from './jobs/workers_card';

const themes: Record<Theme, string> = { auto: 'System', dark: 'Dark', light: 'Light' };

export function SettingsPage() {
  const chosen = useStore(theme);
  const shown = useStore(display);
  const info = useStore(serverInfo);
  return (
    <div class="page page-narrow">
      <h1>Settings</h1>
      <section class="card">
        <h2>Appearance</h2>
        <fieldset class="modes">
          <legend class="visually-hidden">Colours</legend>
          {(Object.keys(themes) as Theme[]).map((t) => (
            <label key={t} class={t === chosen ? 'mode mode-on' : 'mode'}>
              <input
                class="visually-hidden"
                type="radio"
                name="theme"
                checked={t === chosen}
                onChange={() => theme.set(t)}
              />
              {themes[t]}
            </label>
          ))}
        </fieldset>
        <label class="check">
          <input
            type="checkbox"
            checked={shown.showTiles}
            onChange={(e) => display.set({ ...shown, showTiles: e.currentTarget.checked })}
          />
          Highlight updated tiles
        </label>
      </section>
      <KeyForm />
      <WorkersCard />
      {info && (
        <section class="card">
          <h2>Server</h2>
          <dl class="figures">
            {[
              ['Version', info.version],
              ['Build', info.build?.id],
              ['Commit', info.build?.commit],
              ['Compiler', info.build?.compiler],
              ['Instructions', info.build?.isa],
              ['Embree', info.build?.embree],
            ]
              .filter(([, v]) => v)
              .map(([k, v]) => (
                <div key={k}>
                  <dt>{k}</dt>
                  <dd class="mono" title={v}>
                    {v!.slice(0, 16)}
                  </dd>
                </div>
              ))}
          </dl>
          <details>
            <summary>Limits</summary>
            <dl class="figures">
              {Object.entries(info.limits ?? {}).map(([k, v]) => (
                <div key={k}>
                  <dt>{limitName(k)}</dt>
                  <dd class="mono">{limitText(k, v)}</dd>
                </div>
              ))}
            </dl>
          </details>
          <p class="hint">
            <a href="docs">HTTP interface</a> · <a href="openapi.json">OpenAPI document</a>
          </p>
        </section>
      )}
    </div>
  );
}

export function KeyForm() {
  const [key, setKey] = useState('');
  const [fault, setFault] = useState('');
  const link = useStore(connection);
  const open = async (e: Event): Promise<void> => {
    e.preventDefault();
    setFault('');
    try {
      await api.openSession(key);
      setKey('');
      say('Access granted in this browser.');
    } catch (error) {
      setFault(explainKey(error));
    }
    void refresh();
  };
  return (
    <form class="card key-form" onSubmit={open}>
      <h2>Access key</h2>
      <p class="hint">
        {link === 'locked'
          ? 'This server asks for a key. It was printed when the server started.'
          : 'Only needed for servers that ask for one. ' +
            'The key is exchanged for a session cookie and is not stored in the page.'}
      </p>
      <div class="key-row">
        <label class="visually-hidden" for="key">
          Access key
        </label>
        <input
          id="key"
          type="password"
          autocomplete="current-password"
          value={key}
          aria-invalid={fault !== ''}
          aria-describedby="key-wrong"
          onInput={(e) => setKey(e.currentTarget.value)}
        />
        <button type="submit" class="quiet" disabled={!key}>
          Use
        </button>
      </div>
      <p class="wrong" id="key-wrong" role={fault ? 'alert' : undefined}>
        {fault}
      </p>
    </form>
  );
}
