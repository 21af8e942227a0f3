import type { ConvergencePoint, Job } from 'tessera-render';
import { rampCss } from '../../live/heat';
import { counted, errorInWords, number, percent } from '../../ui/format';
import { serverInfo } from '../../ui/server_state';
import { biasOf, isNoiseAlone, passesOf, radiusShare, type Bias } from './bias';
import type { DenoisedError } from './denoised_image';
import { LightNotFound } from './light_not_found';
import { SetAside } from './set_aside';
import { errorRange } from './view_modes';

/** An error is outdated if the image has this many times its samples. */
const staleFrom = 1.25;

/** An interval whose ends are this many times apart is called uncertain. */
const wideFrom = 100;

/**
 * The number of samples at which the error was estimated, if the image has clearly more now;
 * otherwise null.
 */
function samplesThen(job: Job, points: ConvergencePoint[]): number | null {
  const now = job.progress?.samples_per_pixel?.mean;
  const last = points[points.length - 1];
  const value = job.error?.relative;
  if (!now || !last?.relative || value == null) return null;
  // The curve is requested occasionally: the error may be newer than its end.
  const same = Math.abs(value / last.relative - 1) < 1e-6;
  return same && now > staleFrom * last.samples_per_pixel ? last.samples_per_pixel : null;
}

/**
 * The error of the image on a logarithmic scale, from noise (left) to clean (right). The colours
 * are those of the error view. Faint marks are earlier estimates; the bar is the interval.
 */
export function ErrorRuler({
  job: plain,
  points,
  denoised = null,
}: {
  job: Job;
  points: ConvergencePoint[];
  /** Error of the denoised image, if that is shown. */
  denoised?: DenoisedError | null;
}) {
  const job = denoised ? shownAs(plain, denoised) : plain;
  const { error } = job;
  const value = error?.relative;
  const then = denoised ? null : samplesThen(job, points);
  const confidence = Math.round(100 * (error?.confidence ?? 0.95));
  const bias = biasOf(job);
  const unknownLabel = denoised ? 'Error of the denoised image' : 'Error';
  const isNoise = isNoiseAlone(job);
  const notes: { text: string; id: string }[] = [];
  if (value != null && error?.low != null && error.high != null)
    notes.push({
      id: 'interval',
      // Ends so far apart say nothing but this.
      text:
        error.high > wideFrom * error.low && error.low > 0
          ? '(uncertain)'
          : `(${percent(error.low)} to ${percent(error.high)} with ${confidence}% confidence)`,
    });
  if (denoised && value != null) notes.push({ id: 'denoised', text: 'denoised' });
  if (then != null) notes.push({ id: 'age', text: `at ${counted(then, 'sample')}` });
  if (denoised)
    notes.push({ id: 'plain', text: `${percent(plain.error?.relative)} without denoising` });
  return (
    <section class="ruler" aria-label="Error of the image">
      <div class="ruler-head">
        <p class="ruler-value" data-testid="error">
          <span class="ruler-label">
            {value == null ? unknownLabel : isNoise ? 'Noise' : 'The average pixel is'}
          </span>{' '}
          <strong class={value == null ? 'ruler-unknown' : undefined}>
            {value != null && denoised && isOpen(denoised) && 'below '}
            {value != null ? percent(value) : 'not known'}
          </strong>
          {value != null && !isNoise && ' off'}
          {notes.map(({ id, text }, i) => (
            <span
              key={id}
              class="ruler-interval"
              data-testid={`error-${id}`}
              title={id === 'denoised' ? denoised?.denoiser : undefined}
            >
              {id === 'interval' || (i === 0 && value != null) ? ' ' : ', '}
              {text}
            </span>
          ))}
        </p>
        {!isNoise && <p class="ruler-words">{wordsFor(job, denoised != null)}</p>}
      </div>
      {bias !== 'none' && <BiasNote job={job} bias={bias} />}
      <Track job={job} points={points} />
      <SetAside job={plain} />
      <LightNotFound job={plain} />
    </section>
  );
}

/** The error cannot be distinguished from 0 yet: only its upper end is meaningful. */
const isOpen = (denoised: DenoisedError): boolean => denoised.low === 0 && denoised.high !== null;

/** The job with the error of the displayed image in place of the plain one's. */
function shownAs(job: Job, denoised: DenoisedError): Job {
  const { low, high } = denoised;
  // An upper end above the plain image's error tells nothing about the denoised one.
  const tells = high !== null && high < (job.error?.relative ?? 1);
  const value = isOpen(denoised) ? (tells ? high : null) : denoised.value;
  return { ...job, error: { ...job.error, relative: value, low, high } } as Job;
}

/** Whether only the choice of the sample count makes the job's image consistent. */
const isOwnStop = (job: Job): boolean => {
  const row = serverInfo.get()?.integrators.find((i) => i.type === job.spec.integrator.type);
  return row?.bias === 'none' && /_error$|^light_not_found$/.test(job.stop_reason ?? '');
};

/** Whether the error includes the bias; for progressive photon mapping also how fast that falls. */
function BiasNote({ job, bias }: { job: Job; bias: Exclude<Bias, 'none'> }) {
  const { alpha } = job.spec.integrator;
  const share = radiusShare(job);
  if (bias === 'consistent' && isOwnStop(job))
    return (
      <p class="ruler-bias" data-testid="bias">
        Because the job stopped on its own error, a tiny bias remains that vanishes with more
        samples.
      </p>
    );
  return (
    <p class="ruler-bias" data-testid="bias">
      {bias === 'biased' ? 'This method is biased' : 'This method is consistent'}
      {isNoiseAlone(job)
        ? ': its systematic error is not included in the noise'
        : ': its systematic error is included'}
      {bias === 'biased'
        ? ', and more samples do not remove it.'
        : ', and vanishes as samples are added.'}
      {bias === 'consistent' && alpha !== undefined && (
        <>
          {' '}
          Its square falls as N<sup>{number(2 * alpha - 2, 2)}</sup>, the variance as N
          <sup>{number(-alpha, 2)}</sup>.
        </>
      )}
      {share !== null && (
        <>
          {' '}
          After {counted(passesOf(job), 'sample')} of each replicate, photons are gathered
          within {percent(share)} of the first radius.
        </>
      )}
    </p>
  );
}

/** A denoised image has no visible grain. */
function wordsFor({ error }: Job, isDenoised: boolean): string {
  if (error?.unreliable)
    return (
      'A few very bright pixels decide this number. Most of the image is cleaner; denoise it, or ' +
      'take more samples.'
    );
  return isDenoised ? '' : errorInWords(error?.relative);
}

function Track({ job, points }: { job: Job; points: ConvergencePoint[] }) {
  const { error } = job;
  const value = error?.relative;
  const target = job.spec.stop?.relative_error;
  const range = rangeFor(job, target ?? null);
  const place = (v: number): number =>
    (100 * Math.log(range.high / v)) / Math.log(range.high / range.low);
  const at = (v: number): number => Math.min(100, Math.max(0, place(v)));
  // The colours match those of the error view for any range.
  const [clean, noisy] = [100 - place(errorRange.low), 100 - place(errorRange.high)];
  const bar =
    value != null && error?.low != null && error.high != null
      ? { left: `${at(error.high)}%`, right: `${100 - at(error.low)}%` }
      : null;
  return (
    <>
      <div class={`ruler-track${target ? ' ruler-aims' : ''}`} aria-hidden="true">
        <div
          class="ruler-scale"
          style={{ backgroundImage: rampCss('error', 'to left', clean, noisy) }}
        />
        {value != null && <div class="ruler-todo" style={{ left: `${at(value)}%` }} />}
        {ghosts(points).map((v, i) => (
          <i key={i} class="ruler-ghost" style={{ left: `${at(v)}%` }} />
        ))}
        {target && (
          <i class="ruler-target" style={{ left: `${at(target)}%` }}>
            <b>target {percent(target)}</b>
          </i>
        )}
        {bar && <div class="ruler-bar" style={bar} />}
        {value != null && <div class="ruler-now" style={{ left: `${at(value)}%` }} />}
      </div>
      <div class="ruler-ticks" aria-hidden="true">
        {ticksOf(range).map((v) => (
          <span key={v} style={{ left: `${at(v)}%` }}>
            {v >= 0.1 ? `${100 * v}%` : `${Number((100 * v).toPrecision(1))}%`}
          </span>
        ))}
      </div>
    </>
  );
}

/** 100% to 0.1%; extended by decades if the image or its target is better. */
function rangeFor(job: Job, target: number | null): { low: number; high: number } {
  const best = Math.min(job.error?.low ?? 1, target ?? 1);
  let low = 0.001;
  while (best > 0 && best < low * 1.5 && low > 1e-6) low /= 10;
  return { low, high: 1 };
}

function ticksOf({ low, high }: { low: number; high: number }): number[] {
  const out: number[] = [];
  for (let v = high; v > low * 0.99; v /= 10) {
    out.push(v);
    if (low >= 0.001 && v / 3.3 > low) out.push(v * 0.3);
  }
  return out.map((v) => Number(v.toPrecision(1)));
}

/** Up to 24 earlier estimates. */
function ghosts(points: ConvergencePoint[]): number[] {
  const values = points.map((p) => p.relative).filter((v): v is number => v != null && v > 0);
  const step = Math.max(1, Math.ceil(values.length / 24));
  return values.filter((_, i) => i % step === 0);
}
