// The numbers on the screen are those of the API, rounded to the digits that are shown.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ask, desktop, serverAndBrowser, until } from './harness.mjs';

let job;
// The mock server's numbers are its own.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const { server, withPage } = serverAndBrowser({ skip, afterStart: render });

async function render() {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json', prefer: 'wait=60' },
    body: JSON.stringify({
      scene: 'cornell-box',
      film: { width: 96, height: 64 },
      stop: { samples_per_pixel: 32 },
    }),
  });
  job = await answer.json();
}

const factors = { '%': 0.01, k: 1e3, M: 1e6, G: 1e9, T: 1e12, kB: 1e3, MB: 1e6, GB: 1e9 };
const seconds = { s: 1, min: 60, h: 3600, days: 86400 };

/** The value of a displayed number, and one unit of its last digit. */
function read(text) {
  let value = 0;
  let unit = 0;
  const numbers = [...text.matchAll(/([\d.,]+)(?:e(−?\d+))?\s*([a-zA-Z%]*)/g)];
  assert.ok(numbers.length, `"${text}" has no number`);
  for (const [, digits, exponent, name] of numbers) {
    const plain = digits.replace(/,/g, '');
    const factor =
      (factors[name] ?? seconds[name] ?? 1) * 10 ** Number((exponent ?? '0').replace('−', '-'));
    value += Number(plain) * factor;
    const zeros = /^\d{2}\d+?(0*)$/.exec(plain)?.[1].length ?? 0; // Three digits are shown.
    unit = factor * 10 ** (zeros - (plain.split('.')[1]?.length ?? 0));
  }
  return { value, unit };
}

/** Text shows the number, rounded or rounded down, with two digits or in units of `fine`. */
function shows(text, number, what, fine = 0) {
  const { value, unit } = read(text);
  assert.ok(Math.abs(value - number) <= unit * 1.001, `${what}: "${text}" for ${number}`);
  assert.ok(unit <= Math.max(0.11 * Math.abs(number), fine), `${what}: "${text}" is too coarse`);
}

async function compare(page, { error, progress, statistics }) {
  const text = (id) => page.getByTestId(id).innerText();
  const whole = await text('error');
  const [, value] = /The average pixel is\s+([\d.]+%)\s+off/.exec(whole) ?? [];
  assert.ok(value, whole);
  shows(value, error.relative, 'error');
  const [, low, high, confidence] =
    /\(([\d.]+%) to ([\d.]+%) with (\d+)% confidence\)/.exec(whole) ?? [];
  assert.ok(low, whole);
  shows(low, error.low, 'lower end');
  shows(high, error.high, 'upper end');
  assert.equal(Number(confidence), Math.round(100 * error.confidence));
  const figures = Object.fromEntries(
    await page
      .locator('.figures > div')
      .evaluateAll((rows) =>
        rows.map((row) => [row.querySelector('dt').innerText, row.querySelector('dd').innerText]),
      ),
  );
  const { mean } = progress.samples_per_pixel;
  shows(figures['Samples per pixel'], mean, 'samples');
  shows(
    figures['Samples per second'],
    (mean * 96 * 64) / progress.elapsed_seconds,
    'samples per second',
  );
  shows(figures['Rays per second'], statistics.rays_per_second, 'rays');
  shows(figures['Render time'], progress.elapsed_seconds, 'render time', 0.1);
  shows(figures['CPU time'], progress.cpu_seconds, 'CPU time', 0.1);
  const [, efficiency, least, most] = /^(\S+) \((\S+)–(\S+)\)$/.exec(figures.Efficiency) ?? [];
  assert.ok(efficiency, figures.Efficiency);
  shows(efficiency, statistics.efficiency, 'efficiency');
  shows(least, statistics.efficiency_low, 'least efficiency');
  shows(most, statistics.efficiency_high, 'most efficiency');
  shows(figures['Peak memory'], statistics.peak_bytes, 'memory');
}

test('a job is shown with the numbers of the API', { skip, timeout: 240_000 }, () =>
  withPage(desktop, `#/jobs/${job.id}`, async (page) => {
    await until('the error', async () => /off/.test(await page.getByTestId('error').innerText()));
    await page.waitForSelector('.figures');
    await compare(page, job);
  }),
);

test('a number that is off by ten, or shown too coarsely, is noticed', () => {
  assert.throws(() => shows('31%', 0.031, 'error'));
  assert.throws(() => shows('0.31%', 0.031, 'error'));
  assert.throws(() => shows('3%', 0.034, 'error'), /too coarse/);
  assert.throws(() => shows('1.2 s', 12, 'time'));
  assert.throws(() => shows('2.35 k', 2_350_000, 'count'));
  shows('3.1%', 0.0312, 'error');
  shows('9 min 31 s', 571, 'time');
  shows('1.23e−4', 0.000123, 'efficiency');
  shows('1260', 1263, 'efficiency');
});
