// Lighting studies: meters without an image, their map, and two designs compared in lux.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFaults, ask, desktop, serverAndBrowser, settles } from './harness.mjs';

const { server, withPage } = serverAndBrowser();

/** Above the blocks, under the lamp. */
const plane = {
  origin: [0, 0.4, 0.25],
  edge_u: [0.2, 0, 0],
  edge_v: [0, 0, -0.3],
  columns: 4,
  rows: 3,
};

async function measured(environment) {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json', prefer: 'wait=25' },
    body: JSON.stringify({
      scene: 'cornell-box',
      film: null,
      meter: { plane },
      stop: { meter_error: 0.5, samples_per_pixel: 512 },
      environment,
    }),
  });
  assert.equal(answer.status, 201, await answer.clone().text());
  return answer.json();
}

test(
  'a job that only measures shows its meter instead of an image',
  { timeout: 300_000 },
  async () => {
    const job = await measured(null);
    assert.equal(job.stop_reason, 'meter_error');
    const { uniformity, points } = await (
      await ask(`${server.url}/v1/jobs/${job.id}/meter`)
    ).json();
    const lux = points.map((p) => p.illuminance_lux);
    const mean = lux.reduce((sum, v) => sum + v, 0) / lux.length;
    assert.ok(Math.abs(uniformity - Math.min(...lux) / mean) < 1e-9);
    const refused = [];
    await withPage(desktop, `#/jobs/${job.id}`, async (page) => {
      page.on('response', (response) => response.status() >= 400 && refused.push(response.url()));
      await page.reload();
      await page.getByTestId('meter-map').waitFor();
      assert.equal(await page.locator('canvas').count(), 0);
      assert.match(await page.textContent('[data-testid=meter-summary]'), /Uniformity [\d.]+\./);
      assert.match(await page.getAttribute('[data-testid=meter-contour]', 'd'), /^M/);
      await page.fill('[data-testid=meter-top]', '1000000');
      await page.press('[data-testid=meter-top]', 'Tab');
      await settles(
        'no line on a scale far above',
        () => page.getAttribute('[data-testid=meter-contour]', 'd'),
        '',
      );
      assert.deepEqual(await accessibilityFaults(page), []);
    });
    assert.deepEqual(refused, []);
  },
);

test('two designs are compared in lux', { timeout: 300_000 }, async () => {
  const [dark, bright] = [await measured(null), await measured({ color: [2, 2, 2] })];
  const answer = await ask(`${server.url}/v1/comparisons?a=${bright.id}&b=${dark.id}`);
  const { a, b, difference_lux, points } = await answer.json();
  assert.ok(Math.abs(difference_lux - (a.mean_lux - b.mean_lux)) < 1e-9 * a.mean_lux);
  assert.equal(points.length, 12);
  for (const p of points) assert.ok(p.low <= p.difference_lux && p.difference_lux <= p.high);
  await withPage(desktop, `#/compare/${bright.id}/${dark.id}`, async (page) => {
    const table = page.getByTestId('meter-compare');
    await table.waitFor();
    assert.equal(await page.getByTestId('meter-map').count(), 3);
    assert.match(await page.textContent('[data-testid=meter-difference]'), /lux on average/);
    assert.deepEqual(await accessibilityFaults(page), []);
  });
});
