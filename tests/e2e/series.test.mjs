// A series from the form to its archive.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';
import {
  accessibilityFaults,
  desktop,
  drop,
  movingGlb,
  phone,
  pictureNow,
  sceneOf,
  serverAndBrowser,
  settles,
  until,
} from './harness.mjs';

// The mock server makes no batches.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const { server, withPage } = serverAndBrowser({ skip });

const stateOf = (page) => page.textContent('[data-testid=series-state]');

/** Selects this number of views, with small images, and presses Render. */
async function submitSeries(page, views) {
  await until('scenes in the list', () => sceneOf(page));
  await page.selectOption('[data-testid=scene]', 'glass');
  await page.selectOption('[data-testid=size]', 'custom');
  await page.fill('[data-testid=width]', '48');
  await page.fill('[data-testid=height]', '32');
  await page.fill('[data-testid=stop-samples]', '4');
  await page.click('[data-testid=series-fields] summary');
  await page.fill('[data-testid=views]', String(views));
  const button = page.getByTestId('submit');
  await settles('what is rendered', () => button.textContent(), `Render ${views} images`);
  await button.click();
  await page.waitForURL(/#\/series\//);
}

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`a turntable is rendered, downloaded and deleted on a ${name}`, { skip, timeout: 300_000 }, () =>
    withPage(device, '#/jobs', async (page) => {
      await submitSeries(page, 3);
      await until('the end', async () => /^Finished/.test(await stateOf(page)));
      const names = page.locator('.job-card strong');
      await settles('all views', () => names.allTextContents(), ['glass 0', 'glass 120', 'glass 240']);
      assert.deepEqual(await accessibilityFaults(page), []);
      const [file] = await Promise.all([
        page.waitForEvent('download'),
        page.click('[data-testid=archive]'),
      ]);
      const bytes = fs.readFileSync(await file.path());
      // The end of a zip's directory names three entries.
      const end = bytes.lastIndexOf(Buffer.from('PK\x05\x06', 'latin1'));
      assert.equal(bytes.readUInt16LE(end + 10), 3);
      await page.click('.series-video summary');
      const command = await page.textContent('[data-testid=video-command]');
      const id = page.url().split('/').at(-1);
      assert.ok(command.startsWith(`tessera batch ${id} --video turn.mp4 `), command);
      await page.goto(`${server.url}/#/jobs`);
      await page.locator('.series-links a').first().click();
      await page.waitForSelector('[data-testid=series]');
      await page.getByRole('button', { name: 'Delete', exact: true }).click();
      await page.getByRole('button', { name: 'Delete all images?' }).click();
      await page.waitForURL(/#\/jobs$/);
    }),
  );

test('the images of a turntable are averaged as frames of a video', { skip, timeout: 120_000 }, () =>
  withPage(desktop, '#/jobs', async (page) => {
    const answer = await fetch(`${server.url}/v1/batches`, {
      method: 'POST',
      headers: { 'Content-Type': 'application/json' },
      body: JSON.stringify({
        template: {
          scene: 'cornell-box',
          film: { width: 160, height: 120 },
          stop: { samples_per_pixel: 16 },
        },
        matrix: { 'camera.orbit.theta_degrees': [178, 180, 182] },
      }),
    });
    const { id } = await answer.json();
    await page.goto(`${server.url}/#/series/${id}`);
    await until('the end', async () => /^Finished/.test(await stateOf(page)));
    await page.selectOption('[data-testid=series-mode]', 'video');
    const images = page.locator('.job-card img[src*="denoise=video"]');
    await settles(
      'all frames',
      () => images.evaluateAll((all) => all.filter((one) => one.naturalWidth > 0).length),
      3,
    );
    const { flicker } = await (await fetch(`${server.url}/v1/batches/${id}`)).json();
    const percent = (value) => `${(100 * value).toPrecision(3)}%`;
    await settles(
      'the flicker',
      () => page.textContent('[data-testid=flicker]'),
      ` · flicker ${percent(flicker.relative)} (${percent(flicker.low)} to ${percent(flicker.high)})`,
    );
    assert.deepEqual(await accessibilityFaults(page), []);
    if (process.env.TESSERA_SHOTS)
      await page.screenshot({ path: `${process.env.TESSERA_SHOTS}/series-video.png` });
    await page.click('.series-video summary');
    assert.match(await page.textContent('[data-testid=video-command]'), / --denoise video /);
  }),
);

test('the settings of a render are shown, used again and exported as commands', {
  skip,
  timeout: 300_000,
}, async () => {
  const request = {
    scene: 'glass',
    name: "Ann's glass",
    seed: 7,
    camera: { orbit: { theta_degrees: 40 }, vertical_fov_degrees: 30 },
    film: { width: 48, height: 32, filter: { type: 'box' } },
    integrator: { max_depth: 5 },
    estimator: { mis: { type: 'balance' } },
    stop: { relative_error: 0.5, samples_per_pixel: 8 },
  };
  const post = (body) =>
    fetch(`${server.url}/v1/jobs`, {
      method: 'POST',
      headers: { 'content-type': 'application/json' },
      body: JSON.stringify(body),
    }).then((r) => r.json());
  const job = await post(request);
  await withPage(desktop, `#/jobs/${job.id}`, async (page) => {
    const settings = page.getByTestId('settings');
    await settings.waitFor();
    assert.match(await settings.textContent(), /integrator max depth5/);
    await settings.locator('summary').click();
    const text = page.getByTestId('text');
    // The displayed request creates the same job.
    assert.deepEqual((await post(JSON.parse(await text.textContent()))).spec, job.spec);
    for (const [kind, words] of [
      ['curl', /^curl http.*Ann'\\''s glass/s],
      ['command', /^tessera submit --server .*--job \/dev\/stdin/],
      ['python', /client\.submit\("glass", request=\{/],
    ]) {
      await page.selectOption('[data-testid=text-kind]', kind);
      assert.match(await text.textContent(), words);
    }
    assert.deepEqual(await accessibilityFaults(page), []);
    await page.click('[data-testid=use-again]');
    const sent = page.waitForRequest((r) => r.method() === 'POST' && /\/v1\/jobs$/.test(r.url()));
    await until('the camera', async () =>
      /Custom view/.test(await page.textContent('.submit-form')),
    );
    await page.click('[data-testid=submit]');
    const again = (await sent).postDataJSON();
    assert.deepEqual(
      [again.scene, again.name, again.seed, again.film.width, again.film.filter.type],
      ['glass', "Ann's glass", 7, 48, 'box'],
    );
    assert.equal(again.integrator.max_depth, 5);
    assert.equal(again.estimator.mis.type, 'balance');
    assert.deepEqual([again.stop.samples_per_pixel, again.stop.relative_error], [8, 0.5]);
    assert.equal(again.camera.vertical_fov_degrees, 30);
  });
});

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`an animation becomes blurred frames on a polished ground on a ${name}`, {
    skip,
    timeout: 300_000,
  }, () =>
    withPage(device, '#/jobs', async (page) => {
      await until('scenes in the list', () => sceneOf(page));
      await drop(page, [{ name: 'moving.glb', bytes: movingGlb() }]);
      await until('the upload', async () => /^[0-9a-f]{64}$/.test(await sceneOf(page)));
      await page.selectOption('[data-testid=size]', 'custom');
      await page.fill('[data-testid=width]', '48');
      await page.fill('[data-testid=height]', '32');
      await page.fill('[data-testid=stop-samples]', '4');
      await page.selectOption('[data-testid=ground]', 'catcher');
      await page.fill('[data-testid=ground-reflection]', '100');
      await page.click('[data-testid=series-fields] summary');
      await page.fill('[data-testid=frames]', '3');
      await page.fill('[data-testid=frames-per-second]', '4');
      await page.getByText('Advanced settings').click();
      await page.fill('[data-testid=time-seconds]', '0.25');
      await page.fill('[data-testid=shutter-seconds]', '0.125');
      assert.deepEqual(await accessibilityFaults(page), []);
      const sent = page.waitForRequest(
        (r) => r.method() === 'POST' && /\/v1\/batches$/.test(r.url()),
      );
      await settles(
        'what is rendered',
        () => page.getByTestId('submit').textContent(),
        'Render 3 images',
      );
      await page.click('[data-testid=submit]');
      const { template, matrix } = (await sent).postDataJSON();
      assert.deepEqual(matrix, { time_seconds: [0.25, 0.5, 0.75] });
      assert.equal(template.shutter_seconds, 0.125);
      assert.deepEqual(template.ground, { type: 'catcher', reflection: 1 });
      await page.waitForURL(/#\/series\//);
      await until('the end', async () => /^Finished/.test(await stateOf(page)));
      const names = page.locator('.job-card strong');
      await settles('all frames', () => names.allTextContents(), [
        'moving 0.25 s',
        'moving 0.5 s',
        'moving 0.75 s',
      ]);
      // Their settings can be used again.
      await names.first().click();
      await page.click('[data-testid=use-again]');
      const again = page.waitForRequest(
        (r) => r.method() === 'POST' && /\/v1\/jobs$/.test(r.url()) && !r.postDataJSON().class,
      );
      await page.click('[data-testid=submit]');
      const job = (await again).postDataJSON();
      assert.deepEqual(
        [job.time_seconds, job.shutter_seconds, job.ground.type, job.ground.reflection],
        [0.25, 0.125, 'catcher', 1],
      );
    }),
  );

test('errors of a series are shown at their fields', { skip, timeout: 120_000 }, () =>
  withPage(desktop, '#/jobs', async (page) => {
    await until('scenes in the list', () => sceneOf(page));
    await page.click('[data-testid=series-fields] summary');
    await page.fill('[data-testid=views]', '2');
    await page.fill('[data-testid=stop-samples]', '70000');
    await page.click('[data-testid=submit]');
    await page.waitForSelector('.stop .wrong:not(:empty)');
    assert.match(await page.textContent('.stop .wrong'), /70000 is outside/);
  }),
);

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`a camera, its crop and its light are placed by hand and by numbers on a ${name}`, {
    skip,
    timeout: 120_000,
  }, () =>
    withPage(device, '#/compose/glass', async (page) => {
      await page.waitForSelector('.compose .toolbar > .exposure input:enabled');
      await page.selectOption('[data-testid=size]', 'custom');
      await page.fill('[data-testid=width]', '48');
      await page.fill('[data-testid=height]', '32');
      await page.fill('[data-testid=stop-samples]', '4');
      await page.getByLabel('Environment light').selectOption('studio');
      await page.getByTestId('environment-rotation').fill('90');
      await page.getByTestId('environment-strength').fill('1');
      await page.click('[data-testid=compose-crop]');
      const layer = await page.getByTestId('crop-layer').boundingBox();
      // The image in the middle of its layer, as large as fits.
      const scale = Math.min(layer.width / 48, layer.height / 32);
      const at = (x, y) => [
        layer.x + layer.width / 2 + (x - 24) * scale,
        layer.y + layer.height / 2 + (y - 16) * scale,
      ];
      await page.mouse.move(...at(12, 8));
      await page.mouse.down();
      await page.mouse.move(...at(20, 12));
      await page.mouse.move(...at(36, 24));
      await page.mouse.up();
      await page.click('[data-testid=camera-numbers] summary');
      const value = (id) => page.getByTestId(id).inputValue();
      const drawn = ['x', 'y', 'width', 'height'].map((member) => `crop-${member}`);
      const crop = () => Promise.all(drawn.map(async (id) => Number(await value(id))));
      await settles('the crop', crop, [12, 8, 24, 16]);
      await page.fill('[data-testid=crop-width]', '20');
      await page.fill('[data-testid=position-y]', '1.25');
      await page.fill('[data-testid=fov]', '30');
      assert.deepEqual(await accessibilityFaults(page), []);
      // The estimated cost is shown next to the button before it is pressed.
      await until('an estimate', async () =>
        /^About .* on an idle server/.test(await page.textContent('[data-testid=cost]')),
      );
      const sent = page.waitForRequest(
        (r) => r.method() === 'POST' && /\/v1\/jobs$/.test(r.url()) && !r.postDataJSON().class,
      );
      await page.click('[data-testid=submit]');
      const { camera, film, environment } = (await sent).postDataJSON();
      assert.deepEqual(film.crop, { x: 12, y: 8, width: 20, height: 16 });
      assert.equal(camera.position[1], 1.25);
      assert.equal(camera.vertical_fov_degrees, 30);
      assert.deepEqual(environment, { preset: 'studio', intensity: 2, rotation_degrees: 90 });
      await page.waitForURL(/#\/jobs\//);
    }),
  );

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`two renders can be distinguished, and several selected at once on a ${name}`, {
    skip,
    timeout: 120_000,
  }, async () => {
    const tag = `Many ${name}`;
    const post = (seed) =>
      fetch(`${server.url}/v1/jobs`, {
        method: 'POST',
        headers: { 'content-type': 'application/json' },
        body: JSON.stringify({
          scene: 'glass',
          name: tag,
          seed,
          film: { width: 48, height: 32 },
          stop: { samples_per_pixel: 4 },
        }),
      }).then((r) => r.json());
    const [a, b] = [await post(1), await post(2)];
    const job = (id) => fetch(`${server.url}/v1/jobs/${id}`).then((r) => r.json());
    for (const { id } of [a, b])
      await until('its end', async () => (await job(id)).state === 'finished');
    await withPage(device, `#/compare/${a.id}/${b.id}`, async (page) => {
      const rows = page.locator('[data-testid=compare-settings] tbody tr');
      await settles('what differs', () => rows.allTextContents(), ['seed12']);
      assert.deepEqual(await accessibilityFaults(page), []);
      // Their errors in one plot, with the numbers of all.
      await page.getByRole('link', { name: 'Plot errors' }).click();
      await settles('both curves', () => page.locator('.convergence .lab-fit').count(), 2);
      await page.getByRole('button', { name: 'CPU seconds' }).click();
      await page.waitForSelector('[aria-label^="Relative error over CPU seconds"]');
      assert.deepEqual(await accessibilityFaults(page), []);
      const saved = async (button) => {
        const [kept] = await Promise.all([
          page.waitForEvent('download'),
          page.getByRole('button', { name: button }).click(),
        ]);
        return fs.readFileSync(await kept.path(), 'utf8');
      };
      const lines = (await saved('Save CSV')).trim().split('\n');
      assert.match(lines[0], /^job,name,samples_per_pixel,elapsed_seconds,cpu_seconds/);
      assert.deepEqual(
        [...new Set(lines.slice(1).map((line) => line.split(',')[0]))],
        [a.id, b.id],
      );
      assert.match(await saved('Save SVG'), /^<svg [^]*<polyline[^]*<polyline/);
      await page.goto(`${server.url}/#/jobs?find=${encodeURIComponent(tag)}`);
      await settles('both', () => page.locator('.job-card').count(), 2);
      await page.click('[data-testid=choose-many]');
      await page.getByRole('button', { name: 'Select all' }).click();
      await page.waitForSelector('[data-testid=chosen-convergence]:enabled');
      assert.deepEqual(await accessibilityFaults(page), []);
      const [file] = await Promise.all([
        page.waitForEvent('download'),
        page.click('[data-testid=chosen-download]'),
      ]);
      const bytes = fs.readFileSync(await file.path());
      assert.deepEqual(
        [bytes.readUInt16LE(bytes.length - 12), bytes.includes(`${tag} 2.png`)],
        [2, true],
      );
      const bar = page.getByTestId('chosen');
      await bar.getByRole('button', { name: 'Delete (2)' }).click();
      await bar.getByRole('button', { name: 'Delete 2 permanently?' }).click();
      await until('no more', async () => (await job(a.id)).status === 404);
    });
  });

test('every job of a series shows an image from its first pass on', {
  skip,
  timeout: 120_000,
}, async () => {
  const send = async (path, body) =>
    (
      await fetch(`${server.url}${path}`, {
        method: 'POST',
        headers: { 'content-type': 'application/json' },
        body: JSON.stringify(body),
      })
    ).json();
  const { id } = await send('/v1/batches', {
    template: {
      scene: 'glass',
      film: { width: 48, height: 32 },
      stop: { samples_per_pixel: 65536 },
    },
    matrix: { seed: [1, 2, 3] },
  });
  await withPage(desktop, `#/series/${id}`, async (page) => {
    const images = page.locator('.job-card img');
    await settles('an image each', () => images.count(), 3);
    for (const image of await images.all())
      await until('its pixels', () => image.evaluate((each) => each.naturalWidth === 48));
    assert.match(await stateOf(page), /^Rendering/);
  });
  await send(`/v1/batches/${id}/cancel`);
});

/** Waits until an image is there, within Playwright's time, and returns its width. */
async function shown(page, image) {
  const width = await page.waitForFunction(
    (element) => element.complete && element.naturalWidth,
    await image.elementHandle(),
  );
  return width.jsonValue();
}

test('a scene is selected by its image, and a render is shown before its tiles arrive', {
  skip,
  timeout: 120_000,
}, async () => {
  const answer = await fetch(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify({
      scene: 'glass',
      film: { width: 48, height: 32 },
      stop: { samples_per_pixel: 4 },
    }),
  });
  const { id } = await answer.json();
  const job = async () => (await fetch(`${server.url}/v1/jobs/${id}`)).json();
  await until('its end', async () => (await job()).state === 'finished');
  await withPage(desktop, '#/jobs', async (page) => {
    const { scenes } = await (await fetch(`${server.url}/v1/server`)).json();
    await page.click('[data-testid=scene-gallery]');
    for (const { name } of scenes) await shown(page, page.locator(`[data-scene="${name}"] img`));
    assert.deepEqual(await accessibilityFaults(page), []);
    await page.click('[data-scene="many-lights"]');
    await settles('the scene', () => sceneOf(page), 'many-lights');
    await settles('the list', () => page.locator('dialog[open]').count(), 0);
    // The server's image is withheld: tiles are not asked for before it is shown.
    const asked = [];
    let withheld = null;
    page.on('request', (r) => /\/(image\.jpg|tiles)\?/.test(r.url()) && asked.push(r.url()));
    await page.route(/\/image\.jpg/, (way) => void (withheld = way), { times: 1 });
    await page.goto(`${server.url}/#/jobs/${id}`);
    await until('a question for the image', () => withheld);
    await page.waitForTimeout(500);
    assert.ok(asked.every((url) => /image\.jpg/.test(url)), asked.join(' '));
    assert.equal(await pictureNow(page), null);
    await withheld.continue();
    await until('the tiles', () => pictureNow(page));
    // Tiles are withheld: the server's image is shown all the same.
    const held = [];
    let holds = true;
    await page.route(/\/tiles/, (way) => (holds ? void held.push(way) : way.continue()));
    await page.reload();
    const look = page.getByTestId('first-look');
    await look.waitFor();
    assert.equal(await shown(page, look), 48);
    // Without alpha a faster format is used; tests/api/images_test.py has the same query.
    const src = new URL(await look.getAttribute('src'), server.url);
    assert.match(src.pathname, /image\.jpg$/);
    assert.equal(src.search, '?exposure=auto&tonemap=khronos-neutral');
    await until('a question for tiles', () => held.length > 0);
    holds = false;
    // A request that the page has abandoned meanwhile is sent again.
    for (const way of held) await way.continue().catch(() => undefined);
    await settles('tiles instead', () => look.count(), 0);
  });
});
