// The numbers on the screen are those of the API, rounded to the digits that are shown.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ask, desktop, serverAndBrowser, until } from './harness.mjs';

let job;
let noisier;
// The mock server's numbers are its own.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const { server, openPage, withPage } = serverAndBrowser({ skip, afterStart: render });

const film = { width: 96, height: 64 };
const rendered = async (samples, more = {}) => {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json', prefer: 'wait=60' },
    body: JSON.stringify({
      scene: 'cornell-box',
      film,
      stop: { samples_per_pixel: samples },
      ...more,
    }),
  });
  return answer.json();
};

async function render() {
  job = await rendered(32, { denoise: { type: 'none' } });
  noisier = await rendered(8, { seed: 1, denoise: { type: 'statistical' } });
}

const timeout = 240_000;
const get = async (path) => (await ask(`${server.url}${path}`)).json();

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

/** The same with a sign. */
function showsSigned(text, number, what) {
  assert.equal(/^−/.test(text), number < 0, `${what}: "${text}" for ${number}`);
  shows(text.replace(/^−/, ''), Math.abs(number), what);
}

/** The texts of a list of names and values. */
const listed = (page, selector) =>
  page
    .locator(`${selector} > div`)
    .evaluateAll((rows) =>
      rows.map((row) => [row.querySelector('dt').innerText, row.querySelector('dd').innerText]),
    );

/** Every row has a comparison, and agrees with it; a new row without one fails. */
function compareRows(rows, comparisons) {
  assert.deepEqual(rows.map(([name]) => name).sort(), Object.keys(comparisons).sort());
  for (const [name, text] of rows) comparisons[name](text);
}

/** The interval of an error in the text of its place. */
function compareError(whole, { relative, low, high, confidence }) {
  const [, value] = /The average pixel is\s+([\d.]+%)\s+off/.exec(whole) ?? [];
  assert.ok(value, whole);
  shows(value, relative, 'error');
  const [, from, to, with_] =
    /\(([\d.]+%) to ([\d.]+%) with (\d+)% confidence\)/.exec(whole) ?? [];
  assert.ok(from, whole);
  shows(from, low, 'lower end');
  shows(to, high, 'upper end');
  assert.equal(Number(with_), Math.round(100 * confidence));
}

/** The statistics of a job. */
function statisticsOf({ progress, statistics }) {
  const { mean, min, max } = progress.samples_per_pixel;
  const pixels = film.width * film.height;
  return {
    'Samples per pixel': (text) => {
      const [, whole, least, most] = /^(\S+)(?: \((\S+)–(\S+)\))?$/.exec(text) ?? [];
      assert.ok(whole, text);
      shows(whole, mean, 'samples', 1);
      assert.equal(least === undefined, min === max, text);
      if (least) {
        shows(least, min, 'fewest samples', 1);
        shows(most, max, 'most samples', 1);
      }
    },
    'Samples per second': (text) =>
      shows(text, (mean * pixels) / progress.elapsed_seconds, 'samples per second'),
    'Rays per second': (text) => shows(text, statistics.rays_per_second, 'rays'),
    'Render time': (text) => shows(text, progress.elapsed_seconds, 'render time', 0.1),
    'CPU time': (text) => shows(text, progress.cpu_seconds, 'CPU time', 0.1),
    Efficiency: (text) => {
      const [, efficiency, least, most] = /^(\S+) \((\S+)–(\S+)\)$/.exec(text) ?? [];
      assert.ok(efficiency, text);
      shows(efficiency, statistics.efficiency, 'efficiency');
      shows(least, statistics.efficiency_low, 'least efficiency');
      shows(most, statistics.efficiency_high, 'most efficiency');
    },
    'Peak memory': (text) => shows(text, statistics.peak_bytes, 'memory'),
    'Invalid samples': (text) => assert.equal(Number(text), statistics.rejected_samples),
  };
}

/** The lines of a request by their words. */
function settingsOf(spec, prefix = '') {
  return Object.entries(spec).flatMap(([key, value]) =>
    value !== null && typeof value === 'object' && !Array.isArray(value)
      ? settingsOf(value, `${prefix}${key} `)
      : [[`${prefix}${key}`.replace(/_/g, ' '), value]],
  );
}

const statistics = '[aria-labelledby=statistics-title] .figures';

/** Compares all figures of a job's page. */
async function compare(page, shown) {
  compareError(await page.getByTestId('error').innerText(), shown.error);
  compareRows(await listed(page, statistics), statisticsOf(shown));
  const spec = new Map(settingsOf(shown.spec));
  const settings = await listed(page, '.settings-list');
  assert.ok(settings.length > 3, 'settings are shown');
  for (const [name, text] of settings) {
    assert.ok(spec.has(name), `"${name}" has no comparison`);
    const value = spec.get(name);
    if (name !== 'scene')
      assert.equal(text, typeof value === 'string' ? value : JSON.stringify(value), name);
  }
  // All figures are in one of these lists.
  const known = `${statistics}, .settings-list, [data-testid=prediction]`;
  const others = await page
    .locator('.figures')
    .evaluateAll((all, ours) => all.filter((one) => !one.matches(ours)).length, known);
  assert.equal(others, 0, 'a list of figures has no comparison');
}

/** By the slope of the errors so far, with the server's curve. */
async function comparePrediction(page, id) {
  const { points, slope } = await get(`/v1/jobs/${id}/convergence`);
  const last = points.at(-1);
  const rows = await listed(page, '[data-testid=prediction]');
  assert.ok(rows.length > 0, 'a prediction is shown');
  for (const [name, text] of rows) {
    const [, target] = /^([\d.]+)% error$/.exec(name) ?? [];
    assert.ok(target, name);
    const [, samples] = /, (.*) samples?$/.exec(text) ?? [];
    assert.ok(samples, text);
    const growth = (Number(target) / 100 / last.relative) ** (1 / slope.value);
    shows(samples, growth * last.samples_per_pixel, `samples for ${name}`, 1);
  }
}

test('a job is shown with the numbers of the API', { skip, timeout }, () =>
  withPage(desktop, `#/jobs/${job.id}`, async (page) => {
    await until('the error', async () => /off/.test(await page.getByTestId('error').innerText()));
    await page.waitForSelector('.figures');
    await compare(page, job);
    await page.waitForSelector('[data-testid=prediction]');
    await comparePrediction(page, job.id);
    const [, samples, time, cpu] =
      /^(.*) samples in (.*) \(CPU ([^,]*)/.exec(await page.getByTestId('progress').innerText());
    shows(samples, job.progress.samples_per_pixel.mean, 'samples', 1);
    shows(time, job.progress.elapsed_seconds, 'render time', 0.1);
    shows(cpu, job.progress.cpu_seconds, 'CPU time', 0.1);
  }),
);

test('a rendering job is shown with the numbers of its events', { skip, timeout }, async () => {
  const rendering = {
    ...job,
    state: 'rendering',
    stop_reason: null,
    finished_at: null,
    film_digest: null,
    spec: { ...job.spec, stop: { samples_per_pixel: 65536 } },
    progress: {
      ...job.progress,
      fraction: 0.3761,
      samples_per_pixel: { min: 11, mean: 23.7, max: 61 },
      elapsed_seconds: 75.3,
      cpu_seconds: 140.6,
      eta_seconds: 571,
      eta_interval_seconds: [304, 4520],
    },
    error: { ...job.error, relative: 0.0731, low: 0.0524, high: 0.0917, confidence: 0.95 },
    statistics: {
      ...job.statistics,
      rays_per_second: 3.47e6,
      efficiency: 1.33,
      efficiency_low: 0.845,
      efficiency_high: 2.59,
      peak_bytes: 61.2e6,
      rejected_samples: 3,
    },
  };
  const address = `${server.url}/v1/jobs/${job.id}`;
  const page = await openPage(desktop, `#/jobs/${job.id}`, async (opened) => {
    await opened.route('**/v1/jobs?*', (way) =>
      way.fulfill({ json: { jobs: [rendering], next: null } }),
    );
    await opened.route(address, (way) => way.fulfill({ json: rendering }));
    await opened.route(`${address}/events`, (way) =>
      way.fulfill({
        contentType: 'text/event-stream',
        body: `id: 1-1\nevent: snapshot\ndata: ${JSON.stringify(rendering)}\n\n`,
      }),
    );
  });
  try {
    await until('the time left', async () =>
      /left/.test(await page.getByTestId('progress').innerText()),
    );
    const line = await page.getByTestId('progress').innerText();
    const [, done, left] = /^([\d.]+%), about (.*) left$/.exec(line) ?? [];
    assert.ok(done, line);
    shows(done, 0.3761, 'progress', 0.01);
    shows(left, 571, 'time left', 1);
    const range = await page.getByTestId('progress').getAttribute('title');
    const [, least, most] = /^(.*) to (.*) left at this pace$/.exec(range) ?? [];
    shows(least, 304, 'least time left', 1);
    shows(most, 4520, 'most time left', 60);
    await page.waitForSelector('.figures');
    await compare(page, rendering);
  } finally {
    await page.context().close();
  }
});

test('a denoised image is shown with its own error', { skip, timeout }, () =>
  withPage(desktop, `#/jobs/${noisier.id}`, async (page) => {
    await page.getByTestId('error-plain').waitFor();
    const image = await ask(`${server.url}/v1/jobs/${noisier.id}/image.png?denoise=mixed`);
    const [relative, low, high] = image.headers.get('x-tessera-error').split(',').map(Number);
    const whole = await page.getByTestId('error').innerText();
    compareError(whole, { relative, low, high, confidence: 0.95 });
    const [, plain] = /([\d.]+%) without denoising/.exec(whole) ?? [];
    assert.ok(plain, whole);
    shows(plain, noisier.error.relative, 'plain error');
  }),
);

test('a comparison is shown with the numbers of the API', { skip, timeout }, async () => {
  const answer = await ask(`${server.url}/v1/comparisons`, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify({ a: noisier.id, b: job.id }),
  });
  const { relmse, mse, flip, bias, z } = await answer.json();
  await withPage(desktop, `#/compare/${noisier.id}/${job.id}`, async (page) => {
    await until('FLIP', async () =>
      /FLIP/.test(await page.getByTestId('compare-numbers').innerText()),
    );
    compareRows(await listed(page, '.compare-numbers'), {
      relMSE: (text) => shows(text, relmse, 'relMSE'),
      MSE: (text) => shows(text, mse, 'MSE'),
      FLIP: (text) => shows(text, flip, 'FLIP'),
      'Bias of A': (text) => showsSigned(text, bias.value, 'bias'),
      'z of a pixel': (text) => {
        const [mean, deviation] = text.split(' ± ');
        showsSigned(mean, z.mean, 'mean of z');
        shows(deviation, Math.sqrt(z.variance), 'deviation of z');
      },
      'Pixels beyond 3 σ': (text) => shows(text, z.share_above_3, 'share', 1e-4),
    });
    for (const [side, one] of [['A', noisier], ['B', job]]) {
      const text = await page.locator(`.side-note-${side.toLowerCase()}`).innerText();
      const [, samples, error] = /^. (.*) samples, (.*)$/.exec(text) ?? [];
      assert.ok(samples, text);
      shows(samples, one.progress.samples_per_pixel.mean, `samples of ${side}`, 1);
      shows(error, one.error.relative, `error of ${side}`);
    }
    const note = await page.locator('.compare-numbers .hint', { hasText: '95%' }).innerText();
    const [, low, high] = /^95%: (\S+) to (\S+)$/.exec(note) ?? [];
    assert.ok(low, note);
    showsSigned(low, bias.low, 'lower end of the bias');
    showsSigned(high, bias.high, 'upper end of the bias');
  });
});

test('lists of jobs are shown with the numbers of the API', { skip, timeout }, () =>
  withPage(desktop, '#/jobs', async (page) => {
    for (const one of [job, noisier]) {
      const card = page.locator('.job-card', { has: page.locator(`a[href="#/jobs/${one.id}"]`) });
      await card.waitFor();
      const facts = await card.locator('.whole').allInnerTexts();
      const [error, samples, time, ...rest] = facts;
      assert.deepEqual(rest.length, 1, `a new fact has no comparison: ${facts}`);
      assert.match(error, /% error$/);
      shows(error.replace(' error', ''), one.error.relative, 'error');
      assert.match(samples, / samples$/);
      shows(samples.replace(' samples', ''), one.progress.samples_per_pixel.mean, 'samples', 1);
      shows(time, one.progress.elapsed_seconds, 'render time', 0.1);
    }
    // The strip below an image, too.
    await page.goto(`${server.url}/#/jobs/${job.id}`);
    for (const one of [job, noisier]) {
      const item = page.locator(`.filmstrip a[href="#/jobs/${one.id}"] .strip-state`);
      await item.waitFor();
      shows(await item.innerText(), one.error.relative, 'error in the strip');
    }
  }),
);

test('settings show the build and the limits of the server', { skip, timeout }, async () => {
  const { version, build, limits } = await get('/v1/server');
  await withPage(desktop, '#/settings', async (page) => {
    await page.waitForSelector('.figures');
    const [first, second, ...rest] = await page
      .locator('.figures')
      .evaluateAll((lists) =>
        lists.map((list) =>
          [...list.children].map((row) => [
            row.querySelector('dt').textContent,
            row.querySelector('dd').textContent,
          ]),
        ),
      );
    assert.deepEqual(rest, [], 'a list of figures has no comparison');
    const is = (value) => (text) => assert.equal(text, value.slice(0, 16));
    compareRows(first, {
      Version: is(version),
      Build: is(build.id),
      Commit: is(build.commit),
      Compiler: is(build.compiler),
      Instructions: is(build.isa),
      Embree: is(build.embree),
    });
    const known = Object.values(limits);
    assert.equal(second.length, known.length);
    second.forEach(([name, text], i) => {
      if (/\d/.test(text)) shows(text, known[i], name, 1);
    });
  });
});

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
