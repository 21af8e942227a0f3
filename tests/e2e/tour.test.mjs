// A newcomer's tour: from a server that has just started to a product on a ground, in three variants
// by twelve views of 1200 x 1200, denoised, downloaded as a zip; in at most twelve actions.
// TESSERA_TOUR=full renders at full size with 16 samples; by default the images are small.
// Both print how long it took, from the start of the server.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';
import {
  desktop,
  drop,
  glbOf,
  phone,
  sceneOf,
  serverAndBrowser,
  settles,
  until,
} from './harness.mjs';

// The mock server makes no batches.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const { server, openPage } = serverAndBrowser({ skip });
const actionsMost = 12;
const full = process.env.TESSERA_TOUR === 'full';
const side = full ? 1200 : 16;
const patienceMs = full ? 7_200_000 : 120_000;

/** A box of half a metre, in red, green and blue. */
function product() {
  const corners = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const facing of [-1, 1])
      for (const [u, v] of facing > 0
        ? [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]
        : [[-1, -1], [1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]]) {
        const at = [0, 0, 0];
        at[axis] = 0.25 * facing;
        at[(axis + 1) % 3] = 0.25 * u;
        at[(axis + 2) % 3] = 0.25 * v;
        corners.push(...at);
      }
  const bin = Buffer.from(new Float32Array(corners).buffer);
  const paint = (r, g, b) => ({
    pbrMetallicRoughness: { baseColorFactor: [r, g, b, 1], metallicFactor: 0, roughnessFactor: 0.4 },
  });
  const names = ['red', 'green', 'blue'];
  const mappings = names.map((_, i) => ({ material: i, variants: [i] }));
  const document = {
    asset: { version: '2.0' },
    extensionsUsed: ['KHR_materials_variants'],
    extensions: { KHR_materials_variants: { variants: names.map((name) => ({ name })) } },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [
      {
        primitives: [
          {
            attributes: { POSITION: 0 },
            material: 0,
            extensions: { KHR_materials_variants: { mappings } },
          },
        ],
      },
    ],
    materials: [paint(0.8, 0.05, 0.05), paint(0.05, 0.6, 0.1), paint(0.05, 0.1, 0.8)],
    buffers: [{ byteLength: bin.length }],
    bufferViews: [{ buffer: 0, byteLength: bin.length }],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count: 36,
        type: 'VEC3',
        min: [-0.25, -0.25, -0.25],
        max: [0.25, 0.25, 0.25],
      },
    ],
  };
  return glbOf(JSON.stringify(document), bin);
}

/** Names of the entries of a zip without a comment, by its directory. */
function entriesOf(zip) {
  const end = zip.lastIndexOf(Buffer.from('PK\x05\x06', 'latin1'));
  let at = zip.readUInt32LE(end + 16);
  return Array.from({ length: zip.readUInt16LE(end + 10) }, () => {
    const length = zip.readUInt16LE(at + 28);
    const name = zip.toString('utf8', at + 46, at + 46 + length);
    at += 46 + length + zip.readUInt16LE(at + 30) + zip.readUInt16LE(at + 32);
    return name;
  });
}

for (const [name, device] of [
  ['desktop', desktop],
  ['phone', phone],
])
  test(`a product becomes 36 images in at most ${actionsMost} actions on a ${name}`, {
    skip,
    timeout: full ? 7_500_000 : 300_000,
  }, async (t) => {
    const begin = Date.now();
    const page = await openPage(device, '#/jobs', async (fresh) => {
      if (full) return;
      // The page's requests, but with small images.
      await fresh.route(/\/v1\/(jobs|batches)(\?dry_run=1)?$/, async (way) => {
        if (way.request().method() !== 'POST') return way.continue();
        const body = way.request().postDataJSON();
        const job = body.template ?? body;
        job.film = { ...job.film, width: side, height: side };
        job.stop = { samples_per_pixel: 4 };
        await way.continue({ postData: JSON.stringify(body) });
      });
    });
    let actions = 0;
    const act = async (step) => {
      actions += 1;
      await step();
    };
    await until('scenes in the list', () => sceneOf(page));
    const look = async (what) => {
      if (process.env.TESSERA_SHOTS)
        await page.screenshot({ path: `${process.env.TESSERA_SHOTS}/tour-${name}-${what}.png` });
    };
    await act(() => drop(page, [{ name: 'box.glb', bytes: product() }]));
    await until('the upload', async () => /^[0-9a-f]{64}$/.test(await sceneOf(page)));
    // A plain page, or the camera's: either has the form.
    await page.waitForSelector('[data-testid=series-fields]');
    await look('dropped');
    await act(() => page.selectOption('[data-testid=size]', '6'));
    await act(() => page.selectOption('[data-testid=ground]', 'catcher'));
    await act(() => page.click('[data-testid=series-fields] summary'));
    await act(() => page.fill('[data-testid=views]', '12'));
    await act(() => page.check('[data-testid=all-variants]'));
    if (full) await act(() => page.fill('[data-testid=stop-samples]', '16'));
    const button = page.getByTestId('submit');
    await settles('what is rendered', () => button.textContent(), 'Render 36 images');
    await look('form');
    await act(() => button.click());
    await page.waitForURL(/#\/series\//);
    await until(
      'the end',
      async () => /^Finished/.test(await page.textContent('[data-testid=series-state]')),
      patienceMs,
    );
    t.diagnostic(`rendered after ${((Date.now() - begin) / 1000).toFixed(1)} s`);
    const archive = page.getByTestId('archive');
    const denoise = async () => /denoise=(\w+)/.exec(await archive.getAttribute('href'))[1];
    await settles('denoised without asking', denoise, 'mixed');
    await look('series');
    let file;
    await act(async () => {
      [file] = await Promise.all([
        page.waitForEvent('download', { timeout: patienceMs }),
        archive.click(),
      ]);
    });
    await page.uncheck('[data-testid=series-denoised]');
    await settles('plain when asked', denoise, 'off');
    await page.check('[data-testid=series-denoised]');
    await page.selectOption('[data-testid=series] select', 'exr');
    await settles('EXR with all layers', denoise, 'off');
    const zip = fs.readFileSync(await file.path());
    const entries = entriesOf(zip);
    assert.equal(new Set(entries).size, 36);
    for (const variant of ['red', 'green', 'blue'])
      assert.equal(entries.filter((entry) => entry.includes(variant)).length, 12);
    // Each PNG has the right size and colours with alpha (type 6).
    const head = zip.indexOf('IHDR');
    assert.deepEqual(
      [zip.readUInt32BE(head + 4), zip.readUInt32BE(head + 8), zip[head + 13]],
      [side, side, 6],
    );
    assert.ok(actions <= actionsMost, `${actions} actions`);
    t.diagnostic(
      `${actions} actions, ${((server.startMs + Date.now() - begin) / 1000).toFixed(1)} s from ` +
        `the start of the server, which took ${(server.startMs / 1000).toFixed(1)} s`,
    );
    assert.deepEqual(page.faults, []);
    await page.context().close();
  });
