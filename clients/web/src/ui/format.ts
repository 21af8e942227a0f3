/** Numbers for display. A missing number is a dash. */

const dash = '–';
const known = (v: number | null | undefined): v is number =>
  typeof v === 'number' && Number.isFinite(v);

const minus = (text: string): string => text.replace(/-/g, '−');

/** Rounded to seven digits, which tell floats apart. */
export const rounded = (v: number): number => Number(v.toPrecision(7));

/** Three significant digits, no exponent between 1e-3 and 1e5. */
export function number(v: number | null | undefined, digits = 3): string {
  if (!known(v)) return dash;
  if (v === 0) return '0';
  const size = Math.abs(v);
  if (size >= 1e5 || size < 1e-3) return minus(v.toExponential(digits - 1).replace('e+', 'e'));
  return minus(v.toLocaleString('en', { maximumSignificantDigits: digits, useGrouping: false }));
}

/** So many significant digits, with trailing zeros: for columns of a table. */
export function digits(v: number | null | undefined, n: number): string {
  if (!known(v)) return dash;
  const size = Math.abs(v);
  if (v !== 0 && (size >= 1e5 || size < 1e-3)) return number(v, n);
  const decimals = v === 0 ? 0 : Math.max(0, n - 1 - Math.floor(Math.log10(size)));
  return minus(v.toFixed(decimals));
}

/** A share as percent with two to three digits. */
export function percent(v: number | null | undefined): string {
  if (!known(v)) return dash;
  const p = 100 * v;
  const digits = p >= 99.95 ? 0 : p >= 9.995 ? 1 : 2;
  return `${p >= 0.0995 ? p.toFixed(digits) : p.toPrecision(2)}%`;
}

/** Progress, rounded down: 100% is not shown before the end. */
export function doneShare(fraction: number): string {
  const p = 100 * fraction;
  if (p <= 0) return '0%';
  if (p < 0.1) return 'under 0.1%';
  return p < 10 ? `${(Math.floor(10 * p) / 10).toFixed(1)}%` : `${Math.floor(p)}%`;
}

/**
 * A value and the half width of its interval, both rounded to the digits that the interval
 * supports.
 */
export function measured(value: number, half: number): [string, string] {
  const decimals = 1 - Math.floor(Math.log10(half));
  if (!(half > 0) || decimals > 9 || half >= 100) return [number(value, 4), number(half, 2)];
  const places = Math.max(0, decimals);
  return [minus(value.toFixed(places)), half.toFixed(places)];
}

/** Every digit, in groups of three. */
export const exact = (v: number): string => v.toLocaleString('en', { maximumFractionDigits: 20 });

export function count(v: number | null | undefined): string {
  if (!known(v)) return dash;
  if (v < 1e4) return Math.round(v).toLocaleString('en');
  for (const [unit, size] of [
    ['T', 1e12],
    ['G', 1e9],
    ['M', 1e6],
    ['k', 1e3],
  ] as const)
    if (v >= size) return `${number(v / size)} ${unit}`;
  return String(v);
}

/** "1 sample", "2 samples". */
export const counted = (v: number | null | undefined, what: string): string =>
  `${count(v)} ${what}${count(v) === '1' ? '' : 's'}`;

export function bytes(v: number | null | undefined): string {
  if (!known(v)) return dash;
  for (const [unit, size] of [
    ['GB', 1e9],
    ['MB', 1e6],
    ['kB', 1e3],
  ] as const)
    if (v >= size) return `${number(v / size)} ${unit}`;
  return `${v} bytes`;
}

export function duration(seconds: number | null | undefined): string {
  if (!known(seconds)) return dash;
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  const pair = (small: number, large: string, name: string): string =>
    `${Math.floor(small / 60)} ${large} ${String(small % 60).padStart(2, '0')} ${name}`;
  const whole = Math.round(seconds);
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return pair(whole, 'min', 's');
  if (seconds < 86370) return pair(Math.round(seconds / 60), 'h', 'min');
  return `${number(seconds / 86400)} days`;
}

export function ago(iso: string | null | undefined): string {
  if (!iso) return '';
  const seconds = (Date.now() - Date.parse(iso)) / 1000;
  if (!(seconds >= 0)) return 'just now';
  if (seconds < 60) return 'just now';
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ago`;
  if (seconds < 86400) return `${Math.floor(seconds / 3600)} h ago`;
  return new Date(iso).toLocaleDateString('en', { day: 'numeric', month: 'short' });
}

/** A description of how an image with this relative error looks. */
export function errorInWords(error: number | null | undefined): string {
  if (!known(error)) return 'Too few samples to estimate.';
  if (error > 0.3) return 'Very noisy: good enough to check the layout only.';
  if (error > 0.1) return 'Noisy: good enough to check lighting and layout.';
  if (error > 0.03) return 'Visible grain.';
  if (error > 0.01) return 'Nearly clean: fine grain in dark or glossy places.';
  return 'Clean to the eye.';
}
