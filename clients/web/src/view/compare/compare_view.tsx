import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import type { Comparison, Job } from 'tessera-render';
import { api, relative } from '../../api/client';
import { filmOf, isAvailable, isFinal } from '../../api/states';
import { compareFilms, type Figures, type Measure } from '../../live/comparison';
import { LiveFilm } from '../../live/film';
import type { FeedState } from '../../live/job_feed';
import { Picture, type Plane } from '../../live/picture';
import type { Look } from '../../live/painter';
import { counted, number, percent } from '../../ui/format';
import { Later } from '../../ui/later';
import { choiceIn, go, keepChoice, route } from '../../ui/router';
import { display, jobs } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { CompareSettings } from './compare_settings';
import { useFeed } from '../job/job_view';
import { absence, sceneTitle } from '../jobs/job_words';
import { sameSize, sizeText, JobPick } from '../jobs/job_pick';
import { FlipLegend, Legend } from '../job/legend';
import { MeterCompare } from './meter_compare';
import { LightControls } from '../job/toolbar';
import { errorRange, lookOf } from '../job/view_modes';

type View = 'wipe' | Measure | 'flip';
const views: { view: View; label: string; meaning: string }[] = [
  { view: 'wipe', label: 'Slider', meaning: 'Drag the line across the two images.' },
  {
    view: 'difference',
    label: 'Difference',
    meaning: 'Difference between the two, relative to the brightness of B.',
  },
  {
    view: 'z',
    label: 'Significance (z)',
    meaning: 'Difference in standard errors. Above 3, noise alone is an unlikely explanation.',
  },
  {
    view: 'flip',
    label: 'FLIP',
    meaning:
      'FLIP: the difference a viewer would notice when flipping between the two. ' +
      'Black: none; pale yellow: largest.',
  },
];
const zRange = { low: 0.3, high: 10 };

function FilmCanvas({
  film,
  plane,
  look,
  label,
  style,
}: {
  film: LiveFilm;
  plane: Plane | 'value';
  look: Look;
  label: string;
  style?: Record<string, string>;
}) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const picture = useRef<Picture | null>(null);
  // In a film computed from two others, the value to show is stored in place of tile errors.
  const shown = plane === 'value' ? 'tile-error' : plane;
  useLayoutEffect(() => {
    picture.current = new Picture(canvas.current!, film, look);
    return () => picture.current?.dispose();
  }, [film]);
  useEffect(
    () => picture.current?.show(shown, look),
    [film, shown, look.exposure, look.tone, look.low, look.high],
  );
  return (
    <canvas ref={canvas} class="compare-canvas" role="img" aria-label={label} style={style ?? {}} />
  );
}

interface Difference {
  measure: Measure;
  film: LiveFilm;
  figures: Figures;
}

/**
 * Difference film and statistics of two jobs, updated while either still renders; measure null: not
 * needed.
 */
function useDifference(a: FeedState, b: FeedState, measure: Measure | null): Difference | null {
  const [result, setResult] = useState<Difference | null>(null);
  const running =
    (a.job && !isFinal(a.job.state)) || (b.job && !isFinal(b.job.state)) ? true : false;
  const ready = (a.film?.tilesSeen ?? 0) > 0 && (b.film?.tilesSeen ?? 0) > 0;
  useEffect(() => {
    const { film: left } = a;
    const { film: right } = b;
    if (!measure || !left || !right) return;
    if (left.width !== right.width || left.height !== right.height) return;
    const abort = new AbortController();
    let seen = -1;
    let timer = 0;
    const work = async (): Promise<void> => {
      const version = left.version + right.version;
      if (version !== seen && left.tilesSeen > 0 && right.tilesSeen > 0) {
        seen = version;
        setResult({ measure, ...(await compareFilms(left, right, measure, abort.signal)) });
      }
      timer = window.setTimeout(() => void work().catch(() => undefined), 1500);
    };
    void work().catch(() => undefined);
    return () => {
      abort.abort();
      clearTimeout(timer);
    };
  }, [a.film, b.film, measure, running, ready]);
  return result;
}

interface Asked {
  found: Comparison | null;
  trouble: string;
  /** The server is computing it. */
  pending: boolean;
}

/** The server's numbers for two ended jobs; requested again if one of them is continued. */
function useComparison(a: Job | null, b: Job | null): Asked {
  const both = a?.spec.film && b?.spec.film;
  const ready = Boolean(both && isFinal(a.state) && isFinal(b.state));
  const nothing = { found: null, trouble: '', pending: ready };
  const [asked, setAsked] = useState<Asked>(nothing);
  useEffect(() => {
    let current = true;
    setAsked(nothing);
    if (a && b && ready)
      api
        .compare(a.id, b.id)
        .then((found) => current && setAsked({ found, trouble: '', pending: false }))
        .catch(
          (e: Error) => current && setAsked({ found: null, trouble: e.message, pending: false }),
        );
    return () => {
      current = false;
    };
  }, [a?.id, b?.id, a?.revision, b?.revision, ready]);
  return asked;
}

/** Labels of the sides, each over its part of the image. */
function SideNote({ job, name, cut }: { job: Job | null; name: 'A' | 'B'; cut?: number }) {
  const samples = job?.progress?.samples_per_pixel?.mean;
  const error = job?.error?.relative;
  return (
    <div
      class={`side-note side-note-${name.toLowerCase()}`}
      style={cut === undefined ? {} : { clipPath: `inset(0 ${100 - cut}% 0 0)` }}
    >
      <span>
        <b>{name}</b>
        {samples != null && ` ${counted(samples, 'sample')}`}
        {error != null && `, ${percent(error)}`}
      </span>
    </div>
  );
}

/** The requested jobs; else the newest two of the same size, else the newest two. */
function pairOf(list: Job[], a: string, b: string): [string | undefined, string | undefined] {
  const there = list.filter((j) => isAvailable(j, 'image'));
  const partner = (job: Job | undefined): Job | undefined =>
    there.find((j) => job && j.id !== job.id && sameSize(j, job));
  const first = a ? list.find((j) => j.id === a) : (there.find(partner) ?? there[0]);
  const id = a || first?.id;
  return [id, b || (partner(first) ?? there.find((j) => j.id !== id))?.id];
}

export function CompareView({ a, b }: { a: string; b: string }) {
  return a && b ? <Comparing a={a} b={b} /> : <Choosing a={a} b={b} />;
}

/** Nothing is compared until two renders are chosen. */
function Choosing({ a, b }: { a: string; b: string }) {
  const list = useStore(jobs);
  const job = (id: string): Job | null => list?.find((j) => j.id === id) ?? null;
  const [first, second] = pairOf(list ?? [], a, b).map((id) => job(id ?? ''));
  const open = (left: string, right: string): void =>
    go(left && right ? `/compare/${left}/${right}` : `/compare/${left || right}`);
  return (
    <div class="compare">
      <header class="page-head compare-head">
        <h1>Compare</h1>
        <JobPick label="A" id={a} job={job(a)} beside={job(b)} onValue={(id) => open(id, b)} />
        <JobPick label="B" id={b} job={job(b)} beside={job(a)} onValue={(id) => open(a, id)} />
      </header>
      <div class="center-note">
        {first && second ? (
          <>
            <p>{a ? 'Choose the render that it is compared with.' : 'Choose two renders.'}</p>
            <button
              type="button"
              class="primary"
              data-testid="compare-newest"
              onClick={() => open(first.id, second.id)}
            >
              Compare {sceneTitle(first)} with {sceneTitle(second)}
            </button>
          </>
        ) : (
          <p>{list ? 'You need two renders to compare.' : 'Loading…'}</p>
        )}
      </div>
    </div>
  );
}

function Comparing({ a, b }: { a: string; b: string }) {
  const left = useFeed(a, 'all').state;
  const right = useFeed(b, 'all').state;
  const asked = choiceIn(useStore(route), 'show');
  const view = views.find((v) => v.view === asked)?.view ?? 'wipe';
  const tail = view === 'wipe' ? '' : `?show=${view}`;
  const [cut, setCut] = useState(50);
  const shown = useStore(display);
  const { found: server, trouble, pending } = useComparison(left.job, right.job);
  const measure = view === 'difference' || view === 'z' ? view : null;
  // The server has better statistics than the page, but only for ended jobs.
  const figuresOnly = server || pending ? null : 'difference';
  const difference = useDifference(left, right, measure ?? figuresOnly);
  const size = left.job && filmOf(left.job);
  const other = right.job && filmOf(right.job);
  const hasImages = Boolean(size?.width && other?.width);
  const fits =
    hasImages && size && other && size.width === other.width && size.height === other.height;
  const colour = lookOf('picture', shown, { variance: zRange, samples: zRange });
  const heat: Look = {
    ...colour,
    kind: 'scalar',
    ...(view === 'z' ? zRange : errorRange),
  };
  const meaning = views.find((v) => v.view === view)!.meaning;
  return (
    <div class="compare">
      <header class="page-head compare-head">
        <h1>Compare</h1>
        <JobPick
          label="A"
          id={a}
          job={left.job}
          beside={right.job}
          onValue={(id) => go(`/compare/${id}/${b}${tail}`)}
        />
        <JobPick
          label="B"
          id={b}
          job={right.job}
          beside={left.job}
          onValue={(id) => go(`/compare/${a}/${id}${tail}`)}
        />
        {left.job && right.job && (
          <a class="quiet" href={`#/convergence/${left.job.id},${right.job.id}`}>
            Plot errors
          </a>
        )}
      </header>
      <Missing left={left} right={right} />
      <MeterCompare a={left.job} b={right.job} />
      {size && other && hasImages && !fits && (
        <p class="compare-note" role="alert">
          A is {sizeText(left.job!)} pixels, B {sizeText(right.job!)}. Renders of different sizes
          cannot be laid over each other; choose another.
        </p>
      )}
      {size && other && !fits && <CompareSettings a={left.job!} b={right.job!} />}
      {size && fits && left.film && right.film && (
        <>
          <div class="compare-stage">
            <div
              class="compare-film"
              style={{
                aspectRatio: `${size.width} / ${size.height}`,
                '--ratio': String(size.width / size.height),
              }}
            >
              {view === 'wipe' ? (
                <>
                  <FilmCanvas key="b" film={right.film} plane="picture" look={colour} label="B" />
                  <FilmCanvas
                    key="a"
                    film={left.film}
                    plane="picture"
                    look={colour}
                    label="A"
                    style={{ clipPath: `inset(0 ${100 - cut}% 0 0)` }}
                  />
                  <SideNote job={right.job} name="B" />
                  <SideNote job={left.job} name="A" cut={cut} />
                  <i class="wipe-line" style={{ left: `${cut}%` }} aria-hidden="true" />
                  <input
                    class="wipe"
                    type="range"
                    min={0}
                    max={100}
                    step={0.5}
                    value={cut}
                    aria-label="Position of the line between A and B"
                    data-testid="wipe"
                    onInput={(e) => setCut(e.currentTarget.valueAsNumber)}
                  />
                </>
              ) : view === 'flip' ? (
                server ? (
                  <img
                    class="compare-canvas"
                    data-testid="flip-map"
                    src={relative(server.links.flip)}
                    alt={meaning}
                  />
                ) : (
                  <p class={trouble ? 'stage-notice' : 'stage-notice pulse'} role="status">
                    {trouble || 'The server compares two renders when both have ended…'}
                  </p>
                )
              ) : difference?.measure === view ? (
                <FilmCanvas
                  key={view}
                  film={difference.film}
                  plane="value"
                  look={heat}
                  label={meaning}
                />
              ) : (
                <p class="stage-notice pulse">Calculating…</p>
              )}
            </div>
            {view === 'flip' && server && <FlipLegend meaning={meaning} />}
            {difference?.measure === view && (
              <Legend look={heat} meaning={meaning} unit={view === 'z' ? 'number' : 'percent'} />
            )}
          </div>
          <Later>
            <div class="toolbar">
              <fieldset class="modes">
                <legend class="visually-hidden">View</legend>
                {views.map((v) => (
                  <label key={v.view} class={v.view === view ? 'mode mode-on' : 'mode'}>
                    <input
                      class="visually-hidden"
                      type="radio"
                      name="compare"
                      data-testid={`compare-${v.view}`}
                      checked={v.view === view}
                      onChange={() => keepChoice('show', v.view === 'wipe' ? '' : v.view)}
                    />
                    {v.label}
                  </label>
                ))}
              </fieldset>
              <LightControls film={left.film} disabled={view !== 'wipe'} />
            </div>
            {trouble && (
              <p class="compare-note" role="alert">
                The server did not compare them: {trouble} The figures below were calculated by this
                page.
              </p>
            )}
            <CompareSettings a={left.job!} b={right.job!} />
            <Numbers server={server} own={difference?.figures ?? null} />
          </Later>
        </>
      )}
    </div>
  );
}

/** Names the side that does not exist, and why; a side that exists is shown as waiting. */
function Missing({ left, right }: { left: FeedState; right: FeedState }) {
  const sides = [
    { name: 'A', missing: absence(left) },
    { name: 'B', missing: absence(right) },
  ].filter((side) => side.missing);
  if (!sides.length) return null;
  return (
    <div class="center-note" role="alert">
      {sides.map(({ name, missing }) => (
        <p key={name} data-testid={`missing-${name.toLowerCase()}`}>
          <b>{name}:</b> {missing!.title} {missing!.why}
        </p>
      ))}
      <p>Choose another one above.</p>
    </div>
  );
}

const deviation = (variance: number | null): number | null =>
  variance === null ? null : Math.sqrt(variance);

function Numbers({ server, own }: { server: Comparison | null; own: Figures | null }) {
  const rows: [string, string, string][] = server
    ? [
        ['relMSE', number(server.relmse), 'mean of (A - B)² / (B² + 0.01)'],
        ['MSE', number(server.mse), 'mean of (A - B)²'],
        ['FLIP', number(server.flip), 'to the eye: 0 black, 1 yellow'],
        [
          'Bias of A',
          number(server.bias.value),
          server.bias.low === null || server.bias.high === null
            ? 'mean of A - B; its interval is not known'
            : `95%: ${number(server.bias.low)} to ${number(server.bias.high)}`,
        ],
        [
          'z of a pixel',
          `${number(server.z.mean)} ± ${number(deviation(server.z.variance))}`,
          'chance alone gives 0 ± 1',
        ],
        ['Pixels beyond 3 σ', percent(server.z.share_above_3), 'chance alone gives 0.27%'],
      ]
    : own
      ? [
          ['relMSE', number(own.relmse), 'mean of (A - B)² / (B² + 0.01)'],
          ['MSE', number(own.mse), 'mean of (A - B)²'],
          ['Bias of A', number(own.bias), 'mean of A - B'],
          ['Places beyond 3 σ', percent(own.shareAbove3), '5 x 5 pixels each'],
        ]
      : [];
  return (
    <dl class="compare-numbers" data-testid="compare-numbers">
      {rows.map(([name, value, note]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
          <dd class="hint">{note}</dd>
        </div>
      ))}
    </dl>
  );
}
