import { useState } from 'preact/hooks';
import type { Experiment } from 'tessera-render';
import { digits, exact, measured, number } from '../../ui/format';
import { MathText } from '../../ui/math_text';
import { inkOf, labelOf, Mark, useWidth, type Series } from './lab_axes';
import { commandOf, curlOf, type LabForm } from './lab_model';
import { ErrorPlot, MeanPlot } from './lab_plot';

interface PlotsProps {
  series: Series[];
  shown: Series | undefined;
  unit: string;
}

/** The plot of the runs: their errors, or their means. */
export function Plots({ series, shown, unit }: PlotsProps) {
  const [box, width] = useWidth();
  const [plot, setPlot] = useState<'error' | 'mean'>('error');
  const some = series.some((s) => s.points.length > 0);
  return (
    <div class="lab-plots">
      <div class="tiny-switch" role="group" aria-label="Plotted">
        <button type="button" aria-pressed={plot === 'error'} onClick={() => setPlot('error')}>
          Error
        </button>
        <button type="button" aria-pressed={plot === 'mean'} onClick={() => setPlot('mean')}>
          Mean
        </button>
      </div>
      <div ref={box} class={`lab-plot${some ? '' : ' lab-plot-empty'}`}>
        {!some || !shown ? (
          <p class="lab-nothing">Press Run to plot the error here.</p>
        ) : plot === 'error' ? (
          <ErrorPlot series={series} shown={shown} unit={unit} width={width} />
        ) : (
          <MeanPlot series={series} shown={shown} unit={unit} width={width} />
        )}
      </div>
    </div>
  );
}

interface LegendProps {
  series: Series[];
  shown: Series | undefined;
  onShow: (id: number) => void;
}

/** The runs in the plot; the selected one is described below it. */
export function Legend({ series, shown, onShow }: LegendProps) {
  return (
    <ul class="lab-legend" aria-label="Runs in the plot">
      {series.map((s) => (
        <li key={s.id} class={inkOf(s)}>
          <button type="button" aria-pressed={s === shown} onClick={() => onShow(s.id)}>
            <svg width="14" height="14" aria-hidden="true">
              <Mark series={s} x={7} y={7} />
            </svg>
            <span>{labelOf(s)}</span>
            <span class="dim">{slopeWords(s)}</span>
          </button>
        </li>
      ))}
    </ul>
  );
}

function slopeWords({ outcome }: Series): string {
  if (outcome?.slope == null) return '';
  const theory = outcome.expected_slope;
  return `slope ${number(outcome.slope)}${theory == null ? '' : `, theory ${number(theory)}`}`;
}

const verdictWords = {
  agrees: 'Agrees with theory.',
  differs: 'Differs from theory.',
  biased: 'Biased, as expected.',
  undecided: 'Undecided.',
};

const withMinus = (text: string): string => text.replace(/(^|[^\w)])-(?=\d)/g, '$1−');

export function Verdict({ series }: { series: Series }) {
  const outcome = series.outcome!;
  return (
    <>
      <strong class={`verdict-${outcome.verdict}`}>{verdictWords[outcome.verdict]}</strong> Exact
      value <span class="mono">{number(outcome.expected, 7)}</span>.{' '}
      {withMinus(outcome.explanation)}
      {outcome.slope_interval &&
        ' The 95% interval of the slope is ' +
          `${outcome.slope_interval.map((v) => number(v)).join(' to ')}.`}
      {outcome.efficiency_by_cost != null &&
        ` Efficiency ${number(outcome.efficiency_by_cost)} by counted cost, ` +
          `${number(outcome.efficiency)} by CPU seconds.`}
    </>
  );
}

export function Table({ series }: { series: Series }) {
  return (
    <div class="lab-table" tabIndex={0} role="region" aria-label="Numbers">
      <table>
        <caption class="visually-hidden">{labelOf(series)}</caption>
        <thead>
          <tr>
            <th scope="col">n</th>
            <th scope="col">mean</th>
            <th scope="col">± std. error</th>
            <th scope="col">RMSE</th>
            <th scope="col">CPU, ms</th>
          </tr>
        </thead>
        <tbody>
          {series.points.map((p) => {
            const [mean, error] = measured(p.mean, p.standard_error);
            return (
              <tr key={p.n_asked}>
                <th scope="row">
                  {exact(p.n)}
                  {p.n !== p.n_asked && <span class="dim"> for {exact(p.n_asked)}</span>}
                </th>
                <td>{mean}</td>
                <td>{error}</td>
                <td>{digits(p.rmse, 3)}</td>
                <td>{digits(1000 * p.seconds, 2)}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

/** Description of the experiment. */
export function Lesson({ experiment }: { experiment: Experiment }) {
  return (
    <header class="bench-text">
      <h1>{experiment.title}</h1>
      <p class="lab-lead">{experiment.summary}</p>
      <dl>
        <div>
          <dt>Estimated</dt>
          <dd>
            <MathText text={experiment.estimates} />
          </dd>
        </div>
        <div>
          <dt>Formula</dt>
          <dd class="lab-formula">
            {experiment.formula.split(/;\s+/).map((part) => (
              <span key={part}>
                <MathText text={part} />
              </span>
            ))}
          </dd>
        </div>
        <div>
          <dt>What to look for</dt>
          <dd>
            <MathText text={experiment.look_for} />
          </dd>
        </div>
      </dl>
    </header>
  );
}

/** The command for the same run. */
export function Elsewhere({ experiment, form }: { experiment: Experiment; form: LabForm }) {
  return (
    <details class="lab-elsewhere">
      <summary>Run this from a terminal</summary>
      <pre tabIndex={0} aria-label="Without a server">
        {commandOf(experiment, form)}
      </pre>
      <pre tabIndex={0} aria-label="With this server">
        {curlOf(experiment, form)}
      </pre>
    </details>
  );
}
