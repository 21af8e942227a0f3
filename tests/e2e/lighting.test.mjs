// Lighting studies: meters without an image, their map, and two designs compared in lux.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  accessibilityFaults,
  ask,
  desktop,
  phone,
  sceneOf,
  serverAndBrowser,
  settles,
  until,
} from './harness.mjs';

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

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`a room is measured without an image from the form on a ${name}`, { timeout: 300_000 }, () =>
    withPage(device, '#/jobs', async (page) => {
      await until('scenes in the list', () => sceneOf(page));
      await page.selectOption('[data-testid=scene]', 'cornell-box');
      await page.selectOption('[data-testid=output]', 'meter');
      // Half of the height of a room below 1.5 m, and a quarter from the walls of one below 2 m.
      const { bounds } = await (await ask(`${server.url}/v1/scenes/cornell-box`)).json();
      const middle = (bounds.min[1] + bounds.max[1]) / 2;
      const height = page.getByTestId('meter-height');
      await until('the plane', async () => Math.abs((await height.inputValue()) - middle) < 1e-6);
      assert.equal(await page.getByTestId('size').count(), 0);
      const plane = { left: 0, right: 0.25, back: 0.3, front: 0, height: 0.4, columns: 2, rows: 3 };
      for (const [name, value] of Object.entries(plane))
        await page.fill(`[data-testid=meter-${name}]`, String(value));
      await page.fill('[data-testid=meter-points]', '0 0.4');
      await page.fill('[data-testid=stop-meter-error]', '60');
      await page.click('[data-testid=submit]');
      await page.getByText('Give three or six numbers in each line.').waitFor();
      await page.getByText('front greater than back').waitFor();
      await page.fill('[data-testid=meter-back]', '-0.3');
      await page.fill('[data-testid=meter-points]', '0 0.4 0\n0, 0.4, 0.1; 1 0 0');
      assert.deepEqual(await accessibilityFaults(page), []);
      await page.click('[data-testid=submit]');
      await page.waitForURL(/#\/jobs\/./);
      const id = page.url().split('/').at(-1).split('?')[0];
      const { spec } = await (await ask(`${server.url}/v1/jobs/${id}`)).json();
      assert.equal(spec.film, null);
      assert.deepEqual(spec.meter, {
        points: [
          { position: [0, 0.4, 0], normal: [0, 1, 0] },
          { position: [0, 0.4, 0.1], normal: [1, 0, 0] },
        ],
        plane: {
          origin: [0, 0.4, 0],
          edge_u: [0.25, 0, 0],
          edge_v: [0, 0, -0.3],
          columns: 2,
          rows: 3,
        },
      });
      assert.equal(spec.stop.meter_error, 0.6);
      await page.getByTestId('meter-map').waitFor();
      await settles('rows of readings', () => page.locator('.meter-table tbody tr').count(), 8);
    }),
  );
