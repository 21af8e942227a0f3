// Speaks the HTTP API with a synthetic picture, for work on the page and for its tests.
//   node dev/mock_server.mjs [--port 8090] [--demo] [--dist DIR] [--speed TILES_PER_SECOND]
// Nothing is kept on disk. `--dist` serves a built page at `/`.
import http from 'node:http';
import fs from 'node:fs';
import path from 'node:path';
import crypto from 'node:crypto';
import { isFinal, MockJob } from './mock_jobs.mjs';
import { png, tileFrame } from './mock_codec.mjs';
import { info, scenes } from './mock_info.mjs';

const flag = (name, fallback) => {
  const i = process.argv.indexOf(`--${name}`);
  return i < 0 ? fallback : process.argv[i + 1];
};
const dist = flag('dist', null);
const speed = Number(flag('speed', 150));
const defaults = {
  name: '',
  labels: {},
  priority: 0,
  seed: 0,
  class: 'normal',
  camera: {},
  variant: null,
  integrator: { type: 'path', max_depth: 16 },
  sampler: { type: 'sobol', replicates: 2 },
  light_sampler: { type: 'tree' },
  adaptive: { type: 'pilot' },
};
const jobs = new Map(),
  assets = new Map(),
  uploaded = new Map(),
  watchers = new Map();
const stream = crypto.randomBytes(4).toString('hex');

const problem = (res, status, title, detail, errors) =>
  send(
    res,
    status,
    { type: 'about:blank', title, status, detail, instance: '/', ...(errors && { errors }) },
    'application/problem+json',
  );
function send(res, status, body, type = 'application/json', headers = {}) {
  const data = Buffer.isBuffer(body) ? body : Buffer.from(JSON.stringify(body));
  res.writeHead(status, {
    'content-type': type,
    'content-length': data.length,
    'x-request-id': crypto.randomUUID(),
    ...headers,
  });
  res.end(data);
}
async function read(req) {
  const parts = [];
  for await (const part of req) parts.push(part);
  return Buffer.concat(parts);
}

function emit(job, type, data) {
  const seq = job.log.push({ type, data });
  for (const res of watchers.get(job.id) ?? [])
    res.write(`id: ${stream}-${seq}\nevent: ${type}\ndata: ${JSON.stringify(data)}\n\n`);
}

function parseJob(body) {
  const errors = [];
  const refuse = (pointer, detail) => errors.push({ pointer, detail });
  const known = new Set([
    ...Object.keys(defaults),
    'scene',
    'film',
    'stop',
    'environment',
    'preview_key',
    'time_seconds',
    'estimator',
    'medium',
    'spectral',
  ]);
  for (const key of Object.keys(body))
    if (!known.has(key)) refuse(`/${key}`, 'is not a member of a job request');
  if (!scenes.some((s) => s.name === body.scene) && !uploaded.has(body.scene))
    return { missing: `there is no scene "${body.scene}"` };
  const film = { width: 960, height: 540, ...body.film };
  for (const side of ['width', 'height'])
    if (!(film[side] >= 1 && film[side] <= 16384))
      refuse(`/film/${side}`, `${film[side]} is outside [1, 16384]`);
  const stop = body.stop ?? { samples_per_pixel: 256 };
  if (!Object.keys(stop).length) refuse('/stop', 'names no rule');
  if (
    stop.samples_per_pixel != null &&
    !(stop.samples_per_pixel >= 1 && stop.samples_per_pixel <= 65536)
  )
    refuse('/stop/samples_per_pixel', `${stop.samples_per_pixel} is outside [1, 65536]`);
  if (errors.length) return { errors };
  return { spec: { ...defaults, ...body, film, stop } };
}

function events(job, req, res) {
  const last = req.headers['last-event-id'];
  if (isFinal(job) && last === `${stream}-${job.log.length}`) return res.writeHead(204).end();
  res.writeHead(200, { 'content-type': 'text/event-stream', 'cache-control': 'no-store' });
  res.write(
    `id: ${stream}-${job.log.length}\nevent: snapshot\ndata: ${JSON.stringify(job.json())}\n\n`,
  );
  if (isFinal(job))
    return res.end(
      `id: ${stream}-${job.log.length}\nevent: end\n` +
        `data: ${JSON.stringify({ state: job.state, stop_reason: job.stopReason })}\n\n`,
    );
  const set = watchers.get(job.id) ?? watchers.set(job.id, new Set()).get(job.id);
  set.add(res);
  const ping = setInterval(() => res.write(': ping\n\n'), 15000);
  res.on('close', () => {
    clearInterval(ping);
    set.delete(res);
  });
}

function tiles(job, after, res) {
  res.writeHead(200, {
    'content-type': 'application/vnd.tessera.tiles',
    'cache-control': 'no-store',
  });
  let seen = after;
  const push = () => {
    const due = job.tiles.filter((t) => t.revision > seen).sort((a, b) => a.revision - b.revision);
    for (const tile of due) {
      res.write(tileFrame({ ...tile, planes: job.tilePlanes(tile) }));
      seen = tile.revision;
    }
    if (isFinal(job)) {
      res.end(
        tileFrame({
          revision: job.revision,
          x: 0,
          y: 0,
          width: 0,
          height: 0,
          error: job.error?.relative ?? NaN,
          planes: null,
        }),
      );
      clearInterval(timer);
    }
  };
  const timer = setInterval(push, 60);
  res.on('close', () => clearInterval(timer));
  push();
}

function cancel(job) {
  if (!isFinal(job)) job.finish('cancelled', 'cancelled');
}

function onChange(job, what) {
  if (what === 'state') emit(job, 'state', { state: job.state, stop_reason: job.stopReason });
  if (what === 'end') {
    emit(job, 'end', { state: job.state, stop_reason: job.stopReason });
    for (const res of watchers.get(job.id) ?? []) res.end();
  }
}

/** Newest first; a cursor is the number of preceding jobs. */
function jobPage(query) {
  const states = query.get('state')?.split(',');
  const name = query.get('name')?.toLowerCase() ?? '';
  const found = [...jobs.values()]
    .reverse()
    .filter((j) => j.spec.class !== 'preview' && (!states || states.includes(j.state)))
    .filter((j) => (j.spec.name || j.spec.scene).toLowerCase().includes(name));
  const from = Number(query.get('cursor') ?? 0),
    to = from + Number(query.get('limit') ?? 50);
  return {
    jobs: found.slice(from, to).map((j) => j.json()),
    next: to < found.length ? String(to) : null,
    damaged: [],
  };
}

function submit(spec) {
  const job = new MockJob(spec, onChange);
  if (spec.preview_key)
    for (const other of jobs.values())
      if (other.spec.preview_key === spec.preview_key) {
        cancel(other);
        jobs.delete(other.id);
      }
  jobs.set(job.id, job);
  setTimeout(
    () => {
      if (job.state !== 'queued') return;
      job.state = 'loading';
      onChange(job, 'state');
      setTimeout(
        () => {
          if (job.state !== 'loading') return;
          if (spec.name === 'fail') {
            job.failure = {
              type: 'about:blank',
              title: 'Scene cannot be loaded',
              status: 422,
              detail: 'accessor 3 points beyond the end of its buffer view',
              instance: '/',
            };
            job.finish('failed', 'failed');
          } else {
            job.start();
          }
        },
        spec.class === 'preview' ? 5 : 250,
      );
    },
    spec.class === 'preview' ? 1 : 120,
  );
  return job;
}

async function jobRoute(req, res, url, job, rest) {
  const size = { width: job.width, height: job.height };
  if (!rest && req.method === 'GET') return send(res, 200, job.json());
  if (!rest && req.method === 'DELETE') {
    if (!isFinal(job))
      return problem(res, 409, 'Conflict', 'the job is still running: cancel it first');
    jobs.delete(job.id);
    return res.writeHead(204).end();
  }
  if (!rest && req.method === 'PATCH') {
    const patch = JSON.parse(await read(req));
    if (isFinal(job)) return problem(res, 409, 'Conflict', 'the job has ended');
    if ('paused' in patch) {
      job.state = patch.paused ? 'paused' : 'rendering';
      onChange(job, 'state');
    }
    for (const key of ['name', 'priority', 'labels', 'stop'])
      if (key in patch) job.spec[key] = patch[key];
    return send(res, 200, job.json());
  }
  if (rest === 'cancel') {
    cancel(job);
    return send(res, 200, job.json());
  }
  if (rest === 'extend') {
    if (!isFinal(job)) return problem(res, 409, 'Conflict', 'the job has not ended');
    job.spec.stop = JSON.parse(await read(req)).stop;
    Object.assign(job, { state: 'rendering', stopReason: null, finishedAt: null });
    onChange(job, 'state');
    return send(res, 202, job.json());
  }
  if (rest === 'events') return events(job, req, res);
  if (rest === 'tiles') return tiles(job, Number(url.searchParams.get('after') ?? 0), res);
  if (rest === 'convergence') return send(res, 200, { points: job.points, slope: job.slope() });
  const image = /^image(?:\.(\w+))?$/.exec(rest);
  if (image) {
    if (!job.revision) return problem(res, 409, 'Conflict', 'there is no sample yet');
    if (image[1] && image[1] !== 'png')
      return send(res, 200, Buffer.from('mock'), 'application/octet-stream');
    const view = job.rgb8(
      url.searchParams.get('layer') ?? 'beauty',
      Number(url.searchParams.get('max_size') ?? Math.max(size.width, size.height)),
      Number(url.searchParams.get('exposure') ?? 0),
    );
    return send(res, 200, png(view.width, view.height, view.rgb), 'image/png', {
      etag: `"${job.revision}"`,
    });
  }
  const pixel = /^pixels\/(\d+)\/(\d+)$/.exec(rest);
  if (pixel && job.revision) {
    const [x, y] = [Number(pixel[1]), Number(pixel[2])];
    return x < size.width && y < size.height
      ? send(res, 200, job.pixel(x, y))
      : problem(res, 404, 'Not found', 'the pixel is outside the film');
  }
  return problem(res, 404, 'Not found', `there is nothing at ${url.pathname}`);
}

async function sceneRoute(req, res) {
  if (req.method === 'GET') return send(res, 200, { scenes: [...uploaded.values()], next: null });
  const type = req.headers['content-type'] ?? '';
  const body = await read(req);
  let name = 'uploaded';
  if (type.startsWith('application/json')) {
    const request = JSON.parse(body);
    if (!assets.has(request.gltf))
      return problem(res, 422, 'Unprocessable', 'unknown asset', [
        { pointer: '/gltf', detail: 'there is no such asset' },
      ]);
    name = 'gltf';
  } else if (type.startsWith('model/gltf-binary')) {
    if (body.toString('latin1', 0, 4) !== 'glTF')
      return problem(res, 422, 'Scene cannot be read', 'the first four bytes are not "glTF"', [
        { pointer: '', detail: 'the first four bytes are not "glTF"' },
      ]);
  } else if (type !== 'application/zip' && type !== 'model/gltf+json') {
    return problem(
      res,
      415,
      'Unsupported media type',
      `"${type}" is not one of model/gltf-binary, model/gltf+json, application/zip`,
    );
  }
  const id = crypto.createHash('sha256').update(body).digest('hex');
  const scene = {
    id,
    name,
    bytes: body.length,
    bounds: { min: [-1, 0, -1], max: [1, 2, 1] },
    triangles: 15340,
    instances: 4,
    cameras: [
      { name: 'main', type: 'perspective' },
      { name: 'detail', type: 'perspective' },
      { name: 'above', type: 'perspective' },
    ],
    lights: [],
    materials: ['brass', 'glaze', 'floor'],
    variants: ['noon', 'dusk'],
    animations: [],
    extensions: ['KHR_materials_variants'],
    warnings: [],
  };
  const status = uploaded.has(id) ? 200 : 201;
  uploaded.set(id, scene);
  return send(res, status, scene);
}

function page(req, res, url) {
  const name = url.pathname === '/' ? 'index.html' : url.pathname.slice(1);
  const file = dist && path.join(dist, path.normalize(name));
  if (!file || !file.startsWith(dist) || !fs.existsSync(file))
    return problem(res, 404, 'Not found', `there is nothing at ${url.pathname}`);
  const types = {
    '.html': 'text/html; charset=utf-8',
    '.js': 'text/javascript',
    '.css': 'text/css',
    '.svg': 'image/svg+xml',
    '.woff2': 'font/woff2',
  };
  return send(
    res,
    200,
    fs.readFileSync(file),
    types[path.extname(file)] ?? 'application/octet-stream',
    {
      'content-security-policy':
        "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'",
    },
  );
}

async function route(req, res) {
  const url = new URL(req.url, 'http://mock');
  const parts = url.pathname.split('/').slice(1);
  if (parts[0] !== 'v1') return page(req, res, url);
  if (parts[1] === 'server') return send(res, 200, info);
  if (parts[1] === 'assets' && req.method === 'POST') {
    const body = await read(req);
    const id = crypto.createHash('sha256').update(body).digest('hex');
    const known = assets.has(id);
    assets.set(id, body.length);
    return send(res, known ? 200 : 201, { id, bytes: body.length });
  }
  if (parts[1] === 'scenes' && parts.length === 2) return sceneRoute(req, res);
  if (parts[1] === 'scenes' && parts.length === 3) {
    const found = uploaded.get(parts[2]) ?? scenes.find((s) => s.name === parts[2]);
    return found
      ? send(res, 200, {
          cameras: [{ name: 'main', type: 'perspective' }],
          variants: [],
          bounds: { min: [-1, 0, -1], max: [1, 2, 1] },
          triangles: 36,
          materials: [],
          lights: [],
          warnings: [],
          id: found.name,
          ...found,
        })
      : problem(res, 404, 'Not found', 'there is no such scene');
  }
  if (parts[1] === 'jobs' && parts.length === 2) {
    if (req.method === 'GET') return send(res, 200, jobPage(url.searchParams));
    let body;
    try {
      body = JSON.parse(await read(req));
    } catch {
      return problem(res, 400, 'Broken JSON', 'the body is not JSON');
    }
    const parsed = parseJob(body);
    if (parsed.missing)
      return problem(res, 404, 'Not found', parsed.missing, [
        { pointer: '/scene', detail: parsed.missing },
      ]);
    if (parsed.errors)
      return problem(
        res,
        422,
        'The job request cannot be carried out',
        `${parsed.errors.length} member(s) refused`,
        parsed.errors,
      );
    if (url.searchParams.get('dry_run'))
      return send(res, 200, { spec: parsed.spec, estimate: { seconds: 12 } });
    const job = submit(parsed.spec);
    return send(res, 201, job.json(), 'application/json', { location: `/v1/jobs/${job.id}` });
  }
  if (parts[1] === 'jobs') {
    const job = jobs.get(parts[2]);
    return job
      ? jobRoute(req, res, url, job, parts.slice(3).join('/'))
      : problem(res, 404, 'Not found', 'there is no such job');
  }
  return problem(res, 404, 'Not found', 'not available in this build');
}

let budget = 0,
  tick = Date.now();
setInterval(() => {
  const now = Date.now(),
    seconds = (now - tick) / 1000;
  tick = now;
  const active = [...jobs.values()].filter((j) => j.state === 'rendering');
  budget = Math.min(budget + seconds * speed, speed / 4);
  for (const job of active) job.elapsed += seconds;
  while (budget >= 1 && active.some((j) => j.state === 'rendering')) {
    for (const job of active) {
      if (job.state !== 'rendering' || budget < 1) continue;
      budget -= 1;
      const tile = job.tiles[job.order[job.cursor]];
      const passed = job.step();
      emit(job, 'tile', {
        x: tile.x,
        y: tile.y,
        width: tile.width,
        height: tile.height,
        revision: tile.revision,
        samples: tile.n,
        error: tile.error,
        url:
          `/v1/jobs/${job.id}/image` +
          `?x=${tile.x}&y=${tile.y}&width=${tile.width}&height=${tile.height}`,
      });
      const reason = passed ? job.endPass() : null;
      if (reason) job.finish('finished', reason);
    }
  }
}, 15);
setInterval(() => {
  for (const job of jobs.values()) {
    if (job.state !== 'rendering') continue;
    const { progress, error, statistics, revision, available } = job.json();
    emit(job, 'progress', { progress, error, statistics, revision, available });
  }
}, 500);

const server = http.createServer((req, res) =>
  route(req, res).catch((e) => problem(res, 500, 'Internal error', String(e?.stack ?? e))),
);
server.listen(Number(flag('port', 8090)), '127.0.0.1', () => {
  console.log(`listening on http://127.0.0.1:${server.address().port}`);
  if (process.argv.includes('--demo'))
    submit(
      parseJob({
        scene: 'cornell-box',
        name: 'Demo',
        film: { width: 960, height: 540 },
        stop: { samples_per_pixel: 512 },
      }).spec,
    );
});
