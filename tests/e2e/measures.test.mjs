// Measurements in addition to an image: shares of the light, irradiance, readings of a meter, and
// what is known of a method's bias.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFaults, ask, desktop, serverAndBrowser, settles, until } from './harness.mjs';

const { server, withPage } = serverAndBrowser();

async function finished(request) {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify({
      scene: 'cornell-box',
      stop: { samples_per_pixel: 16 },
      ...request,
    }),
  });
  assert.equal(answer.status, 201);
  const { id } = await answer.json();
  const state = async () => (await (await ask(`${server.url}/v1/jobs/${id}`)).json()).state;
  await until('the job to finish', async () => (await state()) === 'finished');
  return id;
}

/** A screenshot, if TESSERA_SHOTS names a folder for it. */
const shot = async (page, name) => {
  const folder = process.env.TESSERA_SHOTS;
  if (folder) await page.screenshot({ path: `${folder}/${name}.png`, fullPage: true });
};

/**
 * The colour key inside a part of the page: its text, the numbers at its marks, and the colour that
 * it gives to a value.
 */
async function keyOf(page, within) {
  const place = page.locator(`${within} [data-testid=legend]`);
  await place.waitFor();
  const marks = (await place.locator('.legend-ticks span').allInnerTexts()).map(Number);
  const gradient = await place
    .locator('.legend-ramp')
    .evaluate((ramp) => getComputedStyle(ramp).backgroundImage);
  const stops = [...gradient.matchAll(/rgb\((\d+), (\d+), (\d+)\) ([\d.]+)%/g)].map((m) => ({
    at: Number(m[4]) / 100,
    colour: m.slice(1, 4).map(Number),
  }));
  const colourAt = (value) => {
    const at = Math.min(1, value / marks.at(-1));
    const next = Math.max(1, stops.findIndex((stop) => stop.at >= at - 1e-9));
    const [a, b] = [stops[next - 1], stops[next]];
    const share = (at - a.at) / (b.at - a.at);
    return a.colour.map((v, c) => v + share * (b.colour[c] - v));
  };
  return { text: await place.locator('figcaption').innerText(), marks, colourAt };
}

/** Whether colours agree but for the ramp's 256 steps, whose channels change by up to 2 a step. */
const isLike = (a, b) => a.every((v, c) => Math.abs(v - b[c]) <= 2.5);

const irradianceColours = (page) =>
  page.$eval('canvas[data-layer=irradiance]', (canvas) => {
    const { width, height } = canvas;
    const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
    return Array.from({ length: width * height }, (_, i) => [...data.slice(4 * i, 4 * i + 3)]);
  });

const luminanceOf = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

test('irradiance is shown as luminance in lux', async () => {
  const side = 12;
  const id = await finished({ film: { width: side, height: side, layers: ['irradiance'] } });
  const pixels = await Promise.all(
    Array.from({ length: side * side }, async (_, i) => {
      const at = `${server.url}/v1/jobs/${id}/pixels/${i % side}/${Math.floor(i / side)}`;
      return (await (await ask(at)).json()).layers.irradiance.mean;
    }),
  );
  await withPage(desktop, `#/jobs/${id}?show=irradiance`, async (page) => {
    const key = await keyOf(page, '.stage-frame');
    const told = Number(/maximum is ([\d.]+) lux/.exec(key.text)[1]);
    // RGBE has 8 bits for the largest channel: an error of up to 1/128 in the luminance.
    const tells = (lux) => Math.abs(told - lux) <= 0.01 * lux;
    assert.ok(tells(683 * Math.max(...pixels.map(luminanceOf))), key.text);
    assert.ok(!tells(683 * Math.max(...pixels.flat())), 'the brightest channel is no luminance');
    const colours = await irradianceColours(page);
    const wrong = pixels.filter(
      (rgb, i) =>
        !isLike(colours[i], key.colourAt(683 * luminanceOf(rgb) * 0.99)) &&
        !isLike(colours[i], key.colourAt(683 * luminanceOf(rgb))),
    );
    assert.deepEqual(wrong, []);
    // They would have no effect.
    assert.equal(await page.getByTestId('exposure').count(), 0);
    assert.equal(await page.getByTestId('tone').count(), 0);
    await shot(page, 'irradiance');
    assert.deepEqual(await accessibilityFaults(page), []);
    await page.click('label:has([data-testid=view-picture])');
    await page.getByTestId('exposure').waitFor();
  });
});

test('a firefly does not set the scale of the irradiance', async () => {
  const id = await finished({
    film: { width: 16, height: 16, layers: ['irradiance'] },
    stop: { samples_per_pixel: 2 },
  });
  const [width, height] = [200, 10];
  // 0.25 W/m2 everywhere: 170.75 lux, so that the scale ends at 200.
  const grey = [128, 128, 128, 127];
  const rgbe = Array.from({ length: width * height }, () => grey);
  rgbe[3] = [128, 0, 0, 127]; // red alone: 0.2126 of it
  rgbe[5] = [128, 128, 128, 135]; // 64 W/m2
  const head = `#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`;
  const body = Buffer.concat([Buffer.from(head), Buffer.from(rgbe.flat())]);
  const use = async (page) => {
    await page.route(/image\.hdr/, (route) =>
      route.fulfill({ body, contentType: 'image/vnd.radiance' }),
    );
    await page.goto(`${server.url}/#/jobs/${id}?show=irradiance`);
    const key = await keyOf(page, '.stage-frame');
    assert.deepEqual(key.marks, [0, 50, 100, 150, 200]);
    assert.match(key.text, /all but 0\.5% of the pixels.*maximum is 43700 lux/);
    const colours = await irradianceColours(page);
    assert.ok(isLike(colours[0], key.colourAt(170.75)), `${colours[0]}`);
    assert.ok(isLike(colours[3], key.colourAt(0.2126 * 170.75)), `${colours[3]}`);
    assert.ok(!isLike(colours[3], key.colourAt(170.75)), 'red counts in full');
    assert.ok(isLike(colours[5], key.colourAt(200)), `${colours[5]}`);
  };
  await withPage(desktop, '#/settings', use);
});

const mixOf = (page) =>
  page.$$eval('[data-testid^="mix-"]', (all) =>
    Object.fromEntries(all.map((one) => [one.dataset.testid.slice(4), Number(one.value)])),
  );

test('a mix starts as the image, with one complete family of shares', async () => {
  const film = { width: 32, height: 32 };
  const stop = { samples_per_pixel: 4 };
  const bounces = ['bounce:0', 'bounce:1', 'bounce:2-'];
  const lights = ['light:lamp', 'light:environment'];
  const id = await finished({ film: { ...film, layers: [...lights, ...bounces] }, stop });
  await withPage(desktop, `#/jobs/${id}?show=mix`, async (page) => {
    await page.getByTestId('mixer').waitFor();
    assert.deepEqual(await mixOf(page), {
      'bounce:0': 1,
      'bounce:1': 1,
      'bounce:2-': 1,
      'light:lamp': 0,
      'light:environment': 0,
    });
    assert.match(
      await page.textContent('[data-testid=mixer]'),
      /Bounces and Lights are the same light\s+sorted in different ways/,
    );
    await page.waitForSelector('.server-image[data-layer=mix]');
    /** The largest difference in 8 bits between the shown image and that at an address. */
    const apart = (address) =>
      page.evaluate(async (url) => {
        const bytes = async (src) => {
          const image = new Image();
          image.src = src;
          await image.decode();
          const canvas = document.createElement('canvas');
          [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
          const context = canvas.getContext('2d');
          context.drawImage(image, 0, 0);
          return context.getImageData(0, 0, canvas.width, canvas.height).data;
        };
        const shown = await bytes(document.querySelector('.server-image').src);
        const other = await bytes(url);
        return Math.max(...shown.map((v, i) => Math.abs(v - other[i])));
      }, address);
    // Rounding of the sum may change a byte by one.
    const image = `/v1/jobs/${id}/image.png?exposure=auto`;
    assert.ok((await apart(image)) <= 1);
    assert.ok((await apart(`${image}&mix=1,1,1,1,1`)) > 1, 'twice the light');
    await shot(page, 'mix');
    assert.deepEqual(await accessibilityFaults(page), []);
  });
  // The bounces lack most of the light; then the lights do too, and the first family is taken.
  for (const [layers, first] of [
    [['bounce:1', ...lights], lights],
    [['bounce:1', 'light:lamp'], ['bounce:1']],
  ]) {
    const other = await finished({ film: { ...film, layers }, stop });
    await withPage(desktop, `#/jobs/${other}?show=mix`, async (page) => {
      const expected = Object.fromEntries(
        layers.map((layer) => [layer, Number(first.includes(layer))]),
      );
      await settles('the weights', () => mixOf(page), expected);
    });
  }
});

test('the bias of a method is stated, with the denoised image too', async () => {
  const film = { width: 64, height: 64 };
  const photons = { photons: 1024, radius_m: 0.05 };
  const sppm = await finished({ film, integrator: { type: 'sppm', ...photons, alpha: 0.5 } });
  const textOf = (page, id) => page.innerText(`[data-testid=${id}]`);
  await withPage(desktop, `#/jobs/${sppm}`, async (page) => {
    await page.getByTestId('denoised').waitFor({ state: 'attached' });
    await page.getByTestId('error-plain').waitFor();
    const bias = await textOf(page, 'bias');
    // Of each half 8 of the 16 samples: the product of (i + 1/2) / (i + 1) for i from 1 to 7 is
    // 2 C(16, 8) / 4^8 = 0.3928, and its root 0.627.
    assert.match(bias, /^This method is consistent: .* not included in the noise, and vanishes/);
    assert.match(bias, /\s8 samples of each replicate.*\s62\.7%/s);
    assert.match(bias, /square falls as N−1, the variance as N−0\.5\./);
    const error = await textOf(page, 'error');
    assert.match(
      error,
      /^(Noise\s+(below )?[\d.]+%\s+denoised|Error of the denoised image\s+not known), [\d.]+% without denoising$/,
    );
    await until('the slope', async () =>
      /noise and systematic error together/.test(await textOf(page, 'slope')),
    );
    await shot(page, 'sppm');
    await page.uncheck('[data-testid=denoise]');
    await page.getByTestId('error-plain').waitFor({ state: 'detached' });
    assert.match(await textOf(page, 'bias'), /systematic error is included, and vanishes/);
    assert.match(
      await textOf(page, 'error'),
      /^The average pixel is\s+[\d.]+% off\s+\(([\d.]+% to|uncertain)/,
    );
    await page.check('[data-testid=denoise]');
    assert.deepEqual(await accessibilityFaults(page), []);
  });
  const map = await finished({ film, integrator: { type: 'photon-map', ...photons } });
  await withPage(desktop, `#/jobs/${map}`, async (page) => {
    assert.match(await textOf(page, 'bias'), /^This method is biased.*do not remove it\.$/);
  });
  const path = await finished({ film });
  await withPage(desktop, `#/jobs/${path}`, async (page) => {
    await until('the error', async () => /^The average pixel is\s+[\d.]+% off/.test(await textOf(page, 'error')));
    assert.equal(await page.getByTestId('bias').count(), 0);
  });
});

test('the form has the options of each integrator, and shows where one is refused', async () => {
  const { integrators } = await (await ask(`${server.url}/v1/server`)).json();
  const optionsOf = ({ accepts }) =>
    accepts
      .filter((at) => at.startsWith('/integrator/') && at !== '/integrator/max_depth')
      .map((at) => at.slice('/integrator/'.length));
  assert.deepEqual(optionsOf(integrators.find(({ type }) => type === 'sppm')), [
    'photons',
    'radius_m',
    'alpha',
  ]);
  await withPage(desktop, '#/', async (page) => {
    await page.click('.submit-form summary:text("Advanced settings")');
    const select = page.getByLabel('Integrator', { exact: true });
    const shown = () =>
      page.$$eval('[data-testid=integrator-options] :is(input, select)', (all) =>
        all.map((one) => one.dataset.testid.slice('integrator-'.length)),
      );
    for (const row of integrators) {
      await select.selectOption(row.type);
      await settles(row.type, shown, optionsOf(row));
    }
    await select.selectOption('sppm');
    const alpha = page.getByTestId('integrator-alpha');
    await alpha.fill('5');
    const asked = page.waitForRequest((r) => /\/v1\/jobs$/.test(r.url()) && r.method() === 'POST');
    await page.click('[data-testid=submit]');
    const { integrator } = (await asked).postDataJSON();
    assert.deepEqual(integrator, { type: 'sppm', alpha: 5 });
    const field = page.locator('.field-wrong');
    await field.waitFor();
    assert.match(await field.innerText(), /^Alpha\s+5 is outside \[0\.1, 1\]$/);
    assert.equal(await alpha.getAttribute('max'), '1');
    await shot(page, 'integrator-options');
    assert.deepEqual(await accessibilityFaults(page), []);
  });
});

test('strategies are arranged by path length, with and without weights', async () => {
  const kept = ['0,2', '1,2', '2,1', '0,3', '1,3', '2,2', '3,1'];
  const id = await finished({
    film: {
      width: 96,
      height: 96,
      layers: kept.flatMap((one) => [`st:${one}`, `st:${one}:unweighted`]),
    },
    integrator: { type: 'bdpt', max_depth: 3 },
  });
  await withPage(desktop, `#/jobs/${id}`, async (page) => {
    await page.waitForSelector('[data-testid=pyramid]');
    const rows = () =>
      page.$$eval('.pyramid-row', (all) =>
        all.map((row) => [...row.querySelectorAll('.mono')].map((cell) => cell.textContent)),
      );
    assert.deepEqual(await rows(), [
      ['s0 t2'],
      ['s0 t3', 's1 t2', 's2 t1'],
      ['s1 t3', 's2 t2', 's3 t1'],
    ]);
    const seen = () =>
      page.$$eval('.pyramid-cell img', (all) => all.every((i) => i.complete && i.naturalWidth));
    await until('the images', seen);
    await shot(page, 'pyramid');
    await page.check('[data-testid=pyramid-unweighted]');
    await page.click('[data-testid="pyramid-st:2,2:unweighted"]');
    await page.waitForSelector('.server-image[data-layer="st:2,2:unweighted"]');
    assert.match(page.url(), /show=st/);
    await until('the images', seen);
    await shot(page, 'pyramid-unweighted');
    assert.deepEqual(await accessibilityFaults(page), []);
  });
});

test('readings of a meter are shown next to the image, as the server reports them', async () => {
  const point = (x) => ({ position: [x, 0.01, 0.2], normal: [0, 1, 0] });
  const id = await finished({
    film: { width: 64, height: 64 },
    meter: {
      points: [point(-0.2), point(0.2)],
      plane: {
        origin: [-0.4, 0.01, -0.4],
        edge_u: [0, 0, 0.8],
        edge_v: [0.8, 0, 0],
        columns: 2,
        rows: 3,
      },
    },
  });
  const { points } = await (await ask(`${server.url}/v1/jobs/${id}/meter`)).json();
  assert.equal(points.length, 8);
  await withPage(desktop, `#/jobs/${id}`, async (page) => {
    const cells = await until('the table', async () => {
      const all = await page.$$eval('[data-testid=meter] tbody tr', (rows) =>
        rows.map((row) =>
          [...row.querySelectorAll('td')].map((td) => parseFloat(td.innerText.replaceAll('−', '-'))),
        ),
      );
      return all.length && all;
    });
    assert.equal(cells.length, points.length);
    // Nothing is cut off, and the header stays visible.
    const width = (element) => element.scrollWidth - element.clientWidth;
    assert.equal(await page.$eval('.meter-table', width), 0);
    const heads = await page.locator('.meter-table thead th').allInnerTexts();
    assert.deepEqual(heads, ['Position, m', 'lux', 'W/m²']);
    for (const [i, [lux, watts]] of cells.entries()) {
      const truth = points[i];
      assert.ok(Math.abs(lux - truth.illuminance_lux) <= (truth.high - truth.low) / 2, `${lux}`);
      // Zero within the blocks.
      const watt = truth.irradiance_w_m2;
      assert.ok(Math.abs(watts - watt) <= 0.01 * watt, `${watts}`);
    }
    // The cells of the plane, seen from its front: edge_u to the right, edge_v up.
    const drawn = await page.$$eval('[data-testid=meter-map] rect', (all) =>
      all.map((r) => ({
        column: Math.round(Number(r.getAttribute('x')) / 0.4),
        row: 2 - Math.round((3 * Number(r.getAttribute('y'))) / 0.8),
        colour: r.getAttribute('fill').match(/\d+/g).map(Number),
      })),
    );
    assert.equal(drawn.length, 6);
    const key = await keyOf(page, '[data-testid=meter-map]');
    for (const { column, row, colour } of drawn) {
      const lux = points[2 + 2 * row + column].illuminance_lux;
      assert.ok(isLike(colour, key.colourAt(lux)), `${lux} lux is ${colour}`);
    }
    await shot(page, 'meter');
    const csv = await page.getAttribute('[data-testid=meter] a', 'href');
    assert.match(await (await ask(new URL(csv, `${server.url}/`))).text(), /illuminance_lux/);
    assert.deepEqual(await accessibilityFaults(page), []);
  });
});

test('tiles that lack light are marked, and the integrator that finds it is offered', {
  timeout: 300_000,
}, async () => {
  const id = await finished({ film: { width: 96, height: 64 } });
  const address = `${server.url}/v1/jobs/${id}`;
  const job = await (await ask(address)).json();
  // Tiles have 32 pixels: the last one of the second row, and the first of all.
  const lacking = { detected: 0.123, tiles: 2, lacking: [0, 5] };
  const reason = "The image lacks light of 'lamp' by way of 'path'; bdpt or sppm finds it.";
  const integrators = ['bdpt', 'sppm'];
  job.light_not_found = { ...job.light_not_found, ...lacking, reason, integrators };
  await withPage(desktop, '', async (page) => {
    await page.route('**/v1/jobs?*', (route) => route.fulfill({ json: { jobs: [], next: null } }));
    await page.route(address, (route) => route.fulfill({ json: job }));
    await page.route(`${address}/events`, (route) => route.fulfill({ status: 204 }));
    await page.goto(`${server.url}/#/jobs/${id}`);
    // The list may have shown the job as it is.
    const missing = page.getByTestId('light-not-found').filter({ hasText: reason });
    const words = await missing.textContent();
    assert.ok(words.startsWith(reason), words);
    assert.match(words, /12% of what the image shows is missing, on 2 tiles\.$/);
    const frames = page.getByTestId('lacking-tiles');
    const drawn = () =>
      frames.evaluate((canvas) => {
        const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
        const tiles = new Set();
        for (let i = 3; i < data.length; i += 4) {
          const [x, y] = [((i - 3) / 4) % canvas.width, Math.floor((i - 3) / 4 / canvas.width)];
          if (data[i]) tiles.add(3 * Math.floor(y / 32) + Math.floor(x / 32));
        }
        return [...tiles].sort();
      });
    await settles('the marks', drawn, [0, 5]);
    assert.deepEqual(await accessibilityFaults(page), []);
    await page.uncheck('[data-testid=show-lacking]');
    await settles('no marks', () => frames.count(), 0);

    // The lamp and the surface may be called anything.
    assert.equal(await page.getByTestId('render-with-path').count(), 0);
    await page.getByTestId('render-with-sppm').waitFor();
    await page.click('[data-testid=render-with-bdpt]');
    await page.getByText('The form has the settings of this render, changed.').waitFor();
    const sent = page.waitForRequest(
      (r) => r.method() === 'POST' && /\/v1\/jobs$/.test(r.url()) && !r.postDataJSON().class,
    );
    await page.click('[data-testid=submit]');
    const { spec } = await (await (await sent).response()).json();
    assert.deepEqual(spec.integrator.type, 'bdpt');
    const { scene, film, stop } = job.spec;
    assert.deepEqual([spec.scene, spec.film, spec.stop], [scene, film, stop]);
  });
});
