// The API reference at /docs lists the operations; requests can be tried, problems have anchors.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { accessKey, desktop, launch, openPage, Server } from './harness.mjs';

// The mock server has no reference.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const key = accessKey || 'tessera-key-of-the-reference-test';
const server = new Server({ key: accessKey ? '' : key });
let browser;

before(async () => {
  if (skip) return;
  await server.start();
  browser = await launch();
});

after(async () => {
  await browser?.close();
  await server.stop();
});

async function withDocs(hash, use) {
  const page = await openPage(browser, server, desktop, `docs${hash}`, async (opened) =>
    opened.on('console', (message) => {
      if (/Content Security Policy/.test(message.text())) opened.faults.push(message.text());
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
  withDocs('', async (page) => {
    await page.click('.btn.authorize');
    const bearer = page.locator('.auth-container', { hasText: 'bearer' });
    await bearer.locator('input').fill(key);
    await bearer.locator('button[type=submit]').click();
    await page.click('.btn-done');
    const operation = page.locator('#operations-Service-getServer');
    await operation.locator('.opblock-summary-control').click();
    await operation.locator('button.execute').click();
    const answer = operation.locator('.live-responses-table');
    await answer.locator('.response-col_status:has-text("200")').waitFor();
    assert.match(await answer.textContent(), /"version"/);
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

test('code that scrolls can be reached by keyboard', { skip, timeout: 300_000 }, () =>
  withDocs('', async (page) => {
    await page.setViewportSize({ width: 600, height: 800 });
    const operation = page.locator('#operations-Jobs-createJob');
    await operation.locator('.opblock-summary-control').click();
    await operation.locator('pre').first().waitFor();
    const unreached = () =>
      page
        .locator('#reference pre')
        .evaluateAll((all) =>
          all
            .filter((e) => e.scrollWidth > e.clientWidth + 1 || e.scrollHeight > e.clientHeight + 1)
            .map((e) => e.closest('[tabindex="0"]') !== null),
        );
    await page.waitForFunction(() => document.querySelector('#reference [tabindex="0"].microlight, #reference pre[tabindex="0"]'));
    assert.ok(!(await unreached()).includes(false));
  }),
);

test('the type of a problem links to its description', { skip, timeout: 300_000 }, async () => {
  const { type, title } = await (
    await fetch(`${server.url}/v1/jobs/nothing`, { headers: { authorization: `Bearer ${key}` } })
  ).json();
  await withDocs(new URL(type, server.url).hash, async (page) => {
    const row = page.locator(new URL(type, server.url).hash);
    await page.waitForFunction(
      (id) => {
        const { top, bottom } = document.getElementById(id).getBoundingClientRect();
        return top >= 0 && bottom <= innerHeight;
      },
      new URL(type, server.url).hash.slice(1),
    );
    assert.ok((await row.textContent()).includes(title));
  });
});
