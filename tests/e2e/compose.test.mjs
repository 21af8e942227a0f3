// The view in which a camera is placed: its content, its address, and its behaviour after reloads
// and lost connections.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  desktop,
  drop,
  isOther,
  pictureNow,
  sceneOf,
  serverAndBrowser,
  triangleFiles,
  until,
} from './harness.mjs';

const { server, openPage, withPage: withPageOf } = serverAndBrowser();

const withPage = (hash, use) => withPageOf(desktop, hash, use);
const hashOf = (page) => new URL(page.url()).hash;
const rest = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Bodies of the page's preview requests, as they are sent. */
function previewsOf(page) {
  const asked = [];
  page.on('request', (r) => {
    if (r.method() === 'POST' && /\/v1\/jobs$/.test(r.url())) asked.push(r.postDataJSON());
  });
  return asked;
}

/** Waits until the start position of a camera placed by hand is known. */
const canTurn = (page) => page.waitForSelector('.compose .toolbar > .exposure input:enabled');

/** Changes of the address from now on. */
const watchAddress = (page) =>
  page.evaluate(() => {
    globalThis.moves = 0;
    for (const name of ['pushState', 'replaceState']) {
      const whole = history[name].bind(history);
      history[name] = (...all) => ((globalThis.moves += 1), whole(...all));
    }
    addEventListener('hashchange', () => (globalThis.moves += 1));
  });

test('the form and the address of a placed camera agree on the scene', { timeout: 120_000 }, () =>
  withPage('#/settings', async (page) => {
    await page.evaluate(() => (location.hash = '#/compose/glass'));
    await until('glass', async () => (await sceneOf(page)) === 'glass');
    await page.selectOption('[data-testid=scene]', 'cornell-box');
    await until('its address', () => hashOf(page) === '#/compose/cornell-box');
    await watchAddress(page);
    await page.evaluate(() => (location.hash = '#/compose/glass'));
    await until('glass again', async () => (await sceneOf(page)) === 'glass');
    await rest(1500);
    assert.equal(hashOf(page), '#/compose/glass');
    assert.ok((await page.evaluate(() => globalThis.moves)) <= 2);
    await page.goBack();
    await until('the box', async () => (await sceneOf(page)) === 'cornell-box');
    await rest(1000);
    assert.equal(hashOf(page), '#/compose/cornell-box');
    // The scene selected in the form has replaced the previous one.
    await page.goBack();
    await page.waitForSelector('h1:text-is("Settings")');
  }),
);

test('the address stores a placed camera, which survives a reload', { timeout: 120_000 }, () =>
  withPage('#/compose/cornell-box', async (page) => {
    await until('the preview', () => pictureNow(page));
    assert.ok(!/pose=/.test(hashOf(page)));
    await canTurn(page);
    await page.locator('.stage').focus();
    await page.keyboard.press('ArrowLeft'); // Of several, the address may show the first.
    const link = await until('the pose', () => /pose=/.test(hashOf(page)) && hashOf(page));
    const asked = previewsOf(page);
    await page.reload();
    const posed = await until('its preview', () => asked.find((r) => r.camera?.position));
    assert.ok(link.includes(posed.camera.position.join(',')), `${link} ${posed.camera.position}`);
    assert.equal(hashOf(page), link);
    await page.click('[data-testid=compose-reset]');
    await until('the address without it', () => hashOf(page) === '#/compose/cornell-box');
    // Another link selects another camera, even if the view is open.
    await page.evaluate((hash) => (location.hash = hash), link);
    await until('the pose again', () => page.isEnabled('[data-testid=compose-reset]'));
    await page.evaluate(() => (location.hash = '#/compose/cornell-box?pose=1,2,nothing'));
    await page.waitForSelector('[data-testid=picture]');
  }),
);

for (const [size, name] of [
  ['5', 'square'],
  ['9', 'portrait'],
])
  test(`a ${name} preview is shown completely`, { timeout: 120_000 }, () =>
    withPage('#/compose/cornell-box', async (page) => {
      await until('the preview', () => pictureNow(page));
      await page.selectOption('[data-testid=size]', size);
      await until('the new shape', () => pictureNow(page));
      const [canvas, stage] = await Promise.all(
        ['picture', null].map((id) =>
          (id ? page.getByTestId(id) : page.locator('.stage-orbit')).boundingBox(),
        ),
      );
      assert.ok(canvas.height <= stage.height + 1, `${canvas.height} in ${stage.height}`);
      assert.ok(canvas.width <= stage.width + 1, `${canvas.width} in ${stage.width}`);
    }),
  );

/** One triangle with an orthographic camera and one that is turned on its side. */
function filmed() {
  const files = triangleFiles();
  const document = JSON.parse(files[0].bytes.toString());
  document.cameras = [
    { type: 'orthographic', orthographic: { xmag: 2, ymag: 2, zfar: 100, znear: 0.01 } },
    { type: 'perspective', perspective: { yfov: 0.8, znear: 0.01 } },
  ];
  document.nodes.push(
    { name: 'flat', translation: [0, 0.8, 4], camera: 0 },
    { name: 'turned', translation: [0, 0.8, 4], rotation: [0, 0, 0.5, Math.sqrt(0.75)], camera: 1 },
  );
  document.scenes[0].nodes.push(1, 2);
  return [{ name: 'filmed.gltf', bytes: Buffer.from(JSON.stringify(document)) }, files[1]];
}

const readsModels = process.env.TESSERA_URL || process.env.TESSERA_BINARY;
const filmedTest = { timeout: 120_000, skip: readsModels ? false : 'the mock server reads no model' };

test('the preview uses the file’s camera until it is rotated', filmedTest, () =>
  withPage('', async (page) => {
    const asked = previewsOf(page);
    await drop(page, filmed());
    await page.waitForURL(/#\/compose\/[0-9a-f]{64}$/);
    await until('a preview', () => asked.length > 0 && pictureNow(page));
    assert.ok(asked.every((r) => r.camera === undefined));
    await page.getByText('The file’s camera is orthographic').waitFor();
    const cameras = page.getByLabel('Camera', { exact: true });
    const names = await until('both cameras', async () => {
      const all = await cameras.locator('option').evaluateAll((list) => list.map((o) => o.value));
      return all.length === 3 ? all : null;
    });
    await cameras.selectOption(names.at(-1));
    await until('the other camera', () => asked.at(-1).camera);
    assert.ok(!asked.at(-1).camera.position);
    await page.getByText('Drag to orbit').waitFor();
    // Its field of view of 0.8 radians: the start position is known.
    await page.waitForSelector('output:text-is("46°")');
    await page.locator('.stage').focus();
    await page.keyboard.press('+');
    const { camera } = await until('a pose', () => asked.at(-1).camera?.position && asked.at(-1));
    // It was rotated by 60 degrees about its axis: the right side is now at the top.
    const expected = [-Math.sqrt(0.75), 0.5, 0];
    assert.ok(
      camera.up.every((v, i) => Math.abs(v - expected[i]) < 1e-3),
      String(camera.up),
    );
  }),
);

test(
  'the preview recovers when the server returns',
  {
    timeout: 300_000,
    skip: server.canRestart ? false : 'a server elsewhere (TESSERA_URL) cannot be restarted from here',
  },
  async () => {
    const page = await openPage(desktop, '#/compose/cornell-box');
    const first = await until('the preview', () => pictureNow(page));
    await canTurn(page);
    await server.kill();
    await page.locator('.stage').focus();
    await page.keyboard.press('ArrowLeft');
    const notice = page.getByText('Reconnecting…', { exact: true });
    await notice.waitFor();
    assert.equal(await page.getByText('cannot be made').count(), 0);
    await server.start(Number(new URL(server.url).port));
    await until('the turned preview', () => isOther(page, first));
    await until('no notice', async () => !(await notice.count()));
    assert.deepEqual(page.faults, []);
    await page.context().close();
  },
);
