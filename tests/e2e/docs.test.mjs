// The API reference at /docs lists operations and schemas; requests can be tried, problems have
// anchors.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFaults, accessKey, desktop, phone, serverAndBrowser } from './harness.mjs';

// The mock server has no reference.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const key = accessKey || 'tessera-key-of-the-reference-test';
const { server, openPage } = serverAndBrowser({ skip, key: accessKey ? '' : key });

async function withDocs(hash, use, device = desktop) {
  const page = await openPage(device, `docs${hash}`, async (opened) =>
    opened.on('console', (message) => {
      if (message.type() === 'error') opened.faults.push(message.text());
    }),
  );
  try {
    await page.waitForSelector('.opblock');
    await use(page);
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
  }
}

test('a request can be tried with a key', { skip, timeout: 300_000 }, () =>
  withDocs('#/Service/getServer', async (page) => {
    await page.fill('#key', key);
    const operation = page.locator('#operations-Service-getServer');
    await operation.locator('.send').click();
    await operation.locator('[role=status]:has-text("200")').waitFor();
    await operation.locator('pre:has-text(\'"version"\')').waitFor();
  }),
);

test('a job can be submitted and its image shown', { skip, timeout: 300_000 }, () =>
  withDocs('#operations-Jobs-createJob', async (page) => {
    await page.fill('#key', key);
    const create = page.locator('#operations-Jobs-createJob');
    const body = { scene: 'cornell-box', film: { width: 32, height: 32 } };
    await create.locator('textarea').fill(JSON.stringify(body));
    await create.locator('.field:has(label:has-text("Prefer")) input').fill('wait=25');
    await create.locator('.send').click();
    const answer = create.locator('pre[aria-label^="Body of the response"]');
    await create.locator('pre:has-text(\'"finished"\')').waitFor();
    const { id } = JSON.parse(await answer.textContent());
    const look = page.locator('#operations-Results-getImageInFormat');
    await look.locator('summary').first().click();
    await look.locator('.field:has(label > code:text-is("id")) input').fill(id);
    await look.locator('.field:has(label > code:text-is("format")) select').selectOption('png');
    await look.locator('.send').click();
    await page.waitForFunction(() => document.querySelector('.answer img')?.naturalWidth === 32);
  }),
);

for (const [name, device] of Object.entries({ dark: desktop, light: phone }))
  test(`the reference is accessible, ${name}`, { skip, timeout: 300_000 }, () =>
    withDocs(
      '#/Results/getImage',
      async (page) => {
        await page.fill('#key', key);
        const opened = [
          'operations-Jobs-createJob',
          'operations-Keys-createKey',
          'schema-JobRequestFilm',
        ];
        for (const id of opened) await page.locator(`#${id} > summary`).click();
        const operation = page.locator('#operations-Service-getServer');
        await operation.locator('summary').click();
        await operation.locator('.send').click();
        await operation.locator('pre').first().waitFor();
        assert.deepEqual(await accessibilityFaults(page), []);
        const regions = await page
          .locator('[role=region]')
          .evaluateAll((all) => all.map((each) => each.ariaLabel));
        assert.equal(new Set(regions).size, regions.length, regions.join());
        const shade = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
        assert.equal(/\d+/.exec(shade)[0] < 128, name === 'dark', shade);
        assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
      },
      device,
    ),
  );

test(
  'the theme chosen on the page holds in the reference',
  { skip, timeout: 300_000 },
  async () => {
    const page = await openPage(desktop, 'docs');
    await page.evaluate(() => localStorage.setItem('tessera.theme', '"light"'));
    await page.reload();
    await page.waitForSelector('html[data-theme=light] .opblock');
    await page.context().close();
  },
);

test('a type leads to its schema', { skip, timeout: 300_000 }, () =>
  withDocs('#operations-Jobs-createJob', async (page) => {
    await page.locator('#operations-Jobs-createJob a:text-is("JobRequest")').first().click();
    await page.locator('#schema-JobRequest[open] dt code:text-is("scene")').waitFor();
    await page.locator('#schema-JobRequest a:text-is("JobRequestFilm")').click();
    await page.locator('#schema-JobRequestFilm[open] dt code:text-is("width")').waitFor();
  }),
);

test('every operation of the document is listed', { skip, timeout: 300_000 }, () =>
  withDocs('', async (page) => {
    const { paths } = await (await fetch(`${server.url}/openapi.json`)).json();
    const ids = Object.values(paths).flatMap((methods) =>
      Object.values(methods).map(({ tags, operationId }) => `operations-${tags[0]}-${operationId}`),
    );
    assert.ok(ids.length > 20);
    const shown = await page.locator('.opblock').evaluateAll((all) => all.map((each) => each.id));
    assert.deepEqual(shown.sort(), ids.sort());
  }),
);

test('the type of a problem links to its description', { skip, timeout: 300_000 }, async () => {
  const { type, title } = await (
    await fetch(`${server.url}/v1/jobs/nothing`, { headers: { authorization: `Bearer ${key}` } })
  ).json();
  await withDocs(new URL(type, server.url).hash, async (page) => {
    const row = page.locator(new URL(type, server.url).hash);
    await page.waitForFunction((id) => {
      const { top, bottom } = document.getElementById(id).getBoundingClientRect();
      return top >= 0 && bottom <= innerHeight;
    }, new URL(type, server.url).hash.slice(1));
    assert.ok((await row.textContent()).includes(title));
  });
});
