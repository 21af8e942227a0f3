// Figures of the page in a browser: weight, first paint, tasks of the main thread while tiles
// arrive, and the latency of a moved camera. Prints, never asserts. usage: page_bench.mjs
// [--short], with the variables of e2e/harness.mjs.
import http from 'node:http';
import { performance } from 'node:perf_hooks';
import {
  desktop,
  launch,
  openPage,
  phone,
  pictureNow,
  Server,
  submit,
  until,
  weigh,
} from '../e2e/harness.mjs';

process.env.TESSERA_LOG_LEVEL ??= 'warning';
const short = process.argv.includes('--short');
const devices = [
  ['desktop', desktop, 1],
  ['phone', phone, 1],
  // A phone's processor, as simulated by the developer tools of browsers.
  ['phone, processor 4 times slower', phone, 4],
];

const sorted = (values) => [...values].sort((x, y) => x - y);
const quantile = (values, p) => sorted(values)[Math.min(values.length - 1, Math.floor(p * values.length))];
const ms = (value) => `${value.toFixed(value < 10 ? 1 : 0)} ms`;
const spread = (values) =>
  values.length
    ? `p50 ${ms(quantile(values, 0.5))}, p95 ${ms(quantile(values, 0.95))}, worst ${ms(Math.max(...values))} (${values.length})`
    : 'none';
const row = (name, text) => console.log(`  ${name.padEnd(46)} ${text}`);
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

async function slowDown(page, factor) {
  if (factor === 1) return;
  const session = await page.context().newCDPSession(page);
  await session.send('Emulation.setCPUThrottlingRate', { rate: factor });
}

async function weight(browser, server) {
  console.log('weight of the page, gzipped');
  const page = await openPage(browser, server, desktop, '#/nowhere');
  const asked = new Set();
  page.on('request', (request) => {
    const url = new URL(request.url());
    if (url.pathname === '/' || /\.(js|css|woff2|svg)$/.test(url.pathname)) asked.add(url.origin + url.pathname);
  });
  await page.reload();
  const sum = async () => {
    let bytes = 0;
    for (const url of asked) bytes += await weigh(url);
    return `${(bytes / 1000).toFixed(0)} KB in ${asked.size} files`;
  };
  await page.waitForSelector('h1');
  row('first view', await sum());
  await page.goto(`${server.url}/`);
  await submit(page, { scene: 'cornell-box', samples: 8 });
  await until('a picture', () => pictureNow(page));
  for (const view of ['compose/cornell-box', 'jobs', 'compare', 'lab', 'settings', 'guide/start', 'guide/course']) {
    await page.goto(`${server.url}/#/${view}`);
    await page.waitForSelector('h1');
  }
  row('with a render, the finder, the laboratory, guide', await sum());
  await page.context().close();
}

async function firstPaint(browser, server) {
  console.log('first contentful paint, nothing cached');
  for (const [name, device, factor] of devices) {
    const times = [];
    for (let i = 0; i < (short ? 3 : 10); ++i) {
      const page = await openPage(browser, server, device, '', (p) => slowDown(p, factor));
      const paint = () =>
        page.evaluate(() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime);
      times.push(await until('a first paint', paint));
      await page.context().close();
    }
    row(name, spread(times));
  }
}

/** Longest tasks of the page's main thread in a trace: wall time and processor time, in ms. */
export function mainThreadTasks(trace) {
  const { traceEvents } = JSON.parse(trace.toString());
  const main = new Set(
    traceEvents
      .filter((e) => e.name === 'thread_name' && e.args.name === 'CrRendererMain')
      .map((e) => `${e.pid}/${e.tid}`),
  );
  return traceEvents
    .filter((e) => e.ph === 'X' && /RunTask$/.test(e.name) && main.has(`${e.pid}/${e.tid}`))
    .map((e) => ({ wall: e.dur / 1000, busy: (e.tdur ?? 0) / 1000 }));
}

async function traced(browser, page, use) {
  await browser.startTracing(page, { categories: ['toplevel', 'devtools.timeline', '__metadata'] });
  const began = performance.now();
  await use();
  const seconds = (performance.now() - began) / 1000;
  return { tasks: mainThreadTasks(await browser.stopTracing()), seconds };
}

function tellTasks(name, { tasks, seconds }, tiles) {
  const busy = tasks.map((task) => task.busy);
  const wall = tasks.map((task) => task.wall);
  const share = busy.reduce((sum, value) => sum + value, 0) / (10 * seconds);
  const rate = tiles === null ? '' : `${(tiles / seconds).toFixed(0)} tiles/s; `;
  row(
    name,
    `${rate}longest ${ms(Math.max(...busy))} of processor time, ${ms(Math.max(...wall))} by the clock; ` +
      `over 50 ms: ${busy.filter((t) => t > 50).length} and ${wall.filter((t) => t > 50).length} ` +
      `of ${tasks.length}; busy ${share.toFixed(0)} %`,
  );
}

/**
 * Notes in the page itself when tiles arrive, cameras move, and pictures of them are made and
 * drawn.
 */
function noteFeeds() {
  const notes = [];
  globalThis.notes = notes;
  const note = (kind, ...more) => notes.push([kind, performance.now(), ...more]);
  globalThis.addEventListener('pointermove', () => note('move'), true);
  globalThis.Worker = class extends globalThis.Worker {
    constructor(...all) {
      super(...all);
      this.addEventListener('message', ({ data }) => {
        if (data.type === 'tiles')
          for (const tile of data.tiles) note('tile', `${tile.x},${tile.y}`);
      });
    }
  };
  const ask = globalThis.fetch;
  globalThis.fetch = (path, init) => {
    if (init?.method === 'POST' && path === '/v1/jobs') note('post', JSON.parse(init.body).film.width);
    return ask(path, init);
  };
  const read = Response.prototype.arrayBuffer;
  Response.prototype.arrayBuffer = async function () {
    const bytes = await read.call(this);
    if (this.url.includes('/tiles')) note('whole');
    return bytes;
  };
  const draw = CanvasRenderingContext2D.prototype.putImageData;
  CanvasRenderingContext2D.prototype.putImageData = function (...all) {
    if (this.canvas.className === 'viewfinder') note('draw');
    return draw.apply(this, all);
  };
}

const tilesOf = (page) => page.evaluate(() => globalThis.notes.filter(([kind]) => kind === 'tile').length);

async function tasksWhileTilesArrive(browser, server, source) {
  console.log(`tasks of the main thread while tiles arrive, ${source}`);
  for (const [name, device, factor] of devices) {
    const page = await openPage(browser, server, device, '', (p) => p.addInitScript(noteFeeds));
    await submit(page, { scene: 'cornell-box', size: '3', samples: 4096 });
    await until('tiles', () => pictureNow(page));
    await slowDown(page, factor);
    for (const view of ['picture', 'error', 'variance']) {
      await page.check(`[data-testid=view-${view}]`, { force: true });
      await sleep(500);
      const before = await tilesOf(page);
      const figures = await traced(browser, page, () => sleep(short ? 1500 : 5000));
      tellTasks(`${name}, ${view}`, figures, (await tilesOf(page)) - before);
    }
    await page.click('[data-testid=cancel]');
    await page.context().close();
  }
}

async function tasksOfViews(browser, server) {
  console.log('tasks of the main thread while a view opens');
  const page = await openPage(browser, server, desktop);
  const ids = [];
  for (const samples of [8, 16]) {
    await page.goto(`${server.url}/#/`);
    await submit(page, { scene: 'cornell-box', size: '3', samples });
    await until('the end', async () => /^Finished/.test(await page.textContent('[data-testid=state]')), 600_000);
    ids.push(new URL(page.url()).hash.split('/').pop());
  }
  await page.context().close();
  const [a, b] = ids;
  for (const [name, device, factor] of devices) {
    for (const [view, address, shown] of [
      ['render', `jobs/${a}`, async (p) => (await tilesOf(p)) >= 60 * 34],
      ['comparison', `compare/${a}/${b}`, (p) => p.locator('.compare-film canvas').last().isVisible()],
      ['list', 'jobs', (p) => p.locator('.job-card').first().isVisible()],
      ['course', 'guide/course', (p) => p.locator('h1').isVisible()],
    ]) {
      const opened = await openPage(browser, server, device, '#/settings', (p) =>
        p.addInitScript(noteFeeds),
      );
      await slowDown(opened, factor);
      const figures = await traced(browser, opened, async () => {
        await opened.goto(`${server.url}/#/${address}`);
        await until(view, () => shown(opened));
        await sleep(1500);
      });
      tellTasks(`${name}, ${view}`, figures, null);
      await opened.context().close();
    }
  }
}

const json = async (server, path, body) => {
  const response = await fetch(server.url + path, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify(body),
  });
  if (!response.ok) throw new Error(`${path}: ${response.status} ${await response.text()}`);
  return response.json();
};

/**
 * Milliseconds from the request until the first tile and until `count` different ones have been
 * read.
 */
function previewOverHttp(server, request, count) {
  const began = performance.now();
  return json(server, '/v1/jobs', request).then(
    (job) =>
      new Promise((resolve, reject) => {
        const times = {};
        const seen = new Set();
        let pending = Buffer.alloc(0);
        const read = (chunk) => {
          pending = Buffer.concat([pending, chunk]);
          while (pending.length >= 32 && pending.length >= 32 + pending.readUInt32LE(4)) {
            if (!(pending.readUInt32LE(20) & 1)) seen.add(pending.readUInt32LE(12));
            times.first ??= performance.now() - began;
            pending = pending.subarray(32 + pending.readUInt32LE(4));
          }
          if (seen.size < count) return;
          call.destroy();
          resolve({ ...times, whole: performance.now() - began });
        };
        const call = http.get(`${server.url}/v1/jobs/${job.id}/tiles?after=0`, (r) => r.on('data', read));
        call.on('error', (error) => seen.size < count && reject(error));
      }),
  );
}

/** Width, height and samples of a pixel: as the page asks first, and when the camera rests. */
const previewSizes = [
  [96, 54, 2],
  [384, 216, 64],
];

async function previews(browser, server) {
  for (const [load, busy] of [['an idle server', false], ['a server that renders something else', true]]) {
    console.log(`a camera that moves, ${load}: until its first picture is whole`);
    const other = busy
      ? await json(server, '/v1/jobs', { scene: 'interior', stop: { samples_per_pixel: 65536 } })
      : null;
    for (const scene of ['cornell-box', 'interior']) {
      for (const [width, height, samples] of previewSizes) {
        const times = [];
        for (let i = 0; i < (short ? 5 : 40); ++i) {
          const angle = 0.1 * i;
          const request = {
            scene,
            class: 'preview',
            preview_key: 'bench',
            camera: { position: [3 * Math.sin(angle), 1, 3 * Math.cos(angle)], target: [0, 1, 0] },
            film: { width, height, layers: [] },
            stop: { samples_per_pixel: samples },
          };
          const tiles = Math.ceil(width / 32) * Math.ceil(height / 32);
          times.push(await previewOverHttp(server, request, tiles));
        }
        row(`HTTP, ${scene}, ${width} x ${height}, first tile`, spread(times.map((t) => t.first)));
        row(`HTTP, ${scene}, ${width} x ${height}, whole`, spread(times.map((t) => t.whole)));
      }
      await previewsInPage(browser, server, scene);
    }
    if (other) await fetch(`${server.url}/v1/jobs/${other.id}/cancel`, { method: 'POST' });
  }
}

/** Moves the camera in steps apart from each other, then in one go. */
async function previewsInPage(browser, server, scene) {
  for (const [name, device] of devices.slice(0, 2)) {
    const page = await openPage(browser, server, device, `#/compose/${scene}`, (p) =>
      p.addInitScript(noteFeeds),
    );
    await until('a preview', () => pictureNow(page));
    const cells = await page.$eval(
      'canvas.viewfinder',
      (c) => Math.ceil(c.width / 16) * Math.ceil(c.height / 16),
    );
    const box = await page.locator('.stage').boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(x, y);
    await page.mouse.down();
    const steps = [];
    for (let i = 1; i <= (short ? 5 : 30); ++i) {
      await sleep(700); // the fine picture still converges: what a hand does
      await page.evaluate(() => globalThis.notes.splice(0));
      await page.mouse.move(x + 30 * (i % 2 ? 1 : -1) + i, y);
      const notes = await until('an answer', async () => {
        const all = await page.evaluate(() => globalThis.notes);
        return picturesOf(all, cells).length ? all : null;
      });
      steps.push(picturesOf(notes, cells)[0]);
    }
    row(`${name}, ${scene}, a step`, spread(steps.map((p) => p.ms)));
    await page.evaluate(() => globalThis.notes.splice(0));
    const began = performance.now();
    for (let i = 0; performance.now() - began < (short ? 1000 : 4000); ++i) {
      await page.mouse.move(x + 150 * Math.sin(i / 20), y + 20 * Math.cos(i / 20));
      await sleep(16);
    }
    const seconds = (performance.now() - began) / 1000;
    const notes = await page.evaluate(() => globalThis.notes);
    const pictures = picturesOf(notes, cells);
    const rate = (count) => `${(count / seconds).toFixed(1)}/s`;
    const moves = notes.filter(([kind]) => kind === 'move').length;
    const widths = sorted(pictures.map((p) => p.width));
    row(
      `${name}, ${scene}, a drag`,
      `${spread(pictures.map((p) => p.ms))}; moves ${rate(moves)}, pictures ${rate(pictures.length)}, ` +
        `${widths[0]} to ${widths.at(-1)} pixels wide`,
    );
    await page.mouse.up();
    await page.context().close();
  }
}

/**
 * Whole first pictures of a camera: milliseconds from the newest move before the request until all
 * `cells` of the canvas, squares of 16 pixels, have been drawn again.
 */
function picturesOf(notes, cells) {
  const out = [];
  let moved = null;
  let asked = null;
  let coming = null;
  let drawn = 0;
  for (const [kind, time, width] of notes) {
    if (kind === 'move') moved = time;
    // The refined image of the same camera does not count as a new one.
    if (kind === 'post' && moved !== null && moved !== asked?.moved) asked = { moved, width };
    if (kind === 'whole') {
      coming = asked;
      drawn = 0;
    }
    if (kind !== 'draw' || !coming) continue;
    drawn += 1;
    if (drawn < cells) continue;
    out.push({ ms: time - coming.moved, width: coming.width });
    coming = null;
  }
  return out;
}

const browser = await launch();
const server = new Server();
await server.start();
try {
  console.log(`Chromium ${browser.version()}`);
  await weight(browser, server);
  await firstPaint(browser, server);
  const even = new Server({ drawn: 100 });
  await even.start();
  try {
    await tasksWhileTilesArrive(browser, even, '100 a second');
  } finally {
    await even.stop();
  }
  await tasksWhileTilesArrive(browser, server, 'as the renderer makes them');
  await tasksOfViews(browser, server);
  await previews(browser, server);
} finally {
  await browser.close();
  await server.stop();
}
