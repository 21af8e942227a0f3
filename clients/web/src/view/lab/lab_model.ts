import type { Experiment, LabOutcome, LabPoint, LabRequest } from 'tessera-render';

/** Content of an experiment's form; n is text, because lists are typed. */
export interface LabForm {
  estimator: string;
  sampler: string;
  n: string;
  replicates: number;
  seed: number;
  params: Record<string, number>;
}

export function defaultForm(e: Experiment): LabForm {
  return {
    estimator: e.estimator,
    sampler: e.sampler,
    n: e.n.join(', '),
    replicates: e.replicates,
    seed: 0,
    params: Object.fromEntries(e.params.map((p) => [p.name, p.default])),
  };
}

const wholeNumber = (text: string | null, otherwise: number): number => {
  const value = Number(text ?? NaN);
  return text !== null && text !== '' && Number.isInteger(value) ? value : otherwise;
};

/** The form described by a link; missing or invalid values are the defaults. */
export function formOfQuery(e: Experiment, query: string): LabForm {
  const form = defaultForm(e);
  const given = new URLSearchParams(query);
  const estimator = given.get('estimator');
  const sampler = given.get('sampler');
  if (estimator && e.estimators.some((each) => each.name === estimator)) form.estimator = estimator;
  if (sampler && e.samplers.includes(sampler)) form.sampler = sampler;
  const n = given.get('n');
  if (n && /^[\d, ]+$/.test(n)) form.n = n.split(/[ ,]+/).join(', ');
  form.replicates = wholeNumber(given.get('replicates'), form.replicates);
  form.seed = wholeNumber(given.get('seed'), form.seed);
  for (const p of e.params) {
    const value = Number(given.get(p.name) ?? NaN);
    if (Number.isFinite(value)) form.params[p.name] = value;
  }
  return form;
}

/** The address of this form, with only the values that differ from the defaults. */
export function linkOf(e: Experiment, form: LabForm): string {
  const standard = defaultForm(e);
  const query = new URLSearchParams();
  if (form.estimator !== standard.estimator) query.set('estimator', form.estimator);
  if (form.sampler !== standard.sampler) query.set('sampler', form.sampler);
  if (form.n !== standard.n) query.set('n', form.n.split(/[ ,]+/).filter(Boolean).join(','));
  if (form.replicates !== standard.replicates) query.set('replicates', String(form.replicates));
  if (form.seed !== standard.seed) query.set('seed', String(form.seed));
  for (const p of e.params)
    if (form.params[p.name] !== p.default) query.set(p.name, String(form.params[p.name]));
  const tail = query.toString();
  return `#/lab/${e.name}${tail ? `?${tail}` : ''}`;
}

export function requestOf(e: Experiment, form: LabForm): Required<LabRequest> {
  return {
    experiment: e.name,
    estimator: form.estimator,
    sampler: form.sampler,
    n: form.n.split(/[ ,]+/).filter(Boolean).map(Number),
    replicates: form.replicates,
    seed: form.seed,
    params: form.params,
  };
}

/** The same for the command line, without a server. */
export function commandOf(e: Experiment, form: LabForm): string {
  const standard = defaultForm(e);
  const words = ['tessera', 'lab', e.name];
  if (form.estimator !== standard.estimator) words.push('--estimator', form.estimator);
  if (form.sampler !== standard.sampler) words.push('--sampler', form.sampler);
  if (form.n !== standard.n) words.push('--n', form.n.split(/[ ,]+/).filter(Boolean).join(','));
  if (form.replicates !== standard.replicates) words.push('--replicates', String(form.replicates));
  if (form.seed !== standard.seed) words.push('--seed', String(form.seed));
  for (const p of e.params)
    if (form.params[p.name] !== p.default)
      words.push('--param', `${p.name}=${form.params[p.name]}`);
  return words.join(' ');
}

export function curlOf(e: Experiment, form: LabForm): string {
  const body = JSON.stringify(requestOf(e, form));
  return `curl -N ${location.origin}/v1/lab/runs -H 'Content-Type: application/json' -d '${body}'`;
}

/** A run as saved in files. */
export interface KeptRun {
  estimator: string;
  sampler: string;
  points: LabPoint[];
  outcome: LabOutcome | null;
}

/** All curves in one table, one line per point. */
export function csvOf(runs: KeptRun[]): string {
  const lines = runs.flatMap((run) =>
    run.points.map((p) =>
      [run.estimator, run.sampler, p.n, p.mean, p.rmse, p.standard_error, p.cost, p.seconds].join(),
    ),
  );
  return ['estimator,sampler,n,mean,rmse,standard_error,cost,seconds', ...lines, ''].join('\n');
}

/** The lines sent by the server, each with its run. */
export function linesOf(runs: KeptRun[]): string {
  return runs
    .flatMap(({ estimator, sampler, points, outcome }) =>
      [...points, ...(outcome ? [outcome] : [])].map(
        (line) => `${JSON.stringify({ estimator, sampler, ...line })}\n`,
      ),
    )
    .join('');
}

export function save(name: string, text: string, type: string): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = document.createElement('a');
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

const carried = [
  'fill',
  'stroke',
  'stroke-width',
  'stroke-dasharray',
  'opacity',
  'font-size',
  'font-family',
];

/** The drawing as a separate file: the page's styles are copied into each element. */
export function svgText(drawing: SVGSVGElement): string {
  const copy = drawing.cloneNode(true) as SVGSVGElement;
  const from = drawing.querySelectorAll<SVGElement>('*');
  copy.querySelectorAll<SVGElement>('*').forEach((element, i) => {
    const style = getComputedStyle(from[i]);
    element.removeAttribute('class');
    for (const name of carried) element.setAttribute(name, style.getPropertyValue(name));
  });
  copy.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
  // Not as an attribute: the page's policy forbids inline styles.
  copy.style.background = getComputedStyle(document.body).backgroundColor;
  return new XMLSerializer().serializeToString(copy);
}
