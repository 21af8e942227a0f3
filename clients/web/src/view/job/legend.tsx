import type { Look } from '../../live/painter';
import { rampCss } from '../../live/heat';
import { count, number } from '../../ui/format';
import { lumensPerWatt, type LuxScale } from './lux';
import type { Mode } from './view_modes';

/** Round values between the ends, on the ramp's logarithmic scale. */
function ticks(look: Look): number[] {
  if (look.high / look.low < 10) return [look.low, look.high];
  const out: number[] = [];
  for (let e = Math.floor(Math.log10(look.low) + 1e-6); e <= Math.log10(look.high) + 1e-6; ++e)
    out.push(10 ** e, 3 * 10 ** e);
  const inside = out.filter((v) => v > look.low * 0.999 && v < look.high * 1.001);
  if (inside.length <= 5) return inside;
  const tens = inside.filter((v) => Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-6);
  const every = Math.ceil(tens.length / 5);
  return tens.filter((_, i) => i % every === 0);
}

export type Unit = 'percent' | 'count' | 'number';

/** Ticks below 0.01 are at 1 and 3 times powers of ten. */
function powerOfTen(v: number): string {
  const exponent = Math.floor(Math.log10(v) + 1e-6);
  const factor = Math.round(v / 10 ** exponent);
  const digits = String(-exponent).replace(/\d/g, (d) => '⁰¹²³⁴⁵⁶⁷⁸⁹'[Number(d)]);
  return `${factor === 1 ? '' : `${factor}·`}10⁻${digits}`;
}

const texts: Record<Unit, (v: number) => string> = {
  percent: (v) => `${number(100 * v, 2)}%`,
  count,
  number: (v) => (v < 0.01 ? powerOfTen(v) : number(v, 2)),
};

export const unitOf = (mode: Mode): Unit =>
  mode === 'error' || mode === 'tile-error' ? 'percent' : mode === 'samples' ? 'count' : 'number';

interface RampLegendProps {
  /** One sentence on how to read the colours. */
  meaning: string;
  ramp: Parameters<typeof rampCss>[0];
  /** at: percent from the left. */
  marks: { at: number; text: string }[];
  /** In the flow of a card instead of over the image. */
  inCard?: boolean;
}

function RampLegend({ meaning, ramp, marks, inCard }: RampLegendProps) {
  return (
    <figure class={inCard ? 'legend-card' : 'legend'} data-testid="legend">
      <figcaption>{meaning}</figcaption>
      <div class="legend-ramp" style={{ backgroundImage: rampCss(ramp) }} aria-hidden="true" />
      <div class="legend-ticks">
        {marks.map(({ at, text }) => {
          // At the ends of the ramp they are inside its edge.
          const shift = at < 5 ? 0 : at > 95 ? -100 : -50;
          return (
            <span key={at} style={{ left: `${at}%`, translate: `${shift}% 0` }}>
              {text}
            </span>
          );
        })}
      </div>
    </figure>
  );
}

export function Legend({ look, meaning, unit }: { look: Look; meaning: string; unit: Unit }) {
  const text = texts[unit];
  const marks = ticks(look).map((v) => ({
    at: (100 * Math.log(v / look.low)) / Math.log(look.high / look.low),
    text: text(v),
  }));
  return <RampLegend meaning={meaning} ramp={look.ramp} marks={marks} />;
}

/** For the server's map, whose scale is linear. */
export function FlipLegend({ meaning }: { meaning: string }) {
  const marks = [0, 0.25, 0.5, 0.75, 1].map((v) => ({ at: 100 * v, text: number(v) }));
  return <RampLegend meaning={meaning} ramp="flip" marks={marks} />;
}

interface LuxLegendProps {
  meaning: string;
  scale: LuxScale;
  /** What has one value each. */
  values: 'pixels' | 'points';
  inCard?: boolean;
}

/** A linear scale in lux, and how far values exceed it. */
export function LuxLegend({ meaning, scale, values, inCard }: LuxLegendProps) {
  const { top, parts, most } = scale;
  const marks = Array.from({ length: parts + 1 }, (_, i) => ({
    at: (100 * i) / parts,
    text: number((i / parts) * top),
  }));
  const peak = `the maximum is ${number(most)} lux (${number(most / lumensPerWatt)} W/m²)`;
  const range =
    most > top
      ? `the scale ends where all but 0.5% of the ${values} lie below; ${peak}`
      : peak;
  return (
    <RampLegend
      meaning={`${meaning} In lux; ${range}.`}
      ramp="error"
      marks={marks}
      inCard={inCard}
    />
  );
}
