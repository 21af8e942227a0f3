// What the form keeps and sends: presets, environment maps sent earlier, the lens, local times.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  ask,
  desktop,
  drop,
  panorama,
  sceneOf,
  serverAndBrowser,
  settles,
  until,
} from './harness.mjs';

const { server, withPage: withPageOf } = serverAndBrowser();

const withPage = (use, device = desktop, hash = '') =>
  withPageOf(device, hash, async (page) => {
    if (!hash) await until('the form', () => sceneOf(page));
    await use(page);
  });

const open = (page, testId) => page.locator(`[data-testid=${testId}] > summary`).click();

/** Refuses requests, so that nothing is rendered. */
const refuse = (page, address) =>
  page.route(address, (route) =>
    route.request().method() === 'POST'
      ? route.fulfill({
          status: 422,
          contentType: 'application/problem+json',
          body: JSON.stringify({ title: 'Not now', status: 422 }),
        })
      : route.continue(),
  );

/** The next job request that the page sends, without being answered by a job. */
async function requested(page) {
  await refuse(page, /\/v1\/jobs$/);
  const sent = page.waitForRequest(
    (request) => request.method() === 'POST' && /\/v1\/jobs$/.test(request.url()),
  );
  await page.click('[data-testid=submit]');
  return JSON.parse((await sent).postData());
}

test('a look is saved as a preset and used for another model', { timeout: 120_000 }, () =>
  withPage(async (page) => {
    await page.selectOption('[data-testid=size]', '5');
    await page.selectOption('[data-testid=ground]', 'catcher');
    await page.getByTestId('shadow-strength').fill('40');
    await open(page, 'presets');
    await page.fill('[data-testid=preset-name]', 'shop');
    await page.click('[data-testid=preset-save]');
    await page.reload();
    await until('the form', () => sceneOf(page));
    await page.selectOption('[data-testid=scene]', 'furnace');
    assert.equal(await page.inputValue('[data-testid=ground]'), 'none');
    await open(page, 'presets');
    await page.selectOption('[data-testid=preset]', 'shop');
    assert.equal(await page.inputValue('[data-testid=ground]'), 'catcher');
    const body = await requested(page);
    assert.equal(body.scene, 'furnace');
    assert.deepEqual([body.film.width, body.film.height], [1000, 1000]);
    assert.equal(body.ground.shadow.strength, 0.4);
  }),
);

test('members without a field of their own can be set', { timeout: 120_000 }, () =>
  withPage(async (page) => {
    await page.getByText('Advanced settings').click();
    const set = async (name, value) => {
      await page.getByLabel('Other setting').selectOption(name);
      await page.getByLabel(name, { exact: true }).fill(value);
    };
    await set('retention_seconds', '60');
    await set('film.filter.radius', '2');
    const help = await page.getByTestId('other-settings').textContent();
    assert.match(help, /Time after its end at which the job and its files are deleted/);
    const body = await requested(page);
    assert.equal(body.retention_seconds, 60);
    assert.equal(body.film.filter.radius, 2);
    assert.equal(body.film.width, 960);
  }),
);

test('an environment map that was sent can be chosen again', { timeout: 120_000 }, () =>
  withPage(async (page) => {
    await drop(page, [{ name: 'hall.hdr', bytes: panorama() }]);
    await page.getByText('Lighting set to hall.hdr').waitFor();
    await page.reload();
    await until('the form', () => sceneOf(page));
    await page.getByLabel('Environment light').selectOption('file');
    await page.selectOption('[data-testid=sent-earlier]', { label: 'hall.hdr' });
    assert.match((await requested(page)).environment.asset, /^[0-9a-f]{64}$/);
  }),
);

test('a broken environment map is refused when it is sent', { timeout: 120_000 }, () =>
  withPage(async (page) => {
    await drop(page, [{ name: 'hall.hdr', bytes: panorama().subarray(0, -1) }]);
    await page
      .locator('.drop-zone [role=alert]')
      .getByText(/cut short/)
      .waitFor();
    assert.notEqual(await page.getByLabel('Environment light').inputValue(), 'file');
  }),
);

test('no environment is sent before a map is chosen', { timeout: 120_000 }, () =>
  withPage(async (page) => {
    const wrong = [];
    page.on('request', (request) => {
      if (/"asset":""/.test(request.postData() ?? '')) wrong.push(request.url());
    });
    await page.getByTestId('compose').click();
    await page.getByLabel('Environment light').selectOption('file');
    await page.waitForTimeout(1500);
    assert.deepEqual(wrong, []);
  }),
);

test('the lens and its focus are set beside the camera', { timeout: 120_000 }, () =>
  withPage(
    async (page) => {
      await until('the numbers', () => page.$('[data-testid=camera-numbers]'));
      await open(page, 'camera-numbers');
      await page.fill('[data-testid=aperture]', '25');
      await page.fill('[data-testid=focus]', '2.5');
      await page.press('[data-testid=focus]', 'Tab');
      const { camera } = await requested(page);
      assert.deepEqual([camera.aperture_radius, camera.focus_distance], [0.025, 2.5]);
    },
    desktop,
    '#/compose/cornell-box',
  ),
);

test(
  'the time of the sun is local, and the hours of a day are a series',
  { timeout: 120_000 },
  () =>
    withPage(
      async (page) => {
        await page.getByLabel('Environment light').selectOption('sun');
        await page.getByLabel('Date and time (Asia/Tokyo)').fill('2026-06-21T20:30');
        await open(page, 'series-fields');
        await page.selectOption('[data-testid=day-minutes]', '60');
        await refuse(page, /\/v1\/batches$/);
        const sent = page.waitForRequest((request) => /\/v1\/batches$/.test(request.url()));
        await page.click('[data-testid=submit]');
        const { template, matrix } = JSON.parse((await sent).postData());
        // Tokyo is nine hours ahead, all year.
        assert.equal(template.environment.sun.time, '2026-06-21T11:30:00Z');
        assert.deepEqual(matrix['environment.sun.time'], [
          '2026-06-21T11:30:00Z',
          '2026-06-21T12:30:00Z',
          '2026-06-21T13:30:00Z',
          '2026-06-21T14:30:00Z',
        ]);
      },
      { ...desktop, timezoneId: 'Asia/Tokyo' },
    ),
);

test('a transparent preview has a checkerboard beneath', { timeout: 120_000 }, () =>
  withPage(
    async (page) => {
      const back = () =>
        page.$eval('canvas.viewfinder', (canvas) => getComputedStyle(canvas).backgroundImage);
      assert.equal(await back(), 'none');
      await page.selectOption('[data-testid=background]', 'transparent');
      await until('squares', async () => /conic/.test(await back()));
    },
    desktop,
    '#/compose/cornell-box',
  ),
);

test('the strip of renders is one stop of the Tab key', { timeout: 120_000 }, async () => {
  const request = {
    scene: 'furnace',
    film: { width: 16, height: 16 },
    stop: { samples_per_pixel: 1 },
  };
  for (let i = 0; i < 3; ++i)
    await ask(`${server.url}/v1/jobs`, {
      method: 'POST',
      headers: { 'content-type': 'application/json', prefer: 'wait=20' },
      body: JSON.stringify({ ...request, seed: i }),
    });
  await withPage(async (page) => {
    const links = page.locator('.filmstrip ol a');
    await until('the strip', async () => (await links.count()) >= 3);
    const stops = () => page.locator('.filmstrip ol a[tabindex="0"]').count();
    await settles('stops', stops, 1);
    await page.locator('.filmstrip ol a[tabindex="0"]').focus();
    const at = () => page.evaluate(() => document.activeElement.getAttribute('href'));
    const first = await at();
    await page.keyboard.press('ArrowRight');
    assert.notEqual(await at(), first);
    await page.keyboard.press('Home');
    assert.equal(await at(), await links.first().getAttribute('href'));
  });
});

test('the denoised image is off, mixed or full', { timeout: 120_000 }, async () => {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json', prefer: 'wait=20' },
    body: JSON.stringify({
      scene: 'cornell-box',
      film: { width: 64, height: 64 },
      stop: { samples_per_pixel: 8 },
    }),
  });
  const { id } = await answer.json();
  await withPage(
    async (page) => {
      // The answer is held back: the job has ended, and its image is being denoised.
      const held = [];
      await page.route(/denoise=/, (way) => void held.push(way));
      await page.reload();
      await until('a word', async () =>
        /Denoising/.test(await page.textContent('[data-testid=denoising]')),
      );
      await page.unroute(/denoise=/);
      for (const way of held) await way.continue().catch(() => undefined);
      await page.waitForSelector('[data-testid=denoised]');
      await settles('no word', () => page.textContent('[data-testid=denoising]'), '');
      const full = page.waitForRequest(/denoise=full/);
      await page.selectOption('[data-testid=denoise-mode]', 'full');
      await full;
      await page.getByTestId('denoise').uncheck();
      await settles('the plain image', () => page.locator('[data-testid=denoised]').count(), 0);
    },
    desktop,
    `#/jobs/${id}`,
  );
});

test('a photometric file is shown in a room', { timeout: 120_000 }, () =>
  withPage(async (page) => {
    // LM-63: one lamp, two vertical angles, one horizontal angle, 100 cd down and to the side.
    const bytes = Buffer.from(
      'IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n100 100\n',
    );
    await drop(page, [{ name: 'down light.ies', bytes }]);
    await page.getByText('down light is ready to render.').waitFor();
    const { lights } = await (
      await ask(`${server.url}/v1/scenes/${await sceneOf(page)}`)
    ).json();
    assert.equal(lights.length, 1);
  }),
);
