import type { Job } from 'tessera-render';
import { filmOf } from '../../api/states';
import { bytes, count, duration, number } from '../../ui/format';

/** The lighting chosen by default: useful to know, but not a problem. */
const isChoice = (text: string): boolean => text.startsWith('No environment was given');

/** Name, value, explanation. */
type Row = [string, string, string?];

export function Statistics({ job }: { job: Job }) {
  const said = job.warnings;
  const choices = said.filter(isChoice);
  const warnings = said.filter((text) => !isChoice(text));
  const p = job.progress,
    s = job.statistics;
  const { width, height } = filmOf(job);
  const pixels = width * height;
  const perSecond =
    p?.elapsed_seconds && p.samples_per_pixel
      ? (p.samples_per_pixel.mean * pixels) / p.elapsed_seconds
      : null;
  const ofImage = (row: Row): Row[] => (pixels ? [row] : []);
  const range = p?.samples_per_pixel;
  const rows: Row[] = [
    [
      'Samples per pixel',
      range
        ? range.min === range.max
          ? count(range.mean)
          : `${count(range.mean)} (${count(range.min)}–${count(range.max)})`
        : '–',
    ],
    ...ofImage(['Samples per second', count(perSecond)]),
    ['Rays per second', count(s?.rays_per_second)],
    ['Render time', duration(p?.elapsed_seconds)],
    ['CPU time', duration(p?.cpu_seconds)],
    ...ofImage([
      'Efficiency',
      s?.efficiency_low != null
        ? `${number(s.efficiency)} (${number(s.efficiency_low)}–${number(s.efficiency_high)})`
        : number(s?.efficiency),
      '1 / (error² × CPU seconds), with the interval of the error',
    ]),
    ['Peak memory', s?.peak_bytes ? bytes(s.peak_bytes) : '–'],
    ['Invalid samples', count(s?.rejected_samples), 'NaN or infinite; counted as zero'],
  ];
  return (
    <section class="card" aria-labelledby="statistics-title">
      <header class="card-head">
        <h2 id="statistics-title">Statistics</h2>
      </header>
      <dl class="figures">
        {rows.map(([name, value, title]) => (
          <div key={name} title={title}>
            <dt>{name}</dt>
            <dd class="mono">{value}</dd>
          </div>
        ))}
      </dl>
      {job.film_digest && (
        <p class="hint digest" title="SHA-256 of the film: the same job gives the same bits">
          Film <code>{job.film_digest.slice(0, 16)}…</code>
        </p>
      )}
      {choices.map((text) => (
        <p key={text} class="hint">
          {text.charAt(0).toUpperCase() + text.slice(1)}
        </p>
      ))}
      {warnings.length > 0 && (
        <ul class="warnings" aria-label="Notes about this render">
          {warnings.map((text, i) => (
            <li key={i}>{text}</li>
          ))}
        </ul>
      )}
    </section>
  );
}
