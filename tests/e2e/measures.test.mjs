// Measurements in addition to an image: strategies of bidirectional paths, readings of a meter.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { accessibilityFaults, ask, desktop, launch, Server, until, withPageOf } from './harness.mjs';

const server = new Server();
let browser;

before(async () => {
  await server.start();
  browser = await launch();
});

after(async () => {
  await browser?.close();
  await server.stop();
});

async function finished(request) {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify({
      scene: 'cornell-box',
      stop: { samples_per_pixel: 16 },
      ...request,
    }),
  });
  assert.equal(answer.status, 201);
  const { id } = await answer.json();
  const state = async () => (await (await ask(`${server.url}/v1/jobs/${id}`)).json()).state;
  await until('the job to finish', async () => (await state()) === 'finished');
  return id;
}

/** A screenshot, if TESSERA_SHOTS names a folder for it. */
const shot = async (page, name) => {
  const folder = process.env.TESSERA_SHOTS;
  if (folder) await page.screenshot({ path: `${folder}/${name}.png`, fullPage: true });
};

test('strategies are arranged by path length, with and without weights', async () => {
  const kept = ['0,2', '1,2', '2,1', '0,3', '1,3', '2,2', '3,1'];
  const id = await finished({
    film: {
      width: 96,
      height: 96,
      layers: kept.flatMap((one) => [`st:${one}`, `st:${one}:unweighted`]),
    },
    integrator: { type: 'bdpt', max_depth: 3 },
  });
  await withPageOf(browser, server, desktop, `#/jobs/${id}`, async (page) => {
    await page.waitForSelector('[data-testid=pyramid]');
    const rows = () =>
      page.$$eval('.pyramid-row', (all) =>
        all.map((row) => [...row.querySelectorAll('.mono')].map((cell) => cell.textContent)),
      );
    assert.deepEqual(await rows(), [
      ['s0 t2'],
      ['s0 t3', 's1 t2', 's2 t1'],
      ['s1 t3', 's2 t2', 's3 t1'],
    ]);
    const seen = () =>
      page.$$eval('.pyramid-cell img', (all) => all.every((i) => i.complete && i.naturalWidth));
    await until('the images', seen);
    await shot(page, 'pyramid');
    await page.check('[data-testid=pyramid-unweighted]');
    await page.click('[data-testid="pyramid-st:2,2:unweighted"]');
    await page.waitForSelector('.server-image[data-layer="st:2,2:unweighted"]');
    assert.match(page.url(), /show=st/);
    await until('the images', seen);
    await shot(page, 'pyramid-unweighted');
    assert.deepEqual(await accessibilityFaults(page), []);
  });
});

test('readings of a meter are shown next to the image, as the server reports them', async () => {
  const point = (x) => ({ position: [x, 0.01, 0.2], normal: [0, 1, 0] });
  const id = await finished({
    film: { width: 64, height: 64 },
    meter: {
      points: [point(-0.2), point(0.2)],
      plane: {
        origin: [-0.4, 0.01, -0.4],
        edge_u: [0, 0, 0.8],
        edge_v: [0.8, 0, 0],
        columns: 2,
        rows: 3,
      },
    },
  });
  const { points } = await (await ask(`${server.url}/v1/jobs/${id}/meter`)).json();
  assert.equal(points.length, 8);
  await withPageOf(browser, server, desktop, `#/jobs/${id}`, async (page) => {
    const cells = await until('the table', async () => {
      const all = await page.$$eval('[data-testid=meter] tbody tr', (rows) =>
        rows.map((row) =>
          [...row.querySelectorAll('td')].map((td) => parseFloat(td.innerText.replaceAll('−', '-'))),
        ),
      );
      return all.length && all;
    });
    assert.equal(cells.length, points.length);
    for (const [i, [lux, watts]] of cells.entries()) {
      const truth = points[i];
      assert.ok(Math.abs(lux - truth.illuminance_lux) <= (truth.high - truth.low) / 2, `${lux}`);
      // Zero within the blocks.
      const watt = truth.irradiance_w_m2;
      assert.ok(Math.abs(watts - watt) <= 0.01 * watt, `${watts}`);
    }
    await shot(page, 'meter');
    const csv = await page.getAttribute('[data-testid=meter] a', 'href');
    assert.match(await (await ask(server.url + csv)).text(), /illuminance_lux/);
    assert.deepEqual(await accessibilityFaults(page), []);
  });
});
