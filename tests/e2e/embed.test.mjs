// The view of one job inside another page's frame.
import assert from 'node:assert/strict';
import http from 'node:http';
import { after, test } from 'node:test';
import { accessibilityFaults, ask, desktop, serverAndBrowser, until } from './harness.mjs';

let shop;

async function openShop() {
  // A page of another origin; the server may be started with any port, so it is known first.
  shop = http.createServer((request, response) => {
    response.writeHead(200, { 'content-type': 'text/html' });
    const src = new URL(request.url, 'http://shop').searchParams.get('frame') ?? '';
    response.end(`<!doctype html><title>Shop</title><iframe src="${src}" width="480"></iframe>`);
  });
  await new Promise((resolve) => shop.listen(0, '127.0.0.1', resolve));
  process.env.TESSERA_EMBED_ORIGINS = `http://localhost:${shop.address().port}`;
}

const { server, newContext } = serverAndBrowser({ beforeStart: openShop });

after(() => {
  delete process.env.TESSERA_EMBED_ORIGINS;
  shop.close();
});

async function render() {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json', prefer: 'wait=20' },
    body: JSON.stringify({
      scene: 'furnace',
      name: 'chair',
      film: { width: 64, height: 48 },
      stop: { samples_per_pixel: 8 },
    }),
  });
  return (await answer.json()).id;
}

test(
  'a named page frames the view of a job, another one does not',
  { timeout: 120_000 },
  async () => {
    const id = await render();
    const policy = (await ask(`${server.url}/embed/${id}`)).headers.get('content-security-policy');
    const { port } = shop.address();
    assert.match(policy, new RegExp(`frame-ancestors 'self' http://localhost:${port}$`));
    const page = await (await newContext()).newPage();
    const framed = async (host) => {
      await page.goto(
        `http://${host}:${port}/?frame=${encodeURIComponent(`${server.url}/embed/${id}`)}`,
      );
      return page.frameLocator('iframe').getByTestId('embed-state');
    };
    const state = await framed('localhost');
    await until('the state', async () =>
      /^finished, the average pixel/.test(await state.textContent()),
    );
    const image = page.frameLocator('iframe').getByTestId('picture');
    assert.equal(await image.evaluate((one) => one.decode().then(() => one.naturalWidth)), 64);
    // The same page under a name that was not given.
    const other = await framed('127.0.0.1');
    await page.waitForTimeout(500);
    assert.equal(await other.count(), 0);
    await page.close();
  },
);

test('the view alone is readable and has no faults', { timeout: 120_000 }, async () => {
  const id = await render();
  const page = await (await newContext(desktop)).newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
  await page.goto(`${server.url}/embed/${id}`);
  await until('its name', async () => (await page.textContent('.embed-name')) === 'chair');
  await until('its image', () => page.locator('.embed-image').isVisible());
  assert.deepEqual(await accessibilityFaults(page), []);
  assert.deepEqual(faults, []);
  await page.close();
});
