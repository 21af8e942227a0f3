import type { ComponentChildren } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';
import type { Experiment, FieldError } from 'tessera-render';
import { explain, RequestError } from '../../api/client';
import { runExperiment } from '../../api/lab';
import { go } from '../../ui/router';
import { serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { labelOf, slots, type Series } from './lab_axes';
import { Choices } from './lab_form';
import {
  csvOf,
  defaultForm,
  formOfQuery,
  linesOf,
  linkOf,
  requestOf,
  save,
  svgText,
  type LabForm,
} from './lab_model';
import { PatternPlot } from './lab_pattern';
import { Elsewhere, Legend, Lesson, Plots, Table, Verdict } from './lab_result';

export function LabView({ name, query }: { name: string; query: string }) {
  const info = useStore(serverInfo);
  if (!info) return <div class="center-note pulse">Connecting…</div>;
  const all = info.experiments ?? [];
  const chosen = name ? all.find((e) => e.name === name) : all[0];
  return (
    <div class="lab">
      <nav class="lab-list" aria-label="Experiments">
        <h2>Laboratory</h2>
        <ol>
          {all.map((e) => (
            <li key={e.name}>
              <a href={`#/lab/${e.name}`} aria-current={e === chosen ? 'page' : undefined}>
                {e.title}
              </a>
            </li>
          ))}
        </ol>
        <label class="lab-choice">
          <span class="visually-hidden">Experiment</span>
          <select value={chosen?.name ?? ''} onChange={(e) => go(`/lab/${e.currentTarget.value}`)}>
            {all.map((e) => (
              <option key={e.name} value={e.name}>
                {e.title}
              </option>
            ))}
          </select>
        </label>
      </nav>
      {chosen ? (
        <Bench key={chosen.name} experiment={chosen} query={query} />
      ) : !all.length ? (
        <div class="center-note">
          <h1>No experiments</h1>
          <p>This server's build has no laboratory.</p>
        </div>
      ) : (
        <div class="center-note">
          <h1>There is no experiment “{name}” here</h1>
          <p>See the list for available experiments.</p>
        </div>
      )}
    </div>
  );
}

type State = 'idle' | 'running' | 'cancelled' | 'failed';

/** The runs of an experiment, one after another; earlier ones stay for comparison. */
function useRuns(experiment: Experiment) {
  const [series, setSeries] = useState<Series[]>([]);
  const [shownId, setShownId] = useState(-1);
  const [state, setState] = useState<State>('idle');
  const [wrong, setWrong] = useState<FieldError[]>([]);
  const [failure, setFailure] = useState('');
  const running = useRef<AbortController | null>(null);
  const nextId = useRef(0);
  useEffect(() => () => running.current?.abort(), []);

  const one = async (form: LabForm, signal: AbortSignal): Promise<void> => {
    const request = requestOf(experiment, form);
    const id = nextId.current++;
    const update = (part: (s: Series) => Partial<Series>): void =>
      setSeries((all) => all.map((s) => (s.id === id ? { ...s, ...part(s) } : s)));
    setSeries((all) => {
      const kept = all.filter((s) => s.outcome).slice(1 - slots);
      const slot = Array.from({ length: slots }, (_, i) => i).find(
        (i) => !kept.some((s) => s.slot === i),
      )!;
      const { estimator, sampler } = form;
      const asked = request.n.length;
      return [...kept, { id, slot, estimator, sampler, asked, points: [], outcome: null }];
    });
    setShownId(id);
    await runExperiment(
      request,
      {
        onPoint: (point) => update((s) => ({ points: [...s.points, point] })),
        onOutcome: (outcome) => update(() => ({ outcome })),
      },
      signal,
    );
  };

  const run = async (forms: LabForm[]): Promise<void> => {
    running.current?.abort();
    const abort = new AbortController();
    running.current = abort;
    setWrong([]);
    setFailure('');
    setState('running');
    if (forms.length > 1) setSeries([]);
    try {
      for (const form of forms) await one(form, abort.signal);
      setState('idle');
    } catch (error) {
      if (abort.signal.aborted) {
        if (running.current === abort) setState('cancelled');
        return;
      }
      setState('failed');
      setSeries((all) => all.filter((s) => s.points.length > 0));
      if (error instanceof RequestError && error.errors.length) setWrong(error.errors);
      else setFailure(explain(error));
    }
  };

  const shown = series.find((s) => s.id === shownId) ?? series[series.length - 1];
  return {
    series,
    shown,
    state,
    wrong,
    failure,
    run,
    show: setShownId,
    cancel: () => running.current?.abort(),
    keepShown: () => setSeries(shown ? [shown] : []),
  };
}

const estimatorsOf = (experiment: Experiment, form: LabForm): LabForm[] =>
  experiment.estimators.map((e) => ({ ...form, estimator: e.name }));

/** One experiment: its description, its form, its runs. */
function Bench({ experiment, query }: { experiment: Experiment; query: string }) {
  const [form, setForm] = useState<LabForm>(() => formOfQuery(experiment, query));
  const runs = useRuns(experiment);
  const { series, shown, state } = runs;
  const result = useRef<HTMLElement>(null);
  useEffect(() => {
    const start = formOfQuery(experiment, query);
    setForm(start);
    // A link may start its run: `run=1`, or `run=all` for all estimators.
    const wish = new URLSearchParams(query).get('run');
    if (wish === 'all') void runs.run(estimatorsOf(experiment, start));
    else if (wish) void runs.run([start]);
  }, [experiment, query]);

  const change = (part: Partial<LabForm>): void => {
    const next = { ...form, ...part };
    setForm(next);
    history.replaceState(null, '', linkOf(experiment, next));
  };
  const run = (forms: LabForm[]): void => {
    // In a single column the result is below the form.
    if (matchMedia('(max-width: 1099px)').matches)
      result.current?.scrollIntoView({ block: 'start' });
    void runs.run(forms);
  };
  const estimators = estimatorsOf(experiment, form);
  const samplers = experiment.samplers.slice(0, slots).map((sampler) => ({ ...form, sampler }));

  return (
    <article class="bench" data-testid="lab">
      <Lesson experiment={experiment} />
      <div class="bench-side">
        <form
          class="bench-form"
          onSubmit={(event) => {
            event.preventDefault();
            run([form]);
          }}
          noValidate
          aria-label="Run"
        >
          <Choices experiment={experiment} form={form} wrong={runs.wrong} onChange={change} />
          <div class="bench-buttons">
            {state === 'running' ? (
              <button key="cancel" type="button" class="quiet" onClick={runs.cancel}>
                Cancel
              </button>
            ) : (
              <button key="run" type="submit" class="primary" data-testid="lab-run">
                Run
              </button>
            )}
            <button type="button" class="quiet" onClick={() => change(defaultForm(experiment))}>
              Defaults
            </button>
          </div>
          <div class="bench-buttons">
            {estimators.length > 1 && (
              <button type="button" class="quiet" onClick={() => run(estimators)}>
                All estimators
              </button>
            )}
            {samplers.length > 1 && (
              <button type="button" class="quiet" onClick={() => run(samplers)}>
                All samplers
              </button>
            )}
          </div>
          {runs.failure && (
            <p class="wrong" role="alert">
              {runs.failure}
            </p>
          )}
          <Elsewhere experiment={experiment} form={form} />
        </form>
        {shown?.outcome && shown.outcome.pattern.length > 0 && (
          <PatternPlot
            pattern={shown.outcome.pattern}
            label={experiment.samplers.length > 1 ? shown.sampler : shown.estimator}
          />
        )}
      </div>
      <section class="bench-result" aria-label="Result" ref={result}>
        <Plots series={series} shown={shown} unit={experiment.unit} />
        {series.length > 0 && <Legend series={series} shown={shown} onShow={runs.show} />}
        <p class="lab-verdict" role="status" data-testid="lab-verdict" data-state={state}>
          {state === 'running' && <Progress series={series[series.length - 1]} />}
          {state === 'cancelled' && 'Cancelled.'}
          {state === 'idle' && shown?.outcome && <Verdict series={shown} />}
        </p>
        {shown && shown.points.length > 0 && (
          <>
            <Table series={shown} />
            <Files
              experiment={experiment}
              series={series}
              drawing={() => result.current?.querySelector<SVGSVGElement>('.lab-plot svg') ?? null}
            >
              {series.length > 1 && state !== 'running' && (
                <button type="button" class="quiet" onClick={runs.keepShown}>
                  Clear other runs
                </button>
              )}
            </Files>
          </>
        )}
      </section>
    </article>
  );
}

function Progress({ series }: { series: Series | undefined }) {
  if (!series) return null;
  return (
    <>
      Running {labelOf(series)}: {series.points.length} of {series.asked} points.
    </>
  );
}

interface FilesProps {
  experiment: Experiment;
  series: Series[];
  drawing: () => SVGSVGElement | null;
  children: ComponentChildren;
}

/** Downloads of the runs in the plot. */
function Files({ experiment, series, drawing, children }: FilesProps) {
  const runs = series.filter((s) => s.points.length > 0);
  const parts = runs.length === 1 ? [runs[0].estimator, runs[0].sampler] : [`${runs.length}-runs`];
  const name = [experiment.name, ...parts].join('-');
  const saveSvg = (): void => {
    const svg = drawing();
    if (svg) save(`${name}.svg`, svgText(svg), 'image/svg+xml');
  };
  return (
    <div class="bench-buttons">
      <button
        type="button"
        class="quiet"
        onClick={() => save(`${name}.csv`, csvOf(runs), 'text/csv')}
      >
        Save CSV
      </button>
      <button
        type="button"
        class="quiet"
        onClick={() => save(`${name}.ndjson`, linesOf(runs), 'application/x-ndjson')}
      >
        Save JSON
      </button>
      <button type="button" class="quiet" onClick={saveSvg}>
        Save SVG
      </button>
      {children}
    </div>
  );
}
