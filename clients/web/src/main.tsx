import { render } from 'preact';
import { api } from './api/client';
import './style/main.css';
import { takeKey } from './ui/router';
import { refresh, sayError } from './ui/server_state';
import { followTheme } from './ui/theme';
import { App } from './view/app';

async function start(): Promise<void> {
  followTheme();
  render(<App />, document.getElementById('app')!);
  const key = takeKey();
  if (key) await api.openSession(key).catch(sayError);
  await refresh();
}

void start();
