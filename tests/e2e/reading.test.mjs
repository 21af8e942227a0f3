// Readable text: nothing in any view is smaller than 13 px, on a desktop and on a phone.
// With TESSERA_SHOTS, a folder, each view is also saved as an image.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ask, desktop, phone, serverAndBrowser, until } from './harness.mjs';

let job, other, batch;
// The mock server has no laboratory.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const { server, openPage } = serverAndBrowser({ skip, afterStart: renderAll });
const smallestPx = 13;

const post = async (path, body) =>
  (
    await ask(`${server.url}${path}`, {
      method: 'POST',
      headers: { 'content-type': 'application/json', prefer: 'wait=60' },
      body: JSON.stringify(body),
    })
  ).json();

async function renderAll() {
  const film = { width: 96, height: 64 };
  const body = (seed) => ({ scene: 'glass', name: `glass ${seed}`, seed, film });
  job = await post('/v1/jobs', { ...body(1), stop: { samples_per_pixel: 32 } });
  other = await post('/v1/jobs', { ...body(2), stop: { samples_per_pixel: 32 } });
  const template = { ...body(3), stop: { samples_per_pixel: 4 } };
  batch = await post('/v1/batches', {
    template,
    matrix: { 'camera.orbit.theta_degrees': [0, 90, 180, 270] },
  });
}

/** Displayed text as "11.2 px: the text", without superscripts and subscripts. */
const smallTexts = (page) =>
  page.evaluate((smallest) => {
    const found = new Set();
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
      const text = walker.currentNode.textContent.trim();
      const element = walker.currentNode.parentElement;
      if (!text || !element.getClientRects().length || element.closest('sup, sub, script, style'))
        continue;
      const scale = element.getScreenCTM?.()?.a ?? 1;
      const size = parseFloat(getComputedStyle(element).fontSize) * Math.abs(scale || 1);
      // Sizes in rem are rounded to a hundredth.
      if (size < smallest - 0.05) found.add(`${size.toFixed(1)} px: ${text.slice(0, 40)}`);
    }
    return [...found];
  }, smallestPx);

const views = {
  renders: ['#/jobs', '.job-card'],
  job: [() => `#/jobs/${job.id}`, '[data-testid=slope] b'],
  camera: ['#/compose/glass', '[data-testid=compose-reset]'],
  series: [() => `#/series/${batch.id}`, '.job-card'],
  compare: [() => `#/compare/${job.id}/${other.id}`, '[data-testid=compare-numbers]'],
  laboratory: ['#/lab/samplers-2d', '[data-testid=lab-run]'],
  convergence: [() => `#/convergence/${job.id},${other.id}`, '[data-testid=convergence-plot]'],
  settings: ['#/settings', 'h1'],
  guide: ['#/guide/concepts', 'h1'],
};

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`no text is smaller than ${smallestPx} px on a ${name}`, {
    skip,
    timeout: 300_000,
  }, async () => {
    const page = await openPage(device, '#/jobs');
    for (const [view, [hash, ready]] of Object.entries(views)) {
      await page.goto(`${server.url}/${typeof hash === 'function' ? hash() : hash}`);
      await page.waitForSelector(ready);
      if (view === 'laboratory') {
        await page.click('[data-testid=lab-run]');
        await until('the plots', () => page.locator('.lab-plot text').count());
      }
      await page.evaluate(() => {
        for (const details of document.querySelectorAll('.advanced')) details.open = true;
      });
      await page.waitForTimeout(300);
      if (process.env.TESSERA_SHOTS)
        await page.screenshot({
          path: `${process.env.TESSERA_SHOTS}/${view}-${name}.png`,
          fullPage: true,
        });
      assert.deepEqual(await smallTexts(page), [], view);
    }
    await page.context().close();
  });
