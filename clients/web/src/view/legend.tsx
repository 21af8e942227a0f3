import type { Look } from '../live/painter';
import { rampCss } from '../live/heat';
import { count, number } from '../ui/format';
import { layerModes, planeModes, type Mode } from './view_modes';

/** Round values between the ends, on the ramp's logarithmic scale. */
function ticks(look: Look): number[] {
  if (look.high / look.low < 10) return [look.low, look.high];
  const out: number[] = [];
  for (let e = Math.ceil(Math.log10(look.low) - 1e-6); e <= Math.log10(look.high) + 1e-6; ++e)
    out.push(10 ** e);
  const every = Math.ceil(out.length / 5);
  return out.filter((_, i) => i % every === 0);
}

export function Legend({
  mode,
  look,
  correlated,
}: {
  mode: Mode;
  look: Look;
  correlated: boolean;
}) {
  const info = [...planeModes, ...layerModes].find((m) => m.mode === mode)!;
  const text =
    mode === 'error' || mode === 'tile-error'
      ? (v: number) => `${number(100 * v, 2)} %`
      : mode === 'samples'
        ? count
        : (v: number) => number(v, 2);
  return (
    <figure class="legend" data-testid="legend">
      <figcaption>
        {info.meaning}
        {correlated && mode !== 'samples' && ' Errors of neighbouring pixels hang together here.'}
      </figcaption>
      <div class="legend-ramp" style={{ backgroundImage: rampCss(look.ramp) }} aria-hidden="true" />
      <div class="legend-ticks">
        {ticks(look).map((v) => (
          <span
            key={v}
            style={{ left: `${(100 * Math.log(v / look.low)) / Math.log(look.high / look.low)}%` }}
          >
            {text(v)}
          </span>
        ))}
      </div>
    </figure>
  );
}
