// The TypeScript client (clients/js) in Node and in a page of another origin, and its examples.
import assert from 'node:assert/strict';
import { execFile, execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import net from 'node:net';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { promisify } from 'node:util';
import { ask, serverAndBrowser, Server, triangleGlb, until } from './harness.mjs';

const here = path.dirname(fileURLToPath(import.meta.url));
const clients = path.join(here, '../../clients');
const modules = path.join(here, 'node_modules');
// Below node_modules, so that express is found.
const home = path.join(modules, '.client');
const installed = path.join(home, 'node_modules/tessera-render');
const tsc = (...flags) =>
  execFileSync(process.execPath, [path.join(modules, 'typescript/bin/tsc'), ...flags], {
    cwd: home,
    stdio: 'inherit',
  });

/** As `npm install` of the package and a copy of its examples. */
function install() {
  fs.rmSync(home, { recursive: true, force: true });
  fs.mkdirSync(installed, { recursive: true });
  fs.copyFileSync(path.join(clients, 'js/package.json'), path.join(installed, 'package.json'));
  tsc('-p', path.join(clients, 'js'), '--outDir', path.join(installed, 'dist'));
  fs.cpSync(path.join(clients, 'examples/js'), home, { recursive: true });
  fs.writeFileSync(path.join(home, 'package.json'), '{"type": "module"}');
}

/** The folder of the examples as a site. */
let site;
async function openSite() {
  install();
  const types = { '.html': 'text/html', '.js': 'text/javascript' };
  site = http.createServer((request, response) => {
    const file = path.join(home, new URL(request.url, 'http://site').pathname);
    if (!fs.existsSync(file)) return response.writeHead(404).end();
    response.writeHead(200, { 'content-type': types[path.extname(file)] });
    response.end(fs.readFileSync(file));
  });
  await new Promise((resolve) => site.listen(0, '127.0.0.1', resolve));
  process.env.TESSERA_ORIGINS = `http://localhost:${site.address().port}`;
}

// The mock server has no uploads, and a server elsewhere its own keys and origins.
const skip = process.env.TESSERA_BINARY && !process.env.TESSERA_URL ? false : 'needs the server';
const { server, newContext } = serverAndBrowser({ skip, beforeStart: openSite });
const locked = new Server({ key: 'a-key-of-sixteen-bytes-or-more' });
let library;
before(async () => {
  if (skip) return;
  await until('the package', () => fs.existsSync(path.join(installed, 'dist/index.js')));
  library = await import(pathToFileURL(path.join(installed, 'dist/index.js')));
});
after(() => {
  delete process.env.TESSERA_ORIGINS;
  site?.close();
  return locked.stop();
});

const test_ = (name, run) => test(name, { skip, timeout: 120_000 }, run);
const client = (url = server.url, options) => new library.Client(url, options);
const sizeOf = (png) => {
  assert.equal(Buffer.from(png.subarray(1, 4)).toString(), 'PNG');
  const view = new DataView(png.buffer, png.byteOffset);
  return [view.getUint32(16), view.getUint32(20)];
};
const small = { size: [64, 48], samples: 16 };
const all = async (stream) => {
  const out = [];
  for await (const each of stream) out.push(each);
  return out;
};

/** A server's address whose next answer is cut off after `bytes`. */
async function relay(bytes) {
  let left = bytes;
  const heads = [];
  const listener = net.createServer((near) => {
    const far = net.connect(new URL(server.url).port, '127.0.0.1');
    const close = () => (near.destroy(), far.destroy());
    for (const end of [near, far]) end.on('error', close).on('close', close);
    near.on('data', (piece) => {
      heads.push(piece.toString('latin1'));
      far.write(piece);
    });
    far.on('data', (piece) => {
      near.write(left < piece.length ? piece.subarray(0, left) : piece);
      left -= piece.length;
      if (left <= 0) near.end();
      if (left <= 0) left = Infinity;
    });
  });
  await new Promise((resolve) => listener.listen(0, '127.0.0.1', resolve));
  after(() => listener.close());
  return { url: `http://127.0.0.1:${listener.address().port}`, heads };
}

test_('render() uploads a model and returns the image with its error', async () => {
  const { bytes, type, job } = await client().render(triangleGlb(), {
    size: [64, 48],
    error: 0.2,
  });
  assert.equal(type, 'image/png');
  assert.deepEqual(sizeOf(bytes), [64, 48]);
  assert.equal(job.stop_reason, 'relative_error');
  assert.ok(job.error.high <= 0.2);
});

test_('render() takes a scene by name, other formats and queries of the image', async () => {
  const { bytes, type } = await client().render('furnace', {
    ...small,
    format: 'jpg',
    query: { max_size: 32 },
  });
  assert.equal(type, 'image/jpeg');
  assert.equal(Buffer.from(bytes.subarray(0, 2)).toString('hex'), 'ffd8');
});

/** A server with POST /v1/render, which answers with these statuses in turn and records requests. */
async function atOnce(...statuses) {
  const asked = [];
  const job = { id: 'a-job', state: 'finished', error: { relative: 0.01 } };
  const listener = http.createServer(async (request, response) => {
    const pieces = await all(request);
    const { pathname, search } = new URL(request.url, 'http://tessera');
    asked.push(`${request.method} ${pathname}`);
    const json = (value) => response.end(JSON.stringify(value));
    const parameters = [{ name: 'format' }, { name: 'exposure' }];
    if (pathname === '/openapi.json')
      return json({ paths: { '/v1/render': { post: { parameters } } } });
    if (pathname === '/v1/jobs/a-job') return json(job);
    if (pathname === '/v1/render') {
      const type = request.headers['content-type'];
      const body = new Response(Buffer.concat(pieces), { headers: { 'content-type': type } });
      const form = /^multipart/.test(type) && (await body.formData());
      asked.form = form ? Object.fromEntries(form) : { job: await body.text() };
      asked.query = search;
      const status = statuses.shift() ?? 200;
      response.writeHead(status, { location: '/below/v1/jobs/a-job', 'content-type': 'image/png' });
      return response.end(status === 200 ? 'direct' : '');
    }
    response.writeHead(404).end();
  });
  await new Promise((resolve) => listener.listen(0, '127.0.0.1', resolve));
  after(() => listener.close());
  return { url: `http://127.0.0.1:${listener.address().port}`, asked };
}

test_('render() is one request where the server offers that', async () => {
  const { url, asked } = await atOnce(200);
  const { bytes, type, job } = await client(url).render(triangleGlb(), small);
  assert.deepEqual([Buffer.from(bytes).toString(), type, job.id], ['direct', 'image/png', 'a-job']);
  assert.deepEqual(asked.slice(0), ['GET /openapi.json', 'POST /v1/render', 'GET /v1/jobs/a-job']);
  assert.equal(asked.query, '?format=png');
  assert.deepEqual(Buffer.from(await asked.form.scene.arrayBuffer()), triangleGlb());
  const { film, stop, scene } = JSON.parse(asked.form.job);
  assert.deepEqual([film, stop, scene], [{ width: 64, height: 48 }, { samples_per_pixel: 16 }, undefined]);
  await client(url).render('furnace', { format: 'exr' });
  assert.equal(asked.query, '?format=exr');
  const request = { scene: 'furnace', stop: { relative_error: 0.03, seconds: 10 } };
  assert.deepEqual(JSON.parse(asked.form.job), request);
});

test_('render() waits for the job that one request did not end', async () => {
  const { url, asked } = await atOnce(202);
  const { bytes } = await client(url).render('furnace', small);
  assert.equal(Buffer.from(bytes).toString(), 'direct');
  const round = ['POST /v1/render', 'GET /v1/jobs/a-job'];
  assert.deepEqual(asked.slice(0), ['GET /openapi.json', ...round, ...round]);
});

test_('short forms do not replace the other members of film and stop', () => {
  const request = library.requestOf('a', {
    size: [8, 4],
    error: 0.5,
    film: { layers: [] },
    stop: { seconds: 3, confidence: 0.9 },
  });
  assert.deepEqual(request, {
    scene: 'a',
    film: { layers: [], width: 8, height: 4 },
    stop: { seconds: 3, confidence: 0.9, relative_error: 0.5 },
  });
  assert.deepEqual(library.requestOf('a'), { scene: 'a' });
});

test_('a refused request is an error with the members of the problem', async () => {
  const refused = await client()
    .submit('furnace', { size: [0, 9] })
    .catch((error) => error);
  assert.ok(refused instanceof library.RequestError && refused instanceof Error);
  const { status, type, title, detail, errors, instance, message } = refused;
  assert.equal(status, 422);
  assert.deepEqual(errors, [{ pointer: '/film/width', detail: '0 is outside [1, 16384]' }]);
  assert.equal(message, detail);
  assert.ok(title && type);
  assert.equal(instance, '/v1/jobs');
});

test_('a server that is not there is an OfflineError', async () => {
  await assert.rejects(client('http://127.0.0.1:1').server(), library.OfflineError);
});

test_('an aborted render() cancels its job', async () => {
  const abort = new AbortController();
  const done = client().render('glass', {
    size: [256, 256],
    samples: 65536,
    name: 'aborted',
    signal: abort.signal,
  });
  const job = await until('its job', async () => (await client().jobs({ name: 'aborted' })).jobs[0]);
  abort.abort();
  await assert.rejects(done, { name: 'AbortError' });
  await until('its end', async () => (await client().job(job.id)).state === 'cancelled');
});

test_('a key is sent with every request', async () => {
  await locked.start();
  const key = 'a-key-of-sixteen-bytes-or-more';
  await assert.rejects(client(locked.url).server(), { status: 401 });
  const job = await client(locked.url, { key }).submit('furnace', small);
  const events = await all(client(locked.url, { key }).events(job.id));
  assert.equal(events.at(-1).type, 'end');
  const ended = await all(client(locked.url, { key }).tiles(job.id));
  assert.equal(ended.length, 4);
});

test_('events begin with the job, end with it and go on after a given id', async () => {
  const job = await client().submit('furnace', small);
  const events = await all(client().events(job.id));
  assert.deepEqual(
    [events[0].type, events[0].data.id, events.at(-1).type, events.at(-1).data.state],
    ['snapshot', job.id, 'end', 'finished'],
  );
  assert.deepEqual(await all(client().events(job.id, { lastEventId: events.at(-1).id })), []);
  await assert.rejects(all(client().events('00000000-0000-4000-8000-000000000000')), {
    status: 404,
  });
});

test_('events go on where a connection broke', async () => {
  const job = await client().submit('cornell-box', { size: [160, 90], seconds: 2 });
  const { url, heads } = await relay(6000);
  let lost = 0;
  const events = await all(client(url).events(job.id, { onLost: () => (lost += 1) }));
  assert.equal(lost, 1);
  assert.equal(events.at(-1).type, 'end');
  const again = heads.map((head) => /^last-event-id: (.*)\r$/im.exec(head)?.[1]);
  assert.deepEqual([again.length, again[0]], [2, undefined]);
  assert.ok(
    events.some(({ id }) => id === again[1]),
    `asked again after ${again[1]}`,
  );
});

test_('tiles are the image, also through a broken connection', async () => {
  const { id } = await client().submit('cornell-box', { size: [96, 40], samples: 16 });
  await client().wait(id);
  const { url, heads } = await relay(10_000);
  const film = new Float32Array(96 * 40).fill(NaN);
  for await (const tile of client(url).tiles(id)) {
    const { x, y, width, height, planes } = tile;
    assert.equal(planes.length, 7 * width * height);
    for (let row = 0; row < height; ++row)
      film.set(planes.subarray(row * width, (row + 1) * width), (y + row) * 96 + x);
  }
  assert.equal(heads.length, 2);
  for (const [x, y] of [[0, 0], [95, 39], [40, 33]]) {
    const { mean } = (await client().pixel(id, x, y)).layers.beauty;
    assert.ok(Math.abs(film[y * 96 + x] - mean[0]) <= 1e-6 * Math.abs(mean[0]), `${x}, ${y}`);
  }
  const means = await all(client().tiles(id, { planes: 'mean' }));
  assert.deepEqual([means.length, means[0].meanOnly], [6, true]);
});

test_('the laboratory streams its lines', async () => {
  const request = { experiment: 'pi', n: [64, 256], replicates: 64, seed: 1 };
  const lines = await all(client().lab(request));
  assert.equal(lines.length, 3);
  assert.deepEqual(lines.slice(0, 2).map(({ n }) => n), [64, 256]);
  assert.ok('verdict' in lines[2]);
});

const example = (...words) =>
  promisify(execFile)(process.execPath, words, {
    cwd: home,
    env: { ...process.env, TESSERA_SERVER: server.url },
  });

test_('the examples of the README run from top to bottom', async () => {
  const text = fs.readFileSync(path.join(clients, 'js/README.md'), 'utf8');
  const blocks = [...text.matchAll(/^```js\n(.*?)^```$/gms)].map(([, code]) => code);
  assert.equal(blocks.length, 4);
  fs.writeFileSync(path.join(home, 'readme.mjs'), blocks.join('\n'));
  const { stdout } = await example('readme.mjs');
  assert.match(stdout, /^image\/png 0\.\d+ 0\.\d+ 0\.\d+$/m);
  assert.match(stdout, /^422 \/film\/width 0 is outside \[1, 16384\]$/m);
  assert.deepEqual(sizeOf(fs.readFileSync(path.join(home, 'cornell.png'))), [160, 90]);
  assert.equal(fs.readFileSync(path.join(home, 'glass.webp')).toString('latin1', 8, 12), 'WEBP');
});

test_('example: Node', async () => {
  fs.writeFileSync(path.join(home, 'model.glb'), triangleGlb());
  const { stdout } = await example('node.mjs', 'model.glb', 'image.png');
  assert.match(stdout, /^The average pixel is \d+\.\d% off\.$/m);
  assert.deepEqual(sizeOf(fs.readFileSync(path.join(home, 'image.png'))), [320, 180]);
});

test_('example: Express', async () => {
  const shop = spawn(process.execPath, ['express.mjs', '0'], {
    cwd: home,
    env: { ...process.env, TESSERA_SERVER: server.url },
    stdio: ['ignore', 'pipe', 'inherit'],
  });
  try {
    const view = await new Promise((resolve) =>
      shop.stdout.once('data', (line) => resolve(String(line).trim())),
    );
    const [one, other] = await Promise.all(
      [view, view.replace('30.png', '120.png')].map(async (url) => {
        const answer = await fetch(url);
        assert.equal(answer.headers.get('content-type'), 'image/png');
        return new Uint8Array(await answer.arrayBuffer());
      }),
    );
    assert.deepEqual(sizeOf(one), [160, 90]);
    assert.notDeepEqual(one, other);
    const refused = await fetch(view.replace('30.png', 'x.png'));
    assert.equal(refused.status, 422);
    const { errors } = await refused.json();
    assert.equal(errors[0].pointer, '/camera/orbit/theta_degrees');
  } finally {
    shop.kill();
  }
});

test_('example: a route of Next compiles strictly and answers with the image', async () => {
  const route = path.join(home, 'next/app/render/route.ts');
  const flags = '--strict --target ES2022 --lib ES2022,DOM,DOM.Iterable --module NodeNext';
  fs.writeFileSync(
    path.join(home, 'process.d.ts'),
    'declare const process: { env: Record<string, string | undefined> };',
  );
  tsc(route, path.join(home, 'process.d.ts'), ...flags.split(' '));
  process.env.TESSERA_SERVER = server.url;
  const { POST } = await import(pathToFileURL(route.replace(/ts$/, 'js')));
  const posted = (file) => {
    const body = new FormData();
    if (file) body.set('scene', new Blob([file]), 'model.glb');
    return POST(new Request('http://shop/render', { method: 'POST', body }));
  };
  const answer = await posted(triangleGlb());
  assert.equal(answer.headers.get('content-type'), 'image/png');
  assert.ok(Number(answer.headers.get('x-error')) > 0);
  assert.deepEqual(sizeOf(new Uint8Array(await answer.arrayBuffer())), [160, 90]);
  assert.equal((await posted(null)).status, 422);
  const refused = await posted(Buffer.from('{"asset": {"version": "1.0"}}'));
  assert.equal(refused.status, 422);
  assert.ok((await refused.json()).detail);
});

test_('example: a page of another origin renders a file', async () => {
  const page = await (await newContext()).newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  const { port } = site.address();
  const address = (host) =>
    `http://${host}:${port}/render.html?server=${encodeURIComponent(server.url)}`;
  const model = { name: 'model.glb', mimeType: 'model/gltf-binary', buffer: triangleGlb() };
  await page.goto(address('localhost'));
  await page.setInputFiles('input', model);
  await page.waitForSelector('img:not([hidden])');
  const width = await page
    .locator('img')
    .evaluate((image) => image.decode().then(() => image.naturalWidth));
  assert.equal(width, 320);
  assert.match(await page.textContent('[role=status]'), /^The average pixel is \d+\.\d% off\.$/);
  // The same page under a name that the server does not know.
  await page.goto(address('127.0.0.1'));
  await page.setInputFiles('input', model);
  await until('the refusal', async () =>
    /not responding/.test(await page.textContent('[role=status]')),
  );
  assert.deepEqual(faults, []);
  await page.close();
});
