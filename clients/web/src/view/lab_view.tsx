import { useEffect, useId, useRef, useState } from 'preact/hooks';
import { explain, RequestError } from '../api/client';
import { runExperiment } from '../api/lab';
import type { Experiment, ProblemItem } from '../api/types';
import { count, number } from '../ui/format';
import { go } from '../ui/router';
import { serverInfo } from '../ui/server_state';
import { useStore } from '../ui/store';
import { NumberInput } from './field';
import { csvOf, defaultForm, formOfQuery, linkOf, requestOf, save, svgText, type LabForm } from './lab_model';
import { LabPlot, PatternPlot, type Series } from './lab_plot';

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
      ) : (
        <div class="center-note">
          <h1>There is no experiment “{name}” here</h1>
          <p>The list names those that this server has.</p>
        </div>
      )}
    </div>
  );
}

type State = 'idle' | 'running' | 'cancelled' | 'failed';

/** One experiment: what it is about, its form, its runs. */
function Bench({ experiment, query }: { experiment: Experiment; query: string }) {
  const [form, setForm] = useState<LabForm>(() => formOfQuery(experiment, query));
  const [series, setSeries] = useState<Series[]>([]);
  const [state, setState] = useState<State>('idle');
  const [wrong, setWrong] = useState<ProblemItem[]>([]);
  const [failure, setFailure] = useState('');
  const running = useRef<AbortController | null>(null);
  const nextId = useRef(0);
  const drawing = useRef<HTMLDivElement>(null);

  useEffect(() => setForm(formOfQuery(experiment, query)), [experiment, query]);
  useEffect(() => () => running.current?.abort(), []);

  const change = (part: Partial<LabForm>): void => {
    const next = { ...form, ...part };
    setForm(next);
    history.replaceState(null, '', linkOf(experiment, next));
  };

  const run = async (event: Event): Promise<void> => {
    event.preventDefault();
    running.current?.abort();
    const abort = new AbortController();
    running.current = abort;
    const id = nextId.current++;
    const label = `${form.estimator}, ${form.sampler}`;
    const update = (part: (s: Series) => Series): void =>
      setSeries((all) => all.map((s) => (s.id === id ? part(s) : s)));
    setWrong([]);
    setFailure('');
    setState('running');
    // Earlier runs stay for comparison.
    setSeries((all) => [...all.filter((s) => s.outcome).slice(-5), { id, label, points: [], outcome: null }]);
    try {
      await runExperiment(
        requestOf(experiment, form),
        {
          onPoint: (point) => update((s) => ({ ...s, points: [...s.points, point] })),
          onOutcome: (outcome) => update((s) => ({ ...s, outcome })),
        },
        abort.signal,
      );
      setState('idle');
    } catch (error) {
      if (abort.signal.aborted) {
        if (running.current === abort) setState('cancelled');
        return;
      }
      setState('failed');
      setSeries((all) => all.filter((s) => s.id !== id || s.points.length > 0));
      if (error instanceof RequestError && error.errors.length) setWrong(error.errors);
      else setFailure(explain(error));
    }
  };

  const last = series[series.length - 1];
  const fileName = `${experiment.name}-${form.estimator}-${form.sampler}`;
  const saveSvg = (): void => {
    const svg = drawing.current?.querySelector<SVGSVGElement>('.lab-plot svg');
    if (svg) save(`${fileName}.svg`, svgText(svg), 'image/svg+xml');
  };
  return (
    <article class="bench" data-testid="lab">
      <header class="bench-text">
        <h1>{experiment.title}</h1>
        <p class="lab-lead">{experiment.summary}</p>
        <dl>
          <div>
            <dt>Estimated</dt>
            <dd>{experiment.estimates}</dd>
          </div>
          <div>
            <dt>Formula</dt>
            <dd class="lab-formula">
              {experiment.formula.split(/;\s+/).map((part) => (
                <span key={part}>{part}</span>
              ))}
            </dd>
          </div>
          <div>
            <dt>What to see</dt>
            <dd>{experiment.look_for}</dd>
          </div>
        </dl>
      </header>
      <form class="bench-form" onSubmit={run} noValidate aria-label="Run">
        <Choices experiment={experiment} form={form} wrong={wrong} onChange={change} />
        <div class="bench-buttons">
          {state === 'running' ? (
            <button key="cancel" type="button" class="quiet" onClick={() => running.current?.abort()}>
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
        {failure && (
          <p class="wrong" role="alert">
            {failure}
          </p>
        )}
      </form>
      <section class="bench-result" aria-label="Result" ref={drawing}>
        <LabPlot series={series} unit={experiment.unit} />
        {series.length > 0 && <Legend series={series} />}
        <p class="lab-verdict" role="status" data-testid="lab-verdict" data-state={state}>
          {state === 'running' && `Running: ${last?.points.length ?? 0} of ${requestOf(experiment, form).n.length} points.`}
          {state === 'cancelled' && 'Cancelled.'}
          {state === 'idle' && last?.outcome && <Verdict series={last} />}
        </p>
        {last?.points.length > 0 && (
          <>
            <Table series={last} />
            <div class="bench-buttons">
              <button type="button" class="quiet" onClick={() => save(`${fileName}.csv`, csvOf(last.points), 'text/csv')}>
                Save CSV
              </button>
              <button type="button" class="quiet" onClick={saveSvg}>
                Save SVG
              </button>
              {series.length > 1 && state !== 'running' && (
                <button type="button" class="quiet" onClick={() => setSeries([last])}>
                  Forget earlier runs
                </button>
              )}
            </div>
          </>
        )}
      </section>
      {last?.outcome && last.outcome.pattern.length > 0 && (
        <PatternPlot pattern={last.outcome.pattern} label={last.label.split(', ')[1]} />
      )}
    </article>
  );
}

interface ChoicesProps {
  experiment: Experiment;
  form: LabForm;
  wrong: ProblemItem[];
  onChange: (part: Partial<LabForm>) => void;
}

function Choices({ experiment, form, wrong, onChange }: ChoicesProps) {
  const id = useId();
  const estimator = experiment.estimators.find((e) => e.name === form.estimator);
  const at = (pointer: string): string =>
    wrong
      .filter((w) => w.pointer === pointer || w.pointer.startsWith(`${pointer}/`))
      .map((w) => w.detail)
      .join(' ');
  const row = (key: string, label: string, pointer: string, hint: string, control: (attributes: object) => unknown) => (
    <div class={`field${at(pointer) ? ' field-wrong' : ''}`} key={key}>
      <label for={`${id}-${key}`}>{label}</label>
      {control({
        id: `${id}-${key}`,
        'aria-describedby': `${id}-${key}-hint`,
        'aria-invalid': at(pointer) !== '',
      }) as never}
      <p class="hint" id={`${id}-${key}-hint`}>
        {hint}
        {at(pointer) && (
          <span class="wrong" role="alert">
            {` ${at(pointer)}`}
          </span>
        )}
      </p>
    </div>
  );
  const words = (text: string): string => text.replace(/_/g, ' ');
  return (
    <>
      {row(
        'estimator',
        'Estimator',
        '/estimator',
        `${estimator?.summary ?? ''} Bias: ${estimator?.bias ?? ''}.`,
        (attributes) => (
          <select {...attributes} value={form.estimator} onChange={(e) => onChange({ estimator: e.currentTarget.value })}>
            {experiment.estimators.map((e) => (
              <option key={e.name}>{e.name}</option>
            ))}
          </select>
        ),
      )}
      {row(
        'sampler',
        'Sampler',
        '/sampler',
        experiment.samplers.length > 1 ? '' : 'The only one that this experiment takes.',
        (attributes) => (
          <select {...attributes} value={form.sampler} onChange={(e) => onChange({ sampler: e.currentTarget.value })}>
            {experiment.samplers.map((s) => (
              <option key={s}>{s}</option>
            ))}
          </select>
        ),
      )}
      {experiment.params.map((p) =>
        row(
          `param-${p.name}`,
          words(p.name),
          `/params/${p.name}`,
          `${p.summary} ${number(p.min)} to ${number(p.max)}.`,
          (attributes) => (
            <NumberInput
              {...attributes}
              value={form.params[p.name]}
              min={p.min}
              max={p.max}
              step={p.integer ? 1 : 'any'}
              onValue={(value) => onChange({ params: { ...form.params, [p.name]: value } })}
            />
          ),
        ),
      )}
      {row('n', `n, ${experiment.unit}`, '/n', 'A list; one point of the plot each.', (attributes) => (
        <input
          type="text"
          inputMode="numeric"
          autocomplete="off"
          {...attributes}
          value={form.n}
          onInput={(e) => onChange({ n: e.currentTarget.value })}
        />
      ))}
      <div class="pair">
        {row('replicates', 'Replicates', '/replicates', 'Repetitions at each n.', (attributes) => (
          <NumberInput {...attributes} value={form.replicates} min={2} step={1} onValue={(replicates) => onChange({ replicates })} />
        ))}
        {row('seed', 'Seed', '/seed', 'Same seed, same numbers.', (attributes) => (
          <NumberInput {...attributes} value={form.seed} min={0} step={1} onValue={(seed) => onChange({ seed })} />
        ))}
      </div>
    </>
  );
}

function Legend({ series }: { series: Series[] }) {
  return (
    <ul class="lab-legend" aria-label="Runs in the plot">
      {series.map((s) => (
        <li key={s.id} class={`lab-series-${s.id % 6}`}>
          <svg width="14" height="14" aria-hidden="true">
            <circle class="lab-dot" cx="7" cy="7" r="5" />
          </svg>
          {s.label}
          {s.outcome?.slope != null && (
            <span class="dim">
              slope {number(s.outcome.slope)}
              {s.outcome.expected_slope != null && ` (dashed: ${number(s.outcome.expected_slope)})`}
            </span>
          )}
        </li>
      ))}
    </ul>
  );
}

const verdictWords = {
  agrees: 'Agrees with theory.',
  differs: 'Differs from theory.',
  biased: 'Biased, as it says.',
  undecided: 'Nothing to compare with theory.',
};

function Verdict({ series }: { series: Series }) {
  const outcome = series.outcome!;
  return (
    <>
      <strong class={`verdict-${outcome.verdict}`}>{verdictWords[outcome.verdict]}</strong> Exact value{' '}
      <span class="mono">{number(outcome.expected, 7)}</span>. {outcome.explanation}
      {outcome.efficiency_by_cost != null &&
        ` Efficiency ${number(outcome.efficiency_by_cost)} by counted cost, ${number(outcome.efficiency)} by CPU seconds.`}
    </>
  );
}

function Table({ series }: { series: Series }) {
  return (
    <div class="lab-table" tabIndex={0} role="region" aria-label="Numbers">
      <table>
        <caption class="visually-hidden">{series.label}</caption>
        <thead>
          <tr>
            <th scope="col">n</th>
            <th scope="col">mean</th>
            <th scope="col">± standard error</th>
            <th scope="col">RMSE</th>
            <th scope="col">CPU</th>
          </tr>
        </thead>
        <tbody>
          {series.points.map((p) => (
            <tr key={p.n_asked}>
              <th scope="row">
                {count(p.n)}
                {p.n !== p.n_asked && <span class="dim"> for {count(p.n_asked)}</span>}
              </th>
              <td>{number(p.mean, 6)}</td>
              <td>{number(p.standard_error, 2)}</td>
              <td>{number(p.rmse)}</td>
              <td>{number(p.seconds, 2)} s</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
