// "Use again" and Render make the same job: every member of a job request, each with a value
// other than its default, is restored.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ask, desktop, movingGlb, panorama, serverAndBrowser, until } from './harness.mjs';

// The mock server does not check requests.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const { server, withPage } = serverAndBrowser({ skip });

const film = { width: 24, height: 16 };
const common = {
  name: 'again',
  film,
  light_sampler: { type: 'tree' },
  stop: { samples_per_pixel: 2 },
};
/** Jobs that together have every member of the schema. */
const requests = {
  'a polished sweep through a lens': {
    ...common,
    scene: 'cornell-box',
    labels: { shop: 'north', order: '17' },
    priority: -3,
    seed: 7,
    camera: {
      name: 'camera',
      position: [1, 1.5, 3.25],
      target: [0, 0.5, 0.125],
      up: [0.1, 1, 0],
      type: 'perspective',
      vertical_fov_degrees: 35,
      aperture_radius: 0.02,
      focus_distance: 2.5,
    },
    motion_seconds: 0.125,
    environment: { color: [0.3, 0.4, 0.7], intensity: 1.5, rotation_degrees: 30 },
    background: { type: 'color', color: [0.123, 0.2, 0.9] },
    ground: { type: 'sweep', height: -0.25, color: [0.2, 0.3, 0.4], reflection: 0.35 },
    film: {
      ...film,
      crop: { x: 3, y: 5, width: 11, height: 7 },
      filter: { type: 'gaussian', radius: 2 },
      layers: ['albedo', 'object', 'position'],
    },
    integrator: { type: 'path', max_depth: 5 },
    estimator: {
      mis: { type: 'power', exponent: 3 },
      roulette: { type: 'threshold', delta: 0.05 },
      splitting: { type: 'fixed', count: 3 },
      control_variate: { type: 'regression' },
    },
    sampler: { type: 'halton', replicates: 4, first_replicate: 4 },
    light_sampler: { type: 'ris', candidates: 5 },
    stop: {
      samples_per_pixel: 8,
      relative_error: 0.5,
      denoised_error: 0.25,
      confidence: 0.9,
      scope: 'worst_tile',
      seconds: 20,
      cpu_seconds: 30,
      deadline: new Date(Date.now() + 86_400_000).toISOString().replace(/\.\d+/, ''),
    },
    adaptive: { type: 'pilot', min_samples: 64, granularity: 'tile', dilation: 2 },
    denoise: { type: 'statistical', preview: false },
    retention_seconds: 3600,
  },
  'a catcher seen from an orbit': {
    ...common,
    scene: 'glass',
    camera: {
      orbit: { theta_degrees: 40, phi_degrees: 60, radius: 4.5, target: [0, 0.25, 0] },
      aperture_radius: 0.01,
      focus_distance: 4,
      shift: [0.125, -0.25],
    },
    environment: { preset: 'studio' },
    estimator: { mis: { type: 'balance' } },
    background: { type: 'transparent', through_glass: false },
    ground: {
      type: 'catcher',
      height: -0.5,
      color: [0.5, 0.5, 0.6],
      shadow: { color: 'physical', strength: 0.75, softness: 0.25 },
    },
    units: 'photometric',
    stop: { ...common.stop, meter_error: 0.5 },
    meter: {
      points: [{ position: [0, 1, 0], normal: [0, 1, 0] }],
      plane: { origin: [0, 0, 0], edge_u: [1, 0, 0], edge_v: [0, 0, -1], columns: 2, rows: 3 },
    },
  },
  'a meter without an image': {
    scene: 'cornell-box',
    film: null,
    light_sampler: { type: 'tree' },
    meter: {
      points: [{ position: [0, 0.4, 0], normal: [0, 0, 1] }],
      plane: {
        origin: [0, 0.4, 0.25],
        edge_u: [0.2, 0, 0],
        edge_v: [0, 0, -0.3],
        columns: 4,
        rows: 3,
      },
    },
    stop: { samples_per_pixel: 4, meter_error: 0.25 },
  },
  'an orthographic view of fog': {
    ...common,
    scene: 'glass',
    camera: {
      type: 'orthographic',
      orthographic_height: 2.5,
      position: [0, 0, 5],
      target: [0, 0, 0],
    },
    environment: { color: [1, 1, 1], visible: false },
    medium: {
      type: 'homogeneous',
      scattering: [0.1, 0.2, 0.3],
      absorption: [0.01, 0.02, 0.03],
      g: 0.5,
      height_falloff: 0.25,
    },
    spectral: true,
  },
  'a calibrated camera': {
    ...common,
    scene: 'glass',
    camera: {
      type: 'pinhole',
      fx: 300,
      fy: 310.5,
      cx: 20.25,
      cy: 18.5,
      distortion: { model: 'opencv', k: [-0.125, 0.0625, 0.001, -0.002] },
      pose: {
        convention: 'opengl',
        matrix: [1, 0, 0, 0, 0, 1, 0, 0.5, 0, 0, 1, 5, 0, 0, 0, 1],
      },
    },
  },
  'sun and sky, reused between pixels': {
    ...common,
    scene: 'furnace',
    camera: { index: 0 },
    environment: { sun: { latitude: 35.68, longitude: 139.69, time: '2026-03-20T03:04:05Z' } },
    background: { type: 'blurred' },
    light_sampler: { type: 'restir', block: 2, history: 2, candidates_per_pixel: 4 },
  },
  'a strategy for study': {
    ...common,
    scene: 'veach-mis',
    estimator: { strategy: 'light', expected_values: false },
    stop: { ...common.stop, light_not_found: 0.25 },
  },
  photons: {
    ...common,
    scene: 'glass',
    integrator: { type: 'photon-map', photons: 4096, radius_m: 0.05, final_gather: 2 },
  },
  'shrinking photons': {
    ...common,
    scene: 'glass',
    integrator: { type: 'sppm', photons: 4096, radius_m: 0.05, alpha: 0.8 },
  },
  'cached irradiance': {
    ...common,
    scene: 'cornell-box',
    integrator: { type: 'irradiance-cache', tolerance: 0.5, rays: 64, records: 2048 },
  },
};
/** With files that are uploaded: a model with a variant and an animation, an environment map. */
const ownFiles = (scene, asset) => ({
  ...common,
  scene,
  variant: 'plain',
  time_seconds: 0.25,
  shutter_seconds: 0.125,
  environment: { asset, color: [0.5, 0.6, 0.7], intensity: 2, rotation_degrees: 90 },
});
/**
 * Who is notified, and how previews are served: neither is a setting of the image. Caustics are
 * settled before a job renders: its integrator is the choice. A measured light sampler is settled
 * too, so jobs name one.
 */
const notSettings = [
  '/class',
  '/preview_key',
  '/webhook/url',
  '/webhook/events',
  '/integrator/caustics',
];

const post = async (body) => {
  const answer = await ask(`${server.url}/v1/jobs`, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify(body),
  });
  const job = await answer.json();
  assert.equal(answer.status, 201, JSON.stringify(job));
  return job;
};

/** The schemas of all members that have no members themselves, by path. */
function leavesOf(schema, schemas, path = '', out = new Map()) {
  const name = (schema.anyOf?.[0] ?? schema).$ref?.split('/').at(-1);
  const { properties, ...leaf } = name ? schemas[name] : schema;
  for (const [key, inner] of Object.entries(properties ?? {}))
    leavesOf(inner, schemas, `${path}/${key}`, out);
  if (!properties) out.set(path, leaf);
  return out;
}

const at = (value, path) =>
  path
    .slice(1)
    .split('/')
    .reduce((inner, key) => inner?.[key], value);

test('every member of a job request is in one of the jobs, with a value other than its default', {
  skip,
}, async () => {
  const { components } = await (await ask(`${server.url}/openapi.json`)).json();
  const all = [...Object.values(requests), ownFiles('a'.repeat(64), 'a'.repeat(64))];
  for (const [path, leaf] of leavesOf(components.schemas.JobRequest, components.schemas)) {
    if (notSettings.includes(path)) continue;
    const values = all.map((request) => at(request, path)).filter((v) => v !== undefined);
    const standard = JSON.stringify(leaf['x-default']);
    const others = values.filter((v) => JSON.stringify(v) !== standard || leaf.enum?.length === 1);
    assert.notEqual(others.length, 0, `no job has ${path}`);
  }
});

async function isMadeAgain(request) {
  const job = await post(request);
  await withPage(desktop, `#/jobs/${job.id}`, async (page) => {
    await page.click('[data-testid=use-again]');
    await until('the form', async () =>
      /form has the settings/.test(await page.textContent('body')),
    );
    await page.click('[data-testid=submit]');
    await page.waitForURL((url) => /#\/jobs\//.test(url.href) && !url.href.endsWith(job.id));
    const id = page.url().split('/').at(-1).split('?')[0];
    const again = await (await ask(`${server.url}/v1/jobs/${id}`)).json();
    assert.deepEqual(again.spec, job.spec);
  });
  return job;
}

for (const [name, request] of Object.entries(requests))
  test(`all settings are restored: ${name}`, { skip, timeout: 120_000 }, () =>
    isMadeAgain(request),
  );

test('all settings are restored: uploaded files', { skip, timeout: 120_000 }, async () => {
  const upload = async (path, type, body) => {
    const init = { method: 'POST', headers: { 'content-type': type }, body };
    return (await (await ask(`${server.url}${path}`, init)).json()).id;
  };
  const scene = await upload('/v1/scenes', 'model/gltf-binary', movingGlb());
  const asset = await upload('/v1/assets', 'application/octet-stream', panorama());
  await isMadeAgain(ownFiles(scene, asset));
});

test('changing a setting in the form does not change others', {
  skip,
  timeout: 120_000,
}, async () => {
  const job = await post(requests['a polished sweep through a lens']);
  await withPage(desktop, `#/jobs/${job.id}`, async (page) => {
    await page.click('[data-testid=use-again]');
    await page.waitForSelector('[data-testid=reused]');
    const kept = await until('no defaults in the list', async () => {
      const text = await page.textContent('[data-testid=reused]');
      return !/visible true/.test(text) && text;
    });
    for (const name of ['ground height -0.25', 'film filter radius 2', 'labels shop north'])
      assert.ok(kept.includes(name), `${name} in ${kept}`);
    assert.ok(!kept.includes('reflection'), kept);
    const { spec } = job;
    const submitted = async () => {
      const sent = page.waitForRequest(
        (r) => r.method() === 'POST' && /\/v1\/jobs$/.test(r.url()) && !r.postDataJSON().class,
      );
      await page.click('[data-testid=submit]');
      return (await (await (await sent).response()).json()).spec;
    };
    await page.fill('[data-testid=ground-reflection]', '100');
    await page.selectOption('[data-testid=ground]', 'catcher');
    await page.getByLabel('Environment light').selectOption('rim');
    const changed = await submitted();
    assert.deepEqual(changed.ground, { ...spec.ground, type: 'catcher', reflection: 1 });
    assert.deepEqual(changed.background.type, 'transparent');
    assert.deepEqual(
      [changed.environment.preset, changed.environment.intensity],
      ['rim', spec.environment.intensity],
    );
    assert.deepEqual([changed.camera, changed.film], [spec.camera, spec.film]);
    // Another camera keeps the lens; members of another integrator are dropped.
    await page.goto(`${server.url}/#/jobs/${job.id}`);
    await page.click('[data-testid=use-again]');
    await page.getByLabel('Camera', { exact: true }).selectOption('camera');
    await page.getByText('Advanced settings').click();
    await page.getByLabel('Light selection').selectOption('power');
    const other = await submitted();
    assert.deepEqual(
      [other.camera.position, other.camera.aperture_radius, other.light_sampler],
      [null, 0.02, { type: 'power' }],
    );
    await page.goto(`${server.url}/#/jobs/${job.id}`);
    await page.click('[data-testid=use-again]');
    await page.getByRole('button', { name: 'Drop these settings' }).click();
    const plain = await submitted();
    assert.deepEqual([plain.ground.height, plain.labels], [null, {}]);
  });
});

test('the URL of an image shows the same view and size', { skip, timeout: 120_000 }, async () => {
  const { position, target } = requests['a polished sweep through a lens'].camera;
  const placed = { ...common, scene: 'glass', seed: 3, camera: { position, target } };
  const orbit = { theta_degrees: 30, phi_degrees: 75, radius: 4, target: [0, 1, 0] };
  for (const request of [placed, { ...placed, camera: { orbit } }]) {
    const job = await post(request);
    await until('the image', async () => {
      const { state } = await (await ask(`${server.url}/v1/jobs/${job.id}`)).json();
      return state === 'finished';
    });
    await withPage(desktop, `#/jobs/${job.id}`, async (page) => {
      await page.evaluate(() => {
        const writeText = (text) => Promise.resolve((globalThis.copied = text));
        Object.defineProperty(navigator, 'clipboard', { value: { writeText } });
      });
      await page.click('[data-testid=more]');
      await page.click('[data-testid=copy-url]');
      const url = await until('the URL', () => page.evaluate(() => globalThis.copied));
      assert.match(url, new RegExp(`/i/public/render-${job.id.slice(0, 8)}/glass/`));
      await until('the final image', async () => {
        const answer = await ask(url);
        if (answer.status !== 200) return false;
        assert.equal(answer.headers.get('content-type'), 'image/webp');
        return /immutable/.test(answer.headers.get('cache-control'));
      });
      const { jobs } = await (await ask(`${server.url}/v1/jobs?limit=1`)).json();
      assert.notEqual(jobs[0].id, job.id);
      assert.deepEqual(jobs[0].spec.film, job.spec.film);
      assert.equal(jobs[0].spec.seed, 3);
      const { camera } = jobs[0].spec;
      if (job.spec.camera.orbit) return assert.deepEqual(camera, job.spec.camera);
      assert.deepEqual(camera.orbit.target, target);
      const [x, y, z] = position.map((p, i) => p - target[i]);
      assert.ok(Math.abs(camera.orbit.radius - Math.hypot(x, y, z)) < 1e-5);
      assert.ok(Math.abs(camera.orbit.theta_degrees - (Math.atan2(x, z) * 180) / Math.PI) < 1e-3);
    });
  }
});
