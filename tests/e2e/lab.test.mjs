import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';
import {
  accessibilityFaults,
  desktop,
  phone,
  serverAndBrowser,
  settles,
  until,
} from './harness.mjs';

const { withPage } = serverAndBrowser();

const verdict = (page) => page.textContent('[data-testid=lab-verdict]');
const download = async (page, button) => {
  const [file] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name: button }).click(),
  ]);
  return fs.readFileSync(await file.path(), 'utf8');
};

test('an experiment runs from its link, is plotted, compared and saved', { timeout: 300_000 }, () =>
  withPage(
    desktop,
    '#/lab/samplers-2d?estimator=edge&n=16,64,256&replicates=16&seed=3',
    async (page) => {
      assert.equal(await page.inputValue('select >> nth=1'), 'edge');
      await page.getByTestId('lab-run').click();
      await until('a verdict', async () => /theory/.test(await verdict(page)));
      assert.match(await verdict(page), /Agrees with theory.*0\.7853982/);
      const shown = (id, what) => page.getByTestId(id).locator(what).count();
      await settles('points', () => shown('lab-plot', 'circle'), 3);
      await settles('a fit', () => shown('lab-plot', '.lab-fit'), 1);
      await settles('what is expected', () => shown('lab-plot', '.lab-expected'), 1);
      await settles('the pattern', () => shown('lab-pattern', 'circle'), 256);

      // The second run joins the first in the plot, and the address follows the form.
      await page.selectOption('select >> nth=2', 'independent');
      assert.match(page.url(), /#\/lab\/samplers-2d\?estimator=edge&sampler=independent&n=16/);
      await page.getByTestId('lab-run').click();
      await until(
        'both runs',
        async () => (await page.locator('[data-testid=lab-plot] .lab-fit').count()) === 2,
      );
      await until('a verdict', async () => /theory/.test(await verdict(page)));

      const csv = await download(page, 'Save CSV');
      const head = 'estimator,sampler,n,mean,rmse,standard_error,cost,seconds';
      assert.equal(csv.split('\n')[0], head);
      assert.deepEqual(
        csv
          .trim()
          .split('\n')
          .slice(1)
          .map((row) => row.split(',').slice(1, 3).join(' ')),
        ['sobol', 'independent'].flatMap((sampler) => [16, 64, 256].map((n) => `${sampler} ${n}`)),
      );
      const lines = (await download(page, 'Save JSON')).trim().split('\n').map((l) => JSON.parse(l));
      assert.equal(lines.filter((line) => line.verdict).length, 2, 'both runs end');
      assert.deepEqual([...new Set(lines.map((line) => line.sampler))], ['sobol', 'independent']);
      const svg = await download(page, 'Save SVG');
      assert.match(svg, /^<svg[^>]* xmlns="http:\/\/www\.w3\.org\/2000\/svg"/);
      assert.ok(!/class=/.test(svg), 'the drawing needs no style sheet');
    },
  ),
);

test(
  'all samplers are compared, and the legend names the sampler whose points are shown',
  { timeout: 300_000 },
  () =>
    withPage(
      desktop,
      '#/lab/samplers-2d?estimator=additive&n=64,256&replicates=8',
      async (page) => {
        assert.equal(await page.locator('.lab-formula sup').first().textContent(), '−1/2');
        const samplers = await page.locator('select').nth(2).locator('option').allTextContents();
        await page.getByRole('button', { name: 'All samplers' }).click();
        const legend = page.locator('.lab-legend button');
        await until('all runs', async () => (await legend.count()) === samplers.length);
        await until('a verdict', async () => /theory/.test(await verdict(page)));
        const fits = page.locator('[data-testid=lab-plot] .lab-fit');
        await settles('a fit of each', () => fits.count(), samplers.length);
        // A Latin hypercube has a point in each of 256 columns; independent points leave 94 ± 5
        // empty.
        const columns = async (name) => {
          const run = legend.filter({ hasText: `additive, ${name}` });
          await run.click();
          await settles('the run that is shown', () => run.getAttribute('aria-pressed'), 'true');
          const points = await page.$$eval('[data-testid=lab-pattern] circle', (all) =>
            all.map((c) => Math.floor((256 * Number(c.getAttribute('cx'))) / 260)),
          );
          assert.equal(points.length, 256);
          return new Set(points).size;
        };
        assert.ok((await columns('latin-hypercube')) === 256);
        assert.ok((await columns('independent')) < 200);

        await page.getByRole('button', { name: 'Mean', exact: true }).click();
        const mean = page.getByTestId('lab-mean');
        await settles('the exact mean', () => mean.locator('.lab-exact').count(), 1);
        await settles('the means', () => mean.locator('.lab-dot').count(), 2 * samplers.length);
        const saved = (await download(page, 'Save JSON'))
          .trim()
          .split('\n')
          .map((line) => JSON.parse(line));
        assert.deepEqual(
          saved.slice(0, 2).map((line) => line.n),
          [64, 256],
        );
        assert.equal(saved[2].sampler, 'independent');
      },
    ),
);

test(
  'a long run can be cancelled, and a refused value is reported at its field',
  { timeout: 300_000 },
  () =>
    withPage(desktop, '#/lab/pi?n=16,100000000&replicates=9', async (page) => {
      await page.getByTestId('lab-run').click();
      await until(
        'the first point',
        async () => (await page.locator('[data-testid=lab-plot] circle').count()) === 1,
      );
      await page.getByRole('button', { name: 'Cancel' }).click();
      await until('the end', async () => (await verdict(page)) === 'Cancelled.');
      await page.getByLabel('Replicates').fill('1');
      await page.getByTestId('lab-run').click();
      await page.getByText('1 is outside [2, 4096]').waitFor();
    }),
);

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
]) {
  test(`WCAG 2.2 AA holds in the laboratory on a ${name}`, { timeout: 300_000 }, () =>
    withPage(device, '#/lab/samplers-4d?n=16,64,256&replicates=8', async (page) => {
      await page.getByTestId('lab-run').click();
      await until('a verdict', async () => /theory/.test(await verdict(page)));
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.ok(wide <= 0, `${wide} pixels too wide`);
      assert.deepEqual(await accessibilityFaults(page), []);
    }),
  );
}
