// Nothing that the page does during the life of a job is an error to whoever opens the browser's
// tools: it asks for images when the server says that there are some.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ask, desktop, drop, serverAndBrowser, submit, triangleFiles, until } from './harness.mjs';

const { server, withPage } = serverAndBrowser();

/** Adds refused requests and messages of the console to page.faults. */
function listen(page) {
  page.on('response', (response) => {
    if (response.status() >= 400)
      page.faults.push(`${response.status()} ${response.request().method()} ${response.url()}`);
  });
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) page.faults.push(message.text());
  });
}

const isShown = (page, state) => async () =>
  (await page.textContent('[data-testid=state]')).startsWith(state);

test('a job is followed from its start to its end and opened again', { timeout: 300_000 }, () =>
  withPage(desktop, '', async (page) => {
    listen(page);
    await submit(page, { scene: 'still-life', samples: 16 });
    await until('the denoised image', () => page.$('[data-testid=denoised]'));
    await until('its end', isShown(page, 'Finished'));
    await page.reload();
    await until('the record', isShown(page, 'Finished'));
    await until('the denoised image', () => page.$('[data-testid=denoised]'));
    await page.waitForTimeout(1000);
  }),
);

test('a job that ended before it could be denoised is shown without', { timeout: 300_000 }, () =>
  withPage(desktop, '', async (page) => {
    listen(page);
    await submit(page, { scene: 'furnace', samples: 1 });
    await until('its end', isShown(page, 'Finished'));
    await page.waitForTimeout(3000);
    assert.equal(await page.locator('[data-testid=denoised]').count(), 0);
  }),
);

test('files that belong together are sent without a refusal', { timeout: 120_000 }, () =>
  withPage(desktop, '', async (page) => {
    listen(page);
    // LM-63: one lamp, two vertical angles, one horizontal angle.
    const lamp = 'IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n100 100\n';
    await until('the form', () => page.$('[data-testid=submit]'));
    await drop(page, [{ name: 'down light.ies', bytes: Buffer.from(lamp) }]);
    await page.getByText('down light is ready to render.').waitFor();
    await drop(page, triangleFiles());
    await page.getByText('triangle is ready to render.').waitFor();
  }),
);

test('what can be requested is in the job, and what is not there is refused', async () => {
  const job = await (
    await ask(`${server.url}/v1/jobs`, {
      method: 'POST',
      headers: { 'content-type': 'application/json', prefer: 'wait=20' },
      body: JSON.stringify({
        scene: 'furnace',
        film: { width: 32, height: 32 },
        stop: { samples_per_pixel: 1 },
      }),
    })
  ).json();
  const look = async (query) =>
    (await ask(`${server.url}/v1/jobs/${job.id}/image.png${query}`)).status;
  assert.deepEqual(job.available, ['image']);
  assert.equal(await look(''), 200);
  assert.equal(await look('?denoise=mixed'), 409);
});
