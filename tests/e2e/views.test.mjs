import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  accessibilityFaults,
  ask,
  desktop,
  isOther,
  moving,
  phone,
  pictureNow,
  serverAndBrowser,
  settles,
  submit,
  until,
} from './harness.mjs';

const { server, openPage, withPage } = serverAndBrowser();

const state = (page) => page.textContent('[data-testid=state]');

async function renderOf(page, scene, samples = 16) {
  await submit(page, { scene, samples });
  await until('the render to finish', async () => /^Finished/.test(await state(page)), 120_000);
  return new URL(page.url()).hash.split('/').pop();
}

test(
  'the camera is placed in a live preview, and the next render uses it',
  { timeout: 300_000 },
  () =>
    withPage(desktop, '#/compose/cornell-box', async (page) => {
      const first = await until('a preview', () => pictureNow(page));
      const box = await page.locator('.stage').boundingBox();
      const middle = [box.x + box.width / 2, box.y + box.height / 2];
      await page.mouse.move(...middle);
      await page.mouse.down();
      await page.mouse.move(middle[0] + 160, middle[1] + 40, { steps: 8 });
      await page.mouse.up();
      await until('another view', () => isOther(page, first));
      const [request] = await Promise.all([
        page.waitForRequest(
          (r) =>
            r.method() === 'POST' && /\/v1\/jobs$/.test(r.url()) && !/preview/.test(r.postData()),
        ),
        page.click('[data-testid=submit]'),
      ]);
      const { camera } = request.postDataJSON();
      assert.equal(camera.position.length, 3);
      assert.equal(camera.target.length, 3);
      assert.ok(camera.vertical_fov_degrees > 0);
      await until('the new job', async () => /#\/jobs\//.test(page.url()));
      await page.click('[data-testid=cancel]');
    }),
);

test('a moving camera is shown in complete images', { timeout: 300_000 }, () =>
  withPage(desktop, '#/compose/cornell-box', async (page) => {
    await until('a preview', async () => (await pictureNow(page))?.share === 1);
    const asked = [];
    const jobs = [];
    page.on('response', (r) => {
      if (r.request().method() !== 'POST' || !/\/v1\/jobs$/.test(r.url())) return;
      asked.push(r.request().postDataJSON());
      // Closing a page aborts its pending responses.
      jobs.push(r.json().then(({ id }) => id).catch(() => null));
    });
    // Those superseded by a newer one before they are complete end as cancelled.
    const whole = async () => {
      const states = jobs.slice(-40).map(async (id) => {
        const job = await ask(`${server.url}/v1/jobs/${await id}`);
        return (await job.json()).state;
      });
      return (await Promise.all(states)).filter((state) => state === 'finished').length;
    };
    const box = await page.locator('.stage').boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(x, y);
    await page.mouse.down();
    for (let i = 1; i % 20 || (await whole()) < 5; ++i)
      await page.mouse.move(x + 100 * Math.sin(i / 10), y);
    await page.mouse.up();
    const cameras = new Set(asked.map((job) => JSON.stringify(job.camera)));
    assert.ok(cameras.size >= 5, `${cameras.size} cameras`);
    assert.equal(new Set(asked.map((job) => job.preview_key)).size, 1);
    // When the camera rests, the page requests the full image.
    await until('the fine picture', () => asked.at(-1).stop.samples_per_pixel > 2);
  }),
);

let pair = null;
/** Two finished renders that tests do not change, with 8 and 32 samples. */
const renderedPair = () =>
  (pair ??= Promise.all(
    [8, 32].map(async (samples) => {
      const answer = await ask(`${server.url}/v1/jobs`, {
        method: 'POST',
        headers: { 'content-type': 'application/json' },
        body: JSON.stringify({
          scene: 'cornell-box',
          film: { width: 240, height: 135 },
          stop: { samples_per_pixel: samples },
        }),
      });
      const { id } = await answer.json();
      const job = async () => (await ask(`${server.url}/v1/jobs/${id}`)).json();
      await until('one of the pair', async () => (await job()).state === 'finished');
      return id;
    }),
  ));

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
]) {
  test(
    `two renders are compared on a ${name}: wipe, difference, significance, numbers`,
    { timeout: 300_000 },
    () =>
      withPage(device, '', async (page) => {
        const [a, b] = await renderedPair();
        await page.goto(`${server.url}/#/compare/${a}/${b}`);
        await page.waitForSelector('[data-testid=wipe]');
        await until('numbers', async () =>
          /relMSE\s*[\d.]/.test(await page.textContent('[data-testid=compare-numbers]')),
        );
        const clip = () =>
          page.locator('.compare-film canvas').last().evaluate((c) => c.style.clipPath);
        await until('the line in the middle', async () => /50%/.test(await clip()));
        const note = () => page.textContent('.side-note-b');
        await until('what B is', async () => /^B 32 samples, [\d.]+%$/.test(await note()));
        await page.fill('[data-testid=wipe]', '25');
        await until('the line to move', async () => /75%/.test(await clip()));
        for (const view of ['difference', 'z']) {
          await page.check(`[data-testid=compare-${view}]`, { force: true });
          await page.waitForSelector('[data-testid=legend]');
        }
        await page.check('[data-testid=compare-flip]', { force: true });
        const map = page.locator('[data-testid=flip-map]');
        await until('the map', () => map.evaluate((img) => img.complete && img.naturalWidth > 0));
        const figures = page.locator('[data-testid=compare-numbers]');
        await page.waitForSelector('[data-testid=legend]:has-text("0.75")');
        await until('the number', async () => /FLIP\s*[\d.]/.test(await figures.textContent()));
        const box = await figures.boundingBox();
        assert.ok(box.width <= page.viewportSize().width);
        // The displayed text is that of the server.
        const asked = await ask(`${server.url}/v1/comparisons`, {
          method: 'POST',
          headers: { 'content-type': 'application/json' },
          body: JSON.stringify({ a, b }),
        });
        const { mse, bias } = await asked.json();
        const read = (text) => Number(text.replace(/−/g, '-'));
        const value = async (name) =>
          page.locator(`dt:text-is("${name}") + dd`).first().textContent();
        assert.ok(Math.abs(read(await value('MSE')) / mse - 1) < 0.01);
        assert.ok(Math.abs(read(await value('Bias of A')) / bias.value - 1) < 0.01);
        assert.match(page.url(), /\?show=flip$/);
        assert.match(await figures.textContent(), /95%: /);
      }),
  );
}

test('an error older than the image shows its samples, and two points give no slope', () =>
  withPage(desktop, '', async (page) => {
    await page.route('**/convergence', async (route) => {
      const id = route.request().url().split('/').at(-2);
      const { error } = await (await ask(`${server.url}/v1/jobs/${id}`)).json();
      const { relative, low, high } = error;
      const point = { elapsed_seconds: 1, relative, low, high };
      const points = [
        { ...point, samples_per_pixel: 1, elapsed_seconds: 0.5, relative: 2 * relative },
        { ...point, samples_per_pixel: 2 },
      ];
      await route.fulfill({ json: { points, slope: { value: -1, low: null, high: null } } });
    });
    await renderOf(page, 'cornell-box', 8);
    await page.getByTestId('denoise').uncheck();  // The denoised image has a separate error.
    await page.getByTestId('error-age').waitFor();
    assert.match(await page.textContent('[data-testid=error]'), /% off \([\d.]+% to .*, at 2 samples$/);
    await page.waitForSelector('.plot svg');
    assert.match(await page.textContent('[data-testid=slope]'), /not enough passes yet/);
    assert.equal(await page.getByTestId('prediction').count(), 0);
  }),
);

test('New opens the form from every view', { timeout: 120_000 }, () =>
  withPage(phone, '#/compose/cornell-box', async (page) => {
    const link = page.getByRole('link', { name: 'New', exact: true });
    await settles('where one is', () => link.getAttribute('aria-current'), 'page');
    await until('a preview', () => pictureNow(page));
    await link.click();
    const scene = page.getByTestId('scene');
    await until('the form', () => scene.evaluate((e) => e === document.activeElement));
    const inSight = () => scene.evaluate((e) => e.getBoundingClientRect().bottom < innerHeight);
    await settles('the form in sight', inSight, true);
    assert.equal(new URL(page.url()).hash, '#/');
    await page.evaluate(() => scrollTo(0, 0));
    await link.click();
    await settles('the form again', inSight, true);
  }),
);

test('the list of renders can be filtered and opens each of them', { timeout: 300_000 }, () =>
  withPage(desktop, '', async (page) => {
    const id = await renderOf(page, 'furnace', 8);
    await page.goto(`${server.url}/#/jobs`);
    await page.waitForSelector('.job-card');
    await page.fill('input[type=search]', id);
    await until('one card', async () => (await page.locator('.job-card').count()) === 1);
    await page.check('input[name=filter] >> nth=1', { force: true });
    await page.waitForSelector('text=No render matches.');
    assert.match(page.url(), /#\/jobs\?.*show=active/);
    await page.reload();
    await page.waitForSelector('text=No render matches.');
    await page.check('input[name=filter] >> nth=2', { force: true });
    await page.click('.job-card a');
    await until('its picture', () => pictureNow(page));
  }),
);

let made = null;
/**
 * More renders than the page loads at first, the newest 40: 85 of hay, before them a red, a blue,
 * an old and a wide one, after them a wider one. Rendered once for all tests.
 */
const crowd = () =>
  (made ??= (async () => {
    const tag = `needle ${Date.now()}`;
    const add = async (name, width = 32) => {
      const answer = await ask(`${server.url}/v1/jobs`, {
        method: 'POST',
        headers: { 'content-type': 'application/json', prefer: 'wait=60' },
        body: JSON.stringify({
          scene: 'furnace',
          name,
          film: { width, height: 32 },
          stop: { samples_per_pixel: 2 },
        }),
      });
      assert.ok(answer.ok, String(answer.status));
      return (await answer.json()).id;
    };
    for (const colour of ['Red', 'Blue']) await add(`${colour} ${tag}`);
    const old = await add(`Old ${tag}`);
    await add(`wide ${tag}`, 48);
    for (let i = 0; i < 85; ++i) await add(`hay ${tag} ${i}`);
    return { tag, old, wider: await add(`wider ${tag}`, 48) };
  })());

test('names and states are searched in all renders of the server', { timeout: 300_000 }, () =>
  withPage(desktop, '', async (page) => {
    const { tag } = await crowd();
    const cards = page.locator('.job-card');
    const found = (count, names) =>
      until(`${count} cards`, async () => {
        const shown = await cards.locator('strong').allTextContents();
        return shown.length === count && shown.every((name) => names.test(name));
      });
    await page.goto(`${server.url}/#/jobs`);
    await found(40, /./);
    await page.fill('input[type=search]', `ED ${tag}`);
    await found(1, /^Red needle/);
    await page.waitForURL(/find=ED/);
    await page.reload();
    await found(1, /^Red needle/);
    await page.fill('input[type=search]', `hay ${tag}`);
    await found(40, /^hay/);
    const more = page.getByText('Show older renders');
    await more.click();
    await found(80, /^hay/);
    await more.click();
    await found(85, /^hay/);
    assert.equal(await more.count(), 0);
    // The list is requested repeatedly; added entries stay.
    const again = () => page.waitForResponse((r) => /name=hay/.test(r.url()) && r.ok());
    await again();
    await again();
    await found(85, /^hay/);
    await page.check('input[name=filter] >> nth=3', { force: true });
    await page.waitForSelector('text=No render matches.');
    await page.check('input[name=filter] >> nth=2', { force: true });
    await found(40, /^hay/);
  }),
);

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', { ...phone, viewport: { width: 390, height: 700 } }],
]) {
  test(`any two renders of the server can be selected on a ${name}`, { timeout: 300_000 }, () =>
    withPage(device, '', async (page) => {
      const { tag, old, wider } = await crowd();
      // Nothing is compared unasked; the newest of one size are offered, not those that differ.
      await page.goto(`${server.url}/#/compare`);
      await page.reload();
      await page.getByTestId('compare-newest').waitFor();
      assert.equal(await page.locator('[data-testid=wipe]').count(), 0);
      assert.deepEqual(await accessibilityFaults(page), []);
      await page.getByTestId('compare-newest').click();
      await page.waitForSelector('[data-testid=wipe]');
      await page.getByTestId('pick-b').click();
      const rows = page.locator('.pick-list button');
      await until('the newest', async () => (await rows.count()) >= 40);
      assert.equal(await rows.getByText(`Old ${tag}`).count(), 0);
      assert.deepEqual(await accessibilityFaults(page), []);
      await page.keyboard.type(`OLD ${tag}`);
      await until('the old one alone', async () => (await rows.count()) === 1);
      await page.keyboard.press('Tab');
      await page.keyboard.press('Enter');
      await page.waitForURL((url) => url.hash.endsWith(`/${old}`));
      await until('its name', async () =>
        (await page.getByTestId('pick-b').textContent()).includes(`Old ${tag}`),
      );
      await page.waitForSelector('[data-testid=wipe]');
      await settles('the list closes', () => rows.count(), 0);
      await page.getByTestId('pick-a').click();
      const box = await page.locator('.menu[open] .menu-panel').boundingBox();
      assert.ok(box.x >= 0 && box.x + box.width <= page.viewportSize().width, JSON.stringify(box));
      await page.fill('.pick-menu input', `wider ${tag}`);
      await rows.getByText('another size').click();
      await page.waitForURL((url) => url.hash === `#/compare/${wider}/${old}`);
      await page.getByText('A is 48 × 32 pixels, B 32 × 32').waitFor();
      await page.getByTestId('pick-a').click();
      await page.keyboard.press('Escape');
      await until('the list to close', async () => (await rows.count()) === 0);
      const focused = () => page.evaluate(() => document.activeElement.dataset.testid);
      await settles('the focus', focused, 'pick-a');
    }),
  );
}

const problem = (status, title) => ({
  status,
  contentType: 'application/problem+json',
  body: JSON.stringify({ title, status }),
});
/** Possible responses of a server, and the page's messages for them. */
const states = [
  {
    name: 'loading',
    address: '**/v1/**',
    answer: () => undefined,
    says: ['.connection', /Connecting/],
  },
  {
    name: 'empty',
    address: '**/v1/jobs?*',
    answer: (route) => route.fulfill({ json: { jobs: [], next: null } }),
    says: ['main', /Nothing rendered yet/],
  },
  {
    name: 'offline',
    address: '**/v1/**',
    answer: (route) => route.abort(),
    says: ['main', /The server is not responding/],
  },
  {
    name: 'locked',
    address: '**/v1/**',
    answer: (route) => route.fulfill(problem(401, 'This server asks for an access key.')),
    says: ['main', /Access key required/],
  },
  {
    name: 'overloaded',
    hash: (id) => `#/jobs/${id}`,
    address: '**/events',
    answer: (route) =>
      route.fulfill({
        contentType: 'text/event-stream',
        body: 'event: overloaded\nretry: 60000\ndata: {}\n\n',
      }),
    says: ['.job-header', /furnace.*Too many viewers right now/s],
  },
];

test('every state of the server is reported accessibly', { timeout: 300_000 }, async () => {
  const light = { ...desktop, colorScheme: 'light' };
  let id = '';
  await withPage(light, '', async (page) => {
    await submit(page, { scene: 'furnace', samples: 65536 });
    id = new URL(page.url()).hash.split('/').pop();
    // Unfinished, without using the processor.
    await until('tiles', () => pictureNow(page));
    await page.click('[data-testid=pause]');
    await until('the pause', async () => /Paused/.test(await state(page)));
  });
  for (const { name, hash, address, answer, says } of states) {
    const page = await openPage(light, hash?.(id) ?? '', (p) =>
      p.route(address, answer),
    );
    const [place, words] = says;
    await until(name, async () => words.test(await page.textContent(place)));
    assert.deepEqual(await accessibilityFaults(page), [], name);
    // It recovers when the server does.
    if (name === 'offline') {
      await page.unroute(address);
      await until('the newest render', () => pictureNow(page));
      assert.match(await page.textContent('.connection'), /Connected/);
    }
    await page.context().close();
  }
  await ask(`${server.url}/v1/jobs/${id}/cancel`, { method: 'POST' });
});

/** No request succeeds, and the page knows it before it is first drawn. */
function refuseAtOnce() {
  const fetch = globalThis.fetch;
  globalThis.fetch = (...all) =>
    globalThis.answered ? fetch(...all) : Promise.reject(new TypeError('refused'));
}

test('changes before the page listens are shown', { timeout: 300_000 }, async () => {
  const page = await openPage(desktop, '', (p) => p.addInitScript(refuseAtOnce));
  try {
    await until('offline', async () =>
      /The server is not responding/.test(await page.textContent('main')),
    );
    await page.evaluate(() => (globalThis.answered = true));
    await until('online', async () => /Connected/.test(await page.textContent('.connection')));
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
  }
});

test('the selected colour scheme is kept', () =>
  withPage(desktop, '#/settings', async (page) => {
    await page.keyboard.press('Tab');
    await page.keyboard.press('Enter');
    await settles('the focus', () => page.evaluate(() => document.activeElement.id), 'main');
    await page.getByText('Light', { exact: true }).click();
    await settles('the colours', () => page.getAttribute('html', 'data-theme'), 'light');
    await page.reload();
    await page.waitForSelector('h1');
    assert.equal(await page.getAttribute('html', 'data-theme'), 'light');
  }));

/**
 * Counts in the page itself: tiles that arrive, pixels drawn, those drawn outside of animation
 * frames.
 */
function countDraws() {
  const counts = { tiles: 0, pixels: 0, outside: 0 };
  globalThis.counts = counts;
  globalThis.Worker = class extends globalThis.Worker {
    constructor(...all) {
      super(...all);
      this.addEventListener('message', ({ data }) => {
        if (data.type === 'tiles') counts.tiles += data.tiles.length;
      });
    }
    postMessage(message, ...more) {
      if (!(globalThis.keepsTiles && message.type === 'taken')) super.postMessage(message, ...more);
    }
  };
  let inFrame = false;
  const request = globalThis.requestAnimationFrame;
  globalThis.requestAnimationFrame = (callback) =>
    request((time) => {
      inFrame = true;
      callback(time);
      inFrame = false;
    });
  const draw = CanvasRenderingContext2D.prototype.putImageData;
  CanvasRenderingContext2D.prototype.putImageData = function (image, ...more) {
    counts.pixels += image.width * image.height;
    counts.outside += inFrame ? 0 : 1;
    return draw.call(this, image, ...more);
  };
}

// `tests/bench/run --page` measures the time.
test('tiles are drawn in animation frames, each separately', { timeout: 300_000 }, async () => {
  const page = await openPage(moving, '', (p) => p.addInitScript(countDraws));
  try {
    await submit(page, { scene: 'cornell-box', size: '3', samples: 4096 });
    const counts = () => page.evaluate(() => globalThis.counts);
    await until('many tiles', async () => (await counts()).tiles > 300);
    await page.click('[data-testid=cancel]');
    const { tiles, pixels, outside } = await counts();
    assert.equal(outside, 0);
    // The film without tiles is drawn at most twice, by the view and by its settings; a tile is 32
    // x 32 pixels.
    assert.ok(pixels <= 2 * 1920 * 1080 + 1024 * tiles, `${pixels} pixels for ${tiles} tiles`);
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
  }
});

test('a page that is slower than the renderer gets no tiles until it has taken the last ones', {
  timeout: 300_000,
}, async () => {
  const page = await openPage(desktop, '', async (p) => {
    await p.addInitScript(countDraws);
    await p.addInitScript(() => (globalThis.keepsTiles = true));
  });
  try {
    await submit(page, { scene: 'cornell-box', size: '3', samples: 4096 });
    const tiles = () => page.evaluate(() => globalThis.counts.tiles);
    await until('the first tiles', async () => (await tiles()) > 0);
    const state = await page.textContent('[data-testid=state]');
    await page.waitForTimeout(2000);
    assert.ok((await tiles()) <= 32, `${await tiles()} tiles, ${state}`);
    await page.click('[data-testid=cancel]');
  } finally {
    await page.context().close();
  }
});

test('tiles of the image are coloured by the worker that renders them', { timeout: 300_000 }, () =>
  withPage(desktop, '', async (page) => {
    let rendered = '';
    const worker = (id) => ({
      id,
      held: rendered ? [`${rendered}.0.1`] : [],
      build: 'b',
      arithmetic: 'a',
      threads: 1,
      rate: 1,
      leases: 1,
      units: 1,
      faults: 0,
      state: 'working',
      reason: null,
      seen_at: '2024-01-01T00:00:00Z',
    });
    const tile = (id, x) => ({ worker: id, x, y: 0, width: 32, height: 32 });
    const answer = (way, json) => way.fulfill({ contentType: 'application/json', json });
    await page.route('**/v1/workers', (way) =>
      answer(way, { workers: [worker('first'), worker('second')] }),
    );
    let asked = 0;
    await page.route('**/v1/jobs/*/workers', (way) => {
      ++asked;
      return answer(way, { tiles: [tile('first', 0), tile('second', 64)] });
    });
    const made = await ask(`${server.url}/v1/jobs`, {
      method: 'POST',
      headers: { 'content-type': 'application/json' },
      body: JSON.stringify({
        scene: 'cornell-box',
        film: { width: 128, height: 96 },
        stop: { samples_per_pixel: 65536 },
      }),
    });
    const { id } = await made.json();
    rendered = id;
    try {
      await page.goto(`${server.url}/#/jobs/${id}`);
      await until('its picture', () => pictureNow(page));
      assert.equal(await page.locator('[data-testid=worker-tiles]').count(), 0);
      assert.equal(asked, 0);
      await page.goto(`${server.url}/#/settings`);
      await until('what the workers render', () =>
        page.locator(`[data-testid=workers] a[href="#/jobs/${id}"]`).count(),
      );
      await page.check('[data-testid=show-workers]');
      assert.deepEqual(await accessibilityFaults(page), []);
      await page.goto(`${server.url}/#/jobs/${id}`);
      // The middle of each of the first three tiles.
      const colours = () =>
        page.locator('[data-testid=worker-tiles]').evaluate((canvas) =>
          [16, 48, 80].map((x) => [...canvas.getContext('2d').getImageData(x, 16, 1, 1).data]),
        );
      const [first, none, second] = await until('coloured tiles', async () => {
        const seen = await colours();
        return seen[0][3] > 0 && seen;
      });
      assert.equal(none[3], 0);
      assert.ok(second[3] > 0);
      assert.notDeepEqual(first, second);
    } finally {
      await ask(`${server.url}/v1/jobs/${id}/cancel`, { method: 'POST' });
    }
  }),
);
