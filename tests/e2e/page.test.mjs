import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { test } from 'node:test';
import {
  accessibilityFaults,
  accessKey,
  ask,
  desktop,
  drop,
  glowingGlb,
  isOther,
  moving,
  panorama,
  phone,
  pictureNow,
  sceneOf,
  Server,
  serverAndBrowser,
  settles,
  submit,
  triangleFiles,
  triangleGlb,
  until,
} from './harness.mjs';

const { server, newContext, openPage, withPage: withPageOf } = serverAndBrowser();

const text = (page, id) => page.textContent(`[data-testid=${id}]`);
const finished = (page) =>
  until('the render to finish', async () => /^Finished/.test(await text(page, 'state')), 240_000);
const choose = (page, view) => page.check(`[data-testid=view-${view}]`, { force: true });

const withPage = (device, use, hash) => withPageOf(device, hash, use);

let shared = null;
/** The address of a finished render that tests do not change; rendered once for all of them. */
const renderedOnce = () =>
  (shared ??= (async () => {
    const body = {
      scene: 'cornell-box',
      film: { width: 480, height: 270 },
      stop: { samples_per_pixel: 32 },
    };
    const answer = await ask(`${server.url}/v1/jobs`, {
      method: 'POST',
      headers: { 'content-type': 'application/json' },
      body: JSON.stringify(body),
    });
    const { id } = await answer.json();
    const job = async () => (await ask(`${server.url}/v1/jobs/${id}`)).json();
    await until('the shared render', async () => (await job()).state === 'finished');
    return `#/jobs/${id}`;
  })());
const withRender = async (device, use) => withPage(device, use, await renderedOnce());

test(
  'Render shows an image that changes while it converges',
  { timeout: 300_000 },
  () =>
    withPage(moving, async (page) => {
      await submit(page, { scene: 'cornell-box', size: '0', samples: 48 });
      const early = await until('the first tiles', () => pictureNow(page));
      await finished(page);
      const late = await until('the whole picture', async () => {
        const now = await pictureNow(page);
        return now?.share === 1 ? now : null;
      });
      assert.notEqual(early.hash, late.hash);
      const interval = /\d+(\.\d+)?% to \d+(\.\d+)?% with 95% confidence/;
      await until('the interval', async () => interval.test(await text(page, 'error')));
    }),
);

test('on a phone the new image is in view', { timeout: 300_000 }, () =>
  withPage(phone, async (page) => {
    await submit(page, { scene: 'cornell-box', samples: 8 });
    await until('the picture', () => pictureNow(page));
    const inSight = () =>
      page.getByTestId('picture').evaluate((canvas) => {
        const { top, bottom } = canvas.getBoundingClientRect();
        return top >= 0 && bottom <= innerHeight;
      });
    await until('the picture in sight', inSight);
  }),
);

test('tiles contain only means until errors are viewed', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    const asked = [];
    page.on('request', (request) => {
      const planes = /\/tiles\?.*planes=(\w+)/.exec(request.url());
      if (planes) asked.push(planes[1]);
    });
    await submit(page, { scene: 'cornell-box', samples: 16 });
    await finished(page);
    const { hash } = await until('the picture', () => pictureNow(page));
    assert.ok(asked.length > 0 && asked.every((planes) => planes === 'mean'), asked.join());
    await choose(page, 'variance');
    await until('all planes', () => asked.includes('all'));
    await until('variances', async () => {
      const now = await pictureNow(page);
      return now && now.hash !== hash;
    });
  }),
);

test('each measuring view shows a different image with a legend', { timeout: 300_000 }, () =>
  withRender(desktop, async (page) => {
    await finished(page);
    const seen = new Set([(await until('the picture', () => pictureNow(page))).hash]);
    for (const view of ['error', 'tile-error', 'variance', 'samples']) {
      await choose(page, view);
      await page.waitForSelector('[data-testid=legend]');
      // They show numbers, not colours.
      for (const id of ['exposure', 'tone'])
        await settles(id, () => page.isDisabled(`[data-testid=${id}]`), true);
      const hash = await until(`the ${view} view`, async () => {
        const now = await pictureNow(page);
        return now && !seen.has(now.hash) ? now.hash : null;
      });
      seen.add(hash);
    }
    for (const layer of ['albedo', 'normal', 'depth']) {
      await choose(page, layer);
      await page.waitForFunction((name) => {
        const image = document.querySelector('.server-image');
        return image?.dataset.layer === name && image.complete && image.naturalWidth === 480;
      }, layer);
    }
    // The scene is 0.55 m deep, and its camera is in front of it.
    const [, near, far] = /Black is ([\d.]+) m, white ([\d.]+) m/.exec(
      await page.textContent('.layer-note'),
    );
    assert.ok(near > 0.1 && far - near > 0.3 && far < 5, `${near} to ${far}`);
  }),
);

test('exposure changes the plain image without a request, the denoised one with one', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await submit(page, { scene: 'cornell-box', samples: 8 });
    await finished(page);
    await page.waitForSelector('[data-testid=denoised]');
    await page.waitForTimeout(1000); // what the end of a render asks for has been asked for
    let asked = 0;
    page.on(
      'request',
      (request) =>
        (asked += /\/(image|tiles)/.test(request.url()) && !/max_size/.test(request.url()) ? 1 : 0),
    );
    const denoised = () => page.getAttribute('[data-testid=denoised]', 'src');
    const darken = async () => {
      await page.focus('[data-testid=exposure]');
      for (let i = 0; i < 5; ++i) await page.keyboard.press('ArrowLeft');
    };
    const old = await denoised();
    await darken();
    await until('a darker denoised picture', async () => (await denoised()) !== old);
    assert.ok(asked <= 2, `${asked} questions`); // steps that rest for 250 ms ask
    await page.click('[data-testid=denoise]');
    const before = await until('the picture', () => pictureNow(page));
    asked = 0;
    await darken();
    await until('a darker picture', () => isOther(page, before));
    assert.equal(asked, 0);
  }),
);

test('exposure follows the image until it is set', { timeout: 300_000 }, async () => {
  // A white sky of 2^10 cd/m2.
  const job = await (
    await ask(`${server.url}/v1/jobs`, {
      method: 'POST',
      headers: { 'Content-Type': 'application/json', Prefer: 'wait=60' },
      body: JSON.stringify({
        scene: 'furnace',
        film: { width: 96, height: 54 },
        environment: { color: [1024, 1024, 1024] },
        stop: { samples_per_pixel: 8 },
      }),
    })
  ).json();
  const answer = await ask(`${server.url}/v1/jobs/${job.id}/image.png?exposure=auto`);
  const told = Number(answer.headers.get('X-Tessera-Exposure'));
  assert.ok(told < -8, `${told} stops`);
  await withPage(
    desktop,
    async (page) => {
      const stops = () => page.$eval('[data-testid=exposure]', (input) => input.valueAsNumber);
      const isAuto = () => page.getAttribute('[data-testid=exposure-auto]', 'aria-pressed');
      await until('the exposure', async () => Math.abs((await stops()) - told) < 0.15);
      assert.equal(await isAuto(), 'true');
      const before = await until('the picture', () => pictureNow(page));
      await page.focus('[data-testid=exposure]');
      for (let i = 0; i < 5; ++i) await page.keyboard.press('ArrowLeft');
      await until('a darker picture', () => isOther(page, before));
      assert.equal(await isAuto(), 'false');
      await page.click('[data-testid=exposure-auto]');
      await until('the exposure again', async () => Math.abs((await stops()) - told) < 0.15);
      assert.deepEqual(await accessibilityFaults(page), []);
    },
    `#/jobs/${job.id}`,
  );
});

test('the PNG can be downloaded', { timeout: 300_000 }, () =>
  withRender(desktop, async (page) => {
    await finished(page);
    await page.click('[data-testid=download]');
    for (const format of ['png', 'jpg', 'webp', 'avif', 'exr', 'hdr', 'tif']) {
      const link = page.getByTestId(`download-${format}`);
      if (!(await link.count())) continue;
      const shown = /as shown here/.test(await link.textContent());
      assert.equal(shown, ['png', 'jpg', 'webp', 'avif'].includes(format), format);
      assert.equal(/exposure/.test(await link.getAttribute('href')), shown, format);
    }
    const [download] = await Promise.all([
      page.waitForEvent('download'),
      page.click('[data-testid=download-png]'),
    ]);
    const bytes = fs.readFileSync(await download.path());
    assert.equal(bytes.toString('latin1', 1, 4), 'PNG');
    assert.equal(bytes.readUInt32BE(16), 480);
    assert.equal(bytes.readUInt32BE(20), 270);
  }),
);

test('a GLB dropped on the page can be rendered', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await drop(page, [{ name: 'triangle.glb', bytes: triangleGlb() }]);
    await until('the model in the list', async () =>
      /^[0-9a-f]{64}$/.test(await sceneOf(page)),
    );
    await submit(page, { samples: 8 });
    await until('tiles', () => pictureNow(page));
    await finished(page);
  }),
);

test(
  'a glTF document is uploaded with its files, and missing ones are reported',
  { timeout: 300_000 },
  () =>
    withPage(desktop, async (page) => {
      const files = triangleFiles();
      await drop(page, files.slice(0, 1));
      await page.waitForSelector('.drop-zone .wrong');
      assert.match(await page.textContent('.drop-zone .wrong'), /the buffer\.bin/);
      await drop(page, files);
      await until('the model in the list', async () =>
        /^[0-9a-f]{64}$/.test(await sceneOf(page)),
      );
      // The model can be viewed from all sides immediately.
      await page.waitForURL(/#\/compose\/[0-9a-f]{64}$/);
      await submit(page, { samples: 8 });
      await page.waitForSelector('.job-title h1:text-is("triangle")');
      await until('tiles', () => pictureNow(page));
    }),
);

const converter = path.join(path.dirname(process.env.TESSERA_BINARY ?? ''), 'tessera-convert');

test(
  'an OBJ dropped with its materials is converted',
  { skip: !fs.existsSync(converter) && 'tessera-convert was not built' },
  () =>
    withPage(desktop, async (page) => {
      const obj = 'mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl glossy\nf 1 2 3\n';
      await drop(page, [
        { name: 'a.obj', bytes: Buffer.from(obj) },
        { name: 'a.mtl', bytes: Buffer.from('newmtl glossy\nKd 1 0 0\n') },
      ]);
      await page.waitForURL(/#\/compose\/[0-9a-f]{64}/);
      assert.equal(await page.getByTestId('left-out').count(), 0);
      const answer = await ask(`${server.url}/v1/scenes/${await sceneOf(page)}`);
      const scene = await answer.json();
      assert.deepEqual(scene.materials, ['glossy']);
      assert.match(scene.warnings.join(), /metres, y up/);
    }),
);

test('a model and an environment map are accepted together, and ignored files are reported', () =>
  withPage(desktop, async (page) => {
    await drop(page, [
      { name: 'sky.hdr', bytes: panorama() },
      { name: 'triangle.glb', bytes: triangleGlb() },
      { name: 'second.glb', bytes: triangleGlb() },
    ]);
    const note = page.getByTestId('left-out');
    await note.waitFor();
    assert.match(await note.textContent(), /^Left out: second\.glb\./);
    await page.waitForURL(/#\/compose\/[0-9a-f]{64}/);
    assert.equal(await page.getByLabel('Environment light').inputValue(), 'file');
    assert.match(await page.textContent('.submit-form'), /sky\.hdr/);
    await drop(page, [{ name: 'sky.hdr', bytes: panorama() }]);
    await until('no note', async () => !(await note.count()));
  }),
);

test('a model that only glows is lit by the studio, a model with a lamp by its own light', () =>
  withPage(desktop, async (page) => {
    const light = () => page.getByLabel('Environment light').inputValue();
    await drop(page, [{ name: 'glows.glb', bytes: glowingGlb(1) }]);
    await page.waitForURL(/#\/compose\/[0-9a-f]{64}/);
    await until('the studio', async () => (await light()) === 'studio');
    await page.goto(`${server.url}/#new`);
    await page.reload();
    // The page chooses the light when it has the scene.
    const found = page.waitForResponse(/\/v1\/scenes\/[0-9a-f]{64}$/);
    await drop(page, [{ name: 'lamp.glb', bytes: glowingGlb(20) }]);
    await page.waitForURL(/#\/compose\/[0-9a-f]{64}/);
    await (await found).finished();
    await page.evaluate(() => new Promise(requestAnimationFrame));
    assert.equal(await light(), 'scene');
  }),
);

test('a file dropped during an upload is uploaded after it, under its own name', () =>
  withPage(desktop, async (page) => {
    const sent = [];
    await page.route(/\/v1\/(scenes|assets)/, async (way) => {
      if (way.request().method() === 'POST') {
        sent.push(way.request().url());
        await new Promise((resolve) => setTimeout(resolve, 300));
      }
      await way.continue();
    });
    await drop(page, [{ name: 'Chair & table.glb', bytes: triangleGlb() }]);
    await drop(page, [{ name: 'sky.hdr', bytes: panorama() }]);
    await until('the second', async () => /sky\.hdr/.test(await page.textContent('.submit-form')));
    assert.equal(sent.length, 2, String(sent));
    assert.match(sent[0], /\/v1\/scenes\?name=Chair%20%26%20table$/);
    assert.equal(await page.locator('.drop-zone .wrong').count(), 0);
  }),
);

test('a file that is not a model is refused with the reason', () =>
  withPage(desktop, async (page) => {
    await drop(page, [{ name: 'broken.glb', bytes: Buffer.from('this is no model') }]);
    await page.waitForSelector('.drop-zone .wrong');
    assert.ok((await page.textContent('.drop-zone .wrong')).length > 20);
  }));

test('a refused value is shown at its field', () =>
  withPage(desktop, async (page) => {
    await page.selectOption('[data-testid=size]', 'custom');
    await page.fill('[data-testid=width]', '0');
    await page.click('[data-testid=submit]');
    const field = page.locator('.field-wrong', { has: page.locator('[data-testid=width]') });
    await field.waitFor();
    assert.match(await field.textContent(), /outside \[1, 16384\]/);
    const invalid = () => page.getAttribute('[data-testid=width]', 'aria-invalid');
    await settles('the field', invalid, 'true');
  }));

test('a job can be paused, resumed and cancelled', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await submit(page, { scene: 'cornell-box', size: '3', samples: 65536 });
    await until('tiles', () => pictureNow(page));
    await page.click('[data-testid=pause]');
    await until('the pause', async () => /Paused/.test(await text(page, 'state')));
    await page.click('[data-testid=resume]');
    await until('the resume', async () => /Rendering/.test(await text(page, 'state')));
    await page.click('[data-testid=cancel]');
    await until('the end', async () => /Cancelled/.test(await text(page, 'state')));
    // The server extends only finished jobs.
    await settles('no more', () => page.getByTestId('extend').count(), 0);
  }),
);

test('a doubted render can be tried again, a merged one can only be looked at', () =>
  withPage(desktop, async (page) => {
    const jobs = `${server.url}/v1/jobs`;
    const headers = { 'Content-Type': 'application/json' };
    const post = async (path, sent) => {
      const body = JSON.stringify(sent);
      return (await ask(server.url + path, { method: 'POST', headers, body })).json();
    };
    const render = async (seed) => {
      const film = { width: 16, height: 16 };
      const stop = { samples_per_pixel: 2 };
      const { id } = await post('/v1/jobs', { scene: 'furnace', film, stop, seed });
      return (await ask(`${jobs}/${id}?wait=25`)).json();
    };
    const shows = async (job, actions) => {
      await page.evaluate((id) => (location.hash = `#/jobs/${id}`), job.id);
      await until('the end', async () => /^Finished/.test(await text(page, 'state')));
      for (const [action, count] of Object.entries(actions))
        await settles(action, () => page.getByTestId(action).count(), count);
    };
    const one = await render(1);
    const other = await render(2);
    await shows(one, { retry: 0, extend: 1 });
    const merged = await post('/v1/films/merge', { films: [one.id, other.id] });
    assert.ok(merged.merged);
    await shows(merged, { retry: 0, extend: 0 });
    const data = JSON.stringify({ ...other, doubted: true });
    const body = `event: snapshot\ndata: ${data}\n\n`;
    await page.route(`**/v1/jobs/${other.id}/events`, (route) =>
      route.fulfill({ contentType: 'text/event-stream', body }),
    );
    await shows(other, { retry: 1, extend: 0 });
    const asked = page.waitForRequest(`${jobs}/${other.id}/retry`);
    await page.getByTestId('retry').click();
    await asked;
  }),
);

test('deleting a render needs a second press', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await submit(page, { scene: 'furnace', samples: 8 });
    await finished(page);
    const id = new URL(page.url()).hash.split('/').pop();
    const status = async () => (await ask(`${server.url}/v1/jobs/${id}`)).status;
    await page.click('[data-testid=more]');
    await page.click('[data-testid=delete]');
    await page.waitForSelector('[data-testid=delete]:has-text("permanently")');
    assert.equal(await status(), 200);
    await page.click('[data-testid=delete]');
    await until('the render to be gone', async () => (await status()) === 404);
    await until('another view', async () => !page.url().includes(id));
  }),
);

test('clicking a pixel shows its value and interval', { timeout: 300_000 }, () =>
  withRender(desktop, async (page) => {
    await finished(page);
    await until('the picture', () => pictureNow(page));
    await page.click('.stage', { position: { x: 400, y: 200 } });
    await until('the interval', async () => /±/.test(await text(page, 'inspector')));
    // Both halves of a square of pixels, for each channel, and lines for those of the pixel itself.
    const halves = page.getByTestId('halves');
    await until('the halves', async () =>
      /Both halves of 81 pixels/.test(await halves.textContent()),
    );
    await settles('a curve for each channel', () => halves.locator('polygon').count(), 3);
    await settles('lines for the pixel', () => halves.locator('line').count(), 6);
    const pixel = async () => /pixel=(\d+),(\d+)/.exec(page.url())?.slice(1).map(Number);
    const [x, y] = await until('the pixel in the address', pixel);
    await page.keyboard.press('ArrowRight');
    await until('its neighbour in the address', async () => (await pixel())?.[0] === x + 1);
    const link = new URL(page.url()).hash;
    await page.keyboard.press('Escape');
    await until('no pixel', async () => /Hover to read a pixel/.test(await text(page, 'inspector')));
    const other = await openPage(desktop, link);
    await until('the same pixel', async () =>
      (await text(other, 'inspector')).includes(`${x + 1}, ${y}`),
    );
    await other.context().close();
  }),
);

test('measurements are next to the image or directly below it', { timeout: 300_000 }, () =>
  withRender({ ...desktop, viewport: { width: 1280, height: 800 } }, async (page) => {
    await finished(page);
    const inSight = (id) =>
      page.getByTestId(id).evaluate((element) => {
        const { top, bottom, right } = element.getBoundingClientRect();
        return top >= 0 && bottom <= innerHeight && right <= innerWidth;
      });
    await until('the picture', () => pictureNow(page));
    for (const id of ['picture', 'error', 'slope', 'prediction', 'inspector'])
      await settles(`${id} in sight`, () => inSight(id), true);
    // Half the error takes three to four times the samples and the time.
    const rows = await page.locator('[data-testid=prediction] > div').allTextContents();
    assert.ok(rows.length >= 1);
    for (const row of rows) assert.match(row, /^[\d.]+% error.* more, [\d.,k ]+ samples$/);
    await page.setViewportSize(phone.viewport);
    await page.click('.stage', { position: { x: 100, y: 80 } });
    await until('the interval', async () => /±/.test(await text(page, 'inspector')));
    const top = () =>
      page.getByTestId('inspector').evaluate((e) => e.getBoundingClientRect().top < innerHeight);
    await settles('the pixel in sight', top, true);
  }),
);

test('the address of a job opens it, and an unknown one is reported', { timeout: 300_000 }, () =>
  withRender(desktop, async (page) => {
    await until('the picture', () => pictureNow(page));
    await page.goto(`${server.url}/#/jobs/00000000-0000-4000-8000-000000000000`);
    await page.waitForSelector('text=This render does not exist.');
  }),
);

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
]) {
  test(
    `WCAG 2.2 AA holds on a ${name}, and nothing is wider than the screen`,
    { timeout: 300_000 },
    () =>
      withRender(device, async (page) => {
        await finished(page);
        const job = new URL(page.url()).hash;
        for (const [hash, filled] of [
          [job, () => pictureNow(page)],
          ['#/jobs', () => page.locator('.job-card').first().isVisible()],
          ['#/settings', () => page.locator('.figures').first().isVisible()],
          ['#/compare', () => page.locator('.pick').first().isVisible()],
          ['#/compose/cornell-box', () => pictureNow(page)],
        ]) {
          await page.goto(`${server.url}/${hash}`);
          await until(`all of ${hash}`, filled);
          const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
          assert.ok(wide <= 0, `${hash} is ${wide} pixels too wide`);
          assert.deepEqual(await accessibilityFaults(page), [], hash);
        }
      }),
  );
}

// The mock server knows no keys.
if (accessKey || process.env.TESSERA_BINARY)
  test('a server with a key is locked until the key is typed or is in the address', async () => {
    const key = accessKey || 'tessera-key-of-the-browser-test';
    const locked = accessKey ? server : new Server({ key });
    try {
      await locked.start();
      for (const way of ['typed', 'address']) {
        const context = await newContext(desktop);
        const page = await context.newPage();
        const connected = () =>
          until('the way in', async () =>
            /Connected/.test(await page.textContent('.connection')),
          );
        if (way === 'typed') {
          await page.goto(locked.url);
          await page.waitForSelector('text=Access key required');
          await page.fill('#key', 'no such key');
          await page.click('.key-form button');
          await page.waitForSelector('#key-wrong:has-text("not known or has expired")');
          assert.equal(await page.getAttribute('#key', 'aria-invalid'), 'true');
          assert.match(await page.textContent('[data-testid=scene]'), /An access key is needed/);
          await page.fill('#key', key);
          await page.click('.key-form button');
        } else {
          await page.goto(`${locked.url}/#key=${encodeURIComponent(key)}`);
        }
        await connected();
        assert.ok(!page.url().includes(key), 'the key stays in the address');
        await page.reload();
        await connected();
        await context.close();
      }
    } finally {
      if (locked !== server) await locked.stop();
    }
  });

const ownsServer = !process.env.TESSERA_URL && Boolean(process.env.TESSERA_BINARY);

test(
  'the page survives a restart of the server',
  {
    timeout: 300_000,
    skip: ownsServer ? false : 'a server elsewhere (TESSERA_URL) cannot be restarted from here',
  },
  () =>
    withPage(desktop, async (page) => {
      await submit(page, { scene: 'cornell-box', size: '1', samples: 2048 });
      await until('tiles', () => pictureNow(page));
      const { port } = new URL(server.url);
      await server.kill();
      await until('word of it', async () =>
        /Reconnecting/.test(await page.textContent('.job-header')),
      );
      await server.start(Number(port));
      await until(
        'the job goes on',
        async () =>
          !/Reconnecting/.test(await page.textContent('.job-header')) &&
          /Rendering|Finished/.test(await text(page, 'state')),
      );
      if (!/Finished/.test(await text(page, 'state'))) await page.click('[data-testid=cancel]');
    }),
);
