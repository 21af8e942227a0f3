// Messages of the page for renders that do not exist or have been deleted, and for invalid
// addresses.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ask, desktop, pictureNow, serverAndBrowser, submit, until } from './harness.mjs';

const { server, withPage: withPageOf } = serverAndBrowser();

const withPage = (hash, use) => withPageOf(desktop, hash, use);

async function renderOf(page) {
  await submit(page, { scene: 'furnace', samples: 8 });
  await until('the render to finish', async () =>
    /^Finished/.test(await page.textContent('[data-testid=state]')),
  );
  await until('its picture', () => pictureNow(page));
  return new URL(page.url()).hash.split('/').pop();
}

test('a malformed address is reported as an unknown render', () =>
  withPage('#/jobs/%zz', async (page) => {
    await page.waitForSelector('h1:text-is("This render does not exist.")');
    await page.evaluate(() => (location.hash = '#/compose/%E0%A4?pose=%'));
    await page.waitForSelector('h1:text-is("Position the camera")');
    await page.evaluate(() => (location.hash = '#/%'));
    await page.waitForSelector('main h1');
  }));

test('a comparison names the side that does not exist', { timeout: 120_000 }, () =>
  withPage('', async (page) => {
    const id = await renderOf(page);
    await page.evaluate(() => (location.hash = '#/compare/nosuch/none'));
    for (const side of ['a', 'b'])
      await page.waitForSelector(`[data-testid=missing-${side}]:has-text("does not exist")`);
    await page.evaluate((hash) => (location.hash = hash), `#/compare/${id}/none`);
    await until('one side', async () => !(await page.getByTestId('missing-a').count()));
    await page.waitForSelector('[data-testid=missing-b]');
    assert.ok(await page.getByTestId('pick-b').isVisible());
  }),
);

test('a render deleted elsewhere offers no actions', { timeout: 120_000 }, () =>
  withPage('', async (page) => {
    const gone = () => page.getByText('This render no longer exists.').waitFor();
    for (const way of ['watched', 'used']) {
      const id = await renderOf(page);
      const watches = way === 'watched';
      // The list must have shown it once before its absence means anything.
      if (watches) await until('the list', () => page.locator(`.filmstrip a[href*="${id}"]`).count());
      else await page.route('**/v1/jobs?*', (route) => route.abort());
      assert.ok((await ask(`${server.url}/v1/jobs/${id}`, { method: 'DELETE' })).ok);
      if (!watches) {
        await page.getByTestId('extend').click();
        await page.getByText('One more minute').click();
      }
      await gone();
      for (const action of ['extend', 'download', 'more'])
        assert.equal(await page.getByTestId(action).count(), 0, action);
    }
  }),
);

test('a render whose record is answered after the list lacks it is asked for again', () =>
  withPage('', async (page) => {
    const id = await renderOf(page);
    const address = `${server.url}/v1/jobs/${id}`;
    const body = await (await ask(address)).text();
    let answers = 0;
    await page.route(address, (route) =>
      answers++ ? route.continue() : route.fulfill({ body, contentType: 'application/json' }),
    );
    assert.ok((await ask(address, { method: 'DELETE' })).ok);
    await until('the message', () => {
      // Whoever comes back to the page has the list read again.
      void page.evaluate(() => document.dispatchEvent(new Event('visibilitychange')));
      return page.getByText('This render no longer exists.').count();
    });
    // Each list that lacks it has it asked for; several may be read before the answer is here.
    assert.ok(answers >= 2, `${answers}`);
  }),
);

test('the denoised image of a deleted render is asked for once', () =>
  withPage('', async (page) => {
    const id = await renderOf(page);
    await page.getByTestId('denoised').waitFor();
    await page.goto('about:blank');
    let asked = 0;
    await page.route('**/image.png?denoise=*', (route) => {
      asked += 1;
      return route.fulfill({ status: 404, body: '{}', contentType: 'application/problem+json' });
    });
    await page.goto(`${server.url}/#/jobs/${id}`);
    await until('the request', () => asked);
    await page.waitForTimeout(1500);
    assert.equal(asked, 1);
  }),
);

test('a damaged record is named and can be deleted', { timeout: 60_000 }, () =>
  withPage('', async (page) => {
    const id = '01234567-89ab-cdef-0123-456789abcdef';
    let deleted = false;
    await page.route('**/v1/jobs?*', async (route) => {
      const response = await route.fetch();
      const listed = await response.json();
      assert.deepEqual(listed.damaged, []);
      await route.fulfill({ response, json: { ...listed, damaged: deleted ? [] : [id] } });
    });
    await page.route(`**/v1/jobs/${id}`, (route) => {
      deleted = route.request().method() === 'DELETE';
      return route.fulfill({ status: 204 });
    });
    await page.evaluate(() => (location.hash = '#/jobs'));
    const told = page.getByTestId('damaged-jobs');
    await told.getByText(id).waitFor();
    await told.getByRole('button', { name: 'Delete' }).click();
    await told.waitFor({ state: 'detached' });
    assert.ok(deleted);
  }),
);
