import { useEffect, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { api } from '../api/client';
import { isFinal } from '../api/states';
import { filesOfDrop } from '../api/upload';
import { Icon } from '../ui/icons';
import { Later } from '../ui/later';
import { go, route, type Route } from '../ui/router';
import {
  connection,
  jobs,
  pageSize,
  serverInfo,
  theme,
  toast,
  type Theme,
} from '../ui/server_state';
import { useStore } from '../ui/store';
import { CompareView } from './compare/compare_view';
import { ComposeView } from './submit/compose_view';
import { ConvergenceView } from './lab/convergence_view';
import { GuideView } from './guide_view';
import { JobView } from './job/job_view';
import { JobsPage } from './jobs/jobs_page';
import { LabView } from './lab/lab_view';
import { models, take } from './submit/scene_source';
import { SeriesView } from './series/series_view';
import { KeyForm, SettingsPage } from './settings_page';
import { SubmitForm } from './submit/submit_form';

const nextTheme: Record<Theme, Theme> = { auto: 'dark', dark: 'light', light: 'auto' };
const themeNames: Record<Theme, string> = { auto: 'system', dark: 'dark', light: 'light' };

/** Views without the form. */
const isBare = (view: Route['view']): boolean =>
  ['settings', 'lab', 'compare', 'guide'].includes(view);

function toForm(): void {
  const form = document.getElementById('new');
  form?.scrollIntoView({ block: 'start' });
  form?.querySelector('select')?.focus({ preventScroll: true });
}

/** Opens the start page with its form, from any view. */
function toNew(): void {
  if (route.get().view === 'home') return toForm();
  window.addEventListener('hashchange', () => requestAnimationFrame(toForm), { once: true });
  go('/');
}

function TopBar({ current }: { current: Route['view'] }) {
  const link = useStore(connection);
  const info = useStore(serverInfo);
  const chosen = useStore(theme);
  const words = {
    connecting: 'Connecting…',
    online: 'Connected',
    offline: 'The server is not responding.',
    locked: 'Access key needed',
  }[link];
  const at = (view: Route['view']): 'page' | undefined => (current === view ? 'page' : undefined);
  return (
    <header class="top-bar">
      <a class="brand" href="#/">
        <img src="tessera.svg" width="26" height="26" alt="" />
        Tessera
      </a>
      <nav aria-label="Main">
        <a
          href="#/"
          aria-current={at('home') ?? at('compose')}
          onClick={(e) => {
            // Opening in another tab is left to the browser.
            if (e.ctrlKey || e.metaKey || e.shiftKey) return;
            e.preventDefault();
            toNew();
          }}
        >
          New
        </a>
        <a href="#/jobs" aria-current={at('jobs') ?? at('job') ?? at('series')}>
          Renders
        </a>
        <a href="#/compare" aria-current={at('compare') ?? at('convergence')}>
          Compare
        </a>
        <a href="#/lab" aria-current={at('lab')}>
          Laboratory
        </a>
        <a href="#/guide" aria-current={at('guide')}>
          Guide
        </a>
        <a href="#/settings" aria-current={at('settings')}>
          Settings
        </a>
      </nav>
      <span
        class={`connection connection-${link}`}
        role="status"
        title={info ? `Tessera ${info.version}` : undefined}
      >
        <i aria-hidden="true" />
        <span>{words}</span>
      </span>
      <button
        type="button"
        class="icon-button"
        aria-label={`Colours: ${themeNames[chosen]}. Change.`}
        title={`Colours: ${themeNames[chosen]}`}
        onClick={() => theme.set(nextTheme[chosen])}
      >
        <Icon name={chosen === 'auto' ? 'auto' : chosen === 'dark' ? 'moon' : 'sun'} />
      </button>
    </header>
  );
}

/** The whole window accepts drops; an overlay says so during a drag. */
function DropVeil() {
  const [over, setOver] = useState(false);
  useEffect(() => {
    let depth = 0;
    const hasFiles = (e: DragEvent): boolean => e.dataTransfer?.types.includes('Files') ?? false;
    const enter = (e: DragEvent): void => {
      if (hasFiles(e)) {
        depth += 1;
        setOver(true);
      }
    };
    const leave = (): void => {
      depth = Math.max(0, depth - 1);
      if (!depth) setOver(false);
    };
    const hover = (e: DragEvent): void => {
      if (hasFiles(e)) e.preventDefault();
    };
    const drop = (e: DragEvent): void => {
      depth = 0;
      setOver(false);
      if (!e.dataTransfer || !hasFiles(e)) return;
      e.preventDefault();
      void filesOfDrop(e.dataTransfer).then(take);
    };
    const listeners: [keyof WindowEventMap, (e: never) => void][] = [
      ['dragenter', enter],
      ['dragleave', leave],
      ['dragover', hover],
      ['drop', drop],
    ];
    for (const [type, listener] of listeners)
      window.addEventListener(type, listener as EventListener);
    return () => {
      for (const [type, listener] of listeners)
        window.removeEventListener(type, listener as EventListener);
    };
  }, []);
  return over ? (
    <div class="drop-veil" aria-hidden="true">
      <p>Drop a model or an environment</p>
    </div>
  ) : null;
}

function Toast() {
  const message = useStore(toast);
  return (
    <div class="toast-place" role="status" aria-live="polite">
      {message && <p class={`toast toast-${message.kind}`}>{message.text}</p>}
    </div>
  );
}

/**
 * At `/`: the newest running job, else the newest of all. Once selected it stays until the user
 * navigates.
 */
function useHomeJob(active: boolean): string | null | undefined {
  const list = useStore(jobs);
  const [chosen, setChosen] = useState<string | null>(null);
  const pick = (all: Job[]): string | null =>
    (all.find((j) => !isFinal(j.state)) ?? all[0])?.id ?? null;
  useEffect(() => {
    if (!active || !list) return;
    // The list of all renders lacks the selected one: it was deleted.
    const deleted = list.length < pageSize && !list.some((j) => j.id === chosen);
    if (!chosen || deleted) setChosen(pick(list));
  }, [active, list, chosen]);
  useEffect(() => {
    if (!active) setChosen(null);
  }, [active]);
  return list ? (chosen ?? pick(list)) : undefined;
}

function Empty() {
  return (
    <div class="empty">
      <svg viewBox="0 0 120 68" class="empty-mosaic" aria-hidden="true">
        {Array.from({ length: 60 }, (_, i) => {
          const x = i % 10,
            y = Math.floor(i / 10);
          // Order increases to the right, as an image converges from noise.
          const noise = Math.abs(Math.sin(i * 12.9898) * 43758.5453) % 1;
          return (
            <rect
              key={i}
              class={`smalto-${Math.floor((noise * (10 - x) + 0.55 * x + y * 0.35) % 4)}`}
              x={x * 12 + 1}
              y={y * 11.4 + 1}
              width="10"
              height="9.4"
              opacity={0.25 + 0.75 * (noise * (1 - x / 10) + x / 10)}
            />
          );
        })}
      </svg>
      <h1>Nothing rendered yet</h1>
      <p>
        Pick a scene and press Render, or drop a model anywhere on this page. Watch it render, with
        a live estimate of the remaining error.
      </p>
    </div>
  );
}

function Centre({ at }: { at: Route }) {
  const link = useStore(connection);
  const home = useHomeJob(at.view === 'home');
  // Also readable without a key.
  if (at.view === 'guide') return <GuideView chapter={at.chapter} section={at.section} />;
  if (link === 'locked')
    return (
      <div class="page page-narrow">
        <h1>Access key required</h1>
        <KeyForm />
      </div>
    );
  switch (at.view) {
    case 'jobs':
      return <JobsPage />;
    case 'series':
      return <SeriesView id={at.id} />;
    case 'settings':
      return <SettingsPage />;
    case 'job':
      return <JobView jobId={at.id} />;
    case 'compose':
      return <ComposeView scene={at.scene} />;
    case 'lab':
      return <LabView name={at.name} query={at.query} />;
    case 'convergence':
      return <ConvergenceView ids={at.ids} />;
    case 'compare':
      return <CompareView a={at.a} b={at.b} />;
    default:
      if (home) return <JobView jobId={home} />;
      if (home === null) return <Empty />;
      return (
        <div class="center-note">
          <p class="pulse">
            {link === 'offline' ? 'The server is not responding.' : 'Connecting…'}
          </p>
        </div>
      );
  }
}

/** Models are named in every view. */
function useModels(): void {
  const info = useStore(serverInfo);
  useStore(models);
  useEffect(() => {
    const builtIn = info?.scenes ?? [];
    api
      .scenes()
      .then((list) => models.set(list.scenes.filter((s) => !builtIn.some((b) => b.name === s.id))))
      .catch(() => undefined);
  }, [info !== null]);
}

export function App() {
  const at = useStore(route);
  useModels();
  const bare = isBare(at.view);
  return (
    <>
      <a
        class="skip"
        href={bare ? '#main' : '#new'}
        onClick={(e) => {
          e.preventDefault();
          if (bare) document.getElementById('main')?.focus();
          else toForm();
        }}
      >
        {bare ? 'Skip to the content' : 'Skip to the form'}
      </a>
      <TopBar current={at.view} />
      <div class={`layout${bare ? ' layout-bare' : ''}`}>
        {!bare && (
          <div class="side">
            <Later>
              <SubmitForm />
            </Later>
          </div>
        )}
        <main class="centre" id="main" tabIndex={-1}>
          <Centre at={at} />
        </main>
      </div>
      <DropVeil />
      <Toast />
    </>
  );
}
