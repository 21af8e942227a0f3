// A server and a browser for the page's tests.
//
// TESSERA_URL      a running server, and TESSERA_KEY its access key if it requires one; else
// TESSERA_BINARY   the program: started on a free port with a separate data folder; else
// TESSERA_PAGE     a built page, shown by the mock server of clients/web/dev.
// CHROMIUM         the browser; /usr/bin/chromium by default.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import { createRequire } from 'node:module';
import os from 'node:os';
import path from 'node:path';
import { after, before } from 'node:test';
import { fileURLToPath } from 'node:url';
import { inspect, isDeepStrictEqual } from 'node:util';
import { chromium } from 'playwright-core';

const here = path.dirname(fileURLToPath(import.meta.url));
const mock = path.join(here, '../../clients/web/dev/mock_server.mjs');
const axeSource = fs.readFileSync(
  createRequire(import.meta.url).resolve('axe-core/axe.min.js'),
  'utf8',
);

/** The access key of a server elsewhere; empty: it requires none. */
export const accessKey = (process.env.TESSERA_URL && process.env.TESSERA_KEY) || '';
const bearer = accessKey ? { authorization: `Bearer ${accessKey}` } : {};

/** fetch() with the access key. */
export const ask = (url, init = {}) =>
  fetch(url, { ...init, headers: { ...init.headers, ...bearer } });

/** Folder of the page's files: from the environment, or that of the build. */
function builtPage() {
  const { TESSERA_PAGE, TESSERA_BINARY } = process.env;
  return TESSERA_PAGE ?? path.join(path.dirname(path.resolve(TESSERA_BINARY ?? '')), 'clients/web/dist');
}

export class Server {
  #process = null;
  #data = null;
  #drawn = 0;
  #key = '';
  url = null;
  /** From the start of the program until it responds. */
  startMs = 0;

  /**
   * drawn: tiles per second of the mock server, which is then used regardless of the variables; 0:
   * the variables decide.
   * key: access key for the started program, regardless of a server elsewhere.
   */
  constructor({ drawn = 0, key = '' } = {}) {
    this.#drawn = drawn;
    this.#key = key;
    if (!drawn && !key) this.url = process.env.TESSERA_URL ?? null;
  }

  /** True if the server can be killed and started again with its jobs. */
  get canRestart() {
    return !process.env.TESSERA_URL && !!process.env.TESSERA_BINARY;
  }

  async start(port = 0) {
    if (!this.#drawn && !this.#key && process.env.TESSERA_URL) return;
    const binary = this.#drawn ? null : process.env.TESSERA_BINARY;
    this.#data ??= fs.mkdtempSync(path.join(os.tmpdir(), 'tessera-e2e-'));
    const [command, args] = binary
      ? [binary, ['serve', '--port', String(port), '--data', this.#data]]
      : [
          process.execPath,
          [mock, '--port', String(port), '--dist', builtPage(), '--speed', String(this.#drawn || 900)],
        ];
    const env = { TESSERA_LOG_LEVEL: 'warning', ...process.env, TESSERA_KEY: this.#key };
    if (!this.#key) delete env.TESSERA_KEY;
    const begin = Date.now();
    this.#process = spawn(command, args, { stdio: ['ignore', 'pipe', 'inherit'], env });
    this.url = await new Promise((resolve, reject) => {
      let text = '';
      this.#process.stdout.on('data', (chunk) => {
        text += chunk;
        const found = /listening on (http:\/\/\S+)/.exec(text);
        if (found) resolve(found[1]);
      });
      this.#process.on('exit', (code) =>
        reject(new Error(`the server ended with ${code} before it listened`)),
      );
      this.#process.on('error', reject);
    });
    this.startMs = Date.now() - begin;
  }

  async kill(signal = 'SIGKILL') {
    if (!this.#process) return;
    const gone = new Promise((resolve) => this.#process.once('exit', resolve));
    this.#process.kill(signal);
    await gone;
    this.#process = null;
  }

  async stop() {
    await this.kill('SIGTERM');
    if (this.#data) fs.rmSync(this.#data, { recursive: true, force: true });
  }
}

export function launch() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
    args: ['--no-sandbox', '--disable-dev-shm-usage'],
  });
}

// Animations take a quarter of the browser's CPU time; `moving` is for tests that show them.
export const moving = { viewport: { width: 1400, height: 900 }, colorScheme: 'dark' };
export const desktop = { ...moving, reducedMotion: 'reduce' };
export const phone = {
  viewport: { width: 390, height: 844 },
  isMobile: true,
  hasTouch: true,
  deviceScaleFactor: 1,
  colorScheme: 'light',
  reducedMotion: 'reduce',
};

/**
 * A page that records faults: script errors, requests to other hosts, and violations of the
 * server's policy. prepare: called before it opens its address.
 */
export async function openPage(browser, server, device, hash = '', prepare = async () => {}) {
  const context = await browser.newContext({ ...device, acceptDownloads: true });
  if (accessKey) await context.request.post(`${server.url}/v1/session`, { headers: bearer });
  const page = await context.newPage();
  page.setDefaultTimeout(120_000);
  page.faults = [];
  page.on('pageerror', (error) => page.faults.push(String(error)));
  page.on('console', (message) => {
    if (/Content Security Policy/.test(message.text())) page.faults.push(message.text());
  });
  page.on('request', (request) => {
    const url = request.url();
    if (!url.startsWith(server.url) && !/^(blob|data):/.test(url))
      page.faults.push(`asked another host: ${url}`);
  });
  await prepare(page);
  await page.goto(`${server.url}/${hash}`);
  return page;
}

/** Opens a page for `use` and closes it; it must have recorded no faults. */
async function withPageOf(browser, server, device, hash, use) {
  const page = await openPage(browser, server, device, hash);
  try {
    await use(page);
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
  }
}

const nothing = async () => {};

/**
 * Starts a server and a browser before the tests of a file, unless they are skipped, and stops both
 * afterwards. beforeStart, afterStart: further preparations, since hooks of a file do not wait for
 * each other; options: of the server. Returns the server and the functions that open pages of it.
 */
export function serverAndBrowser({
  skip = false,
  beforeStart = nothing,
  afterStart = nothing,
  ...options
} = {}) {
  const server = new Server(options);
  let browser;
  before(async () => {
    if (skip) return;
    await beforeStart();
    await server.start();
    browser = await launch();
    await afterStart();
  });
  after(async () => {
    await browser?.close();
    await server.stop();
  });
  return {
    server,
    newContext: (device) => browser.newContext(device),
    openPage: (device, hash, prepare) => openPage(browser, server, device, hash, prepare),
    withPage: (device, hash, use) => withPageOf(browser, server, device, hash, use),
  };
}

/** Bytes of a response as transferred. */
export const weigh = (url) =>
  new Promise((resolve, reject) => {
    http
      .get(url, { headers: { 'accept-encoding': 'gzip' } }, (response) => {
        let bytes = 0;
        response.on('data', (chunk) => (bytes += chunk.length));
        response.on('end', () => resolve(bytes));
      })
      .on('error', reject);
  });

/** Violations of WCAG 2.2 AA in the page, one line each. */
export async function accessibilityFaults(page) {
  // Through the debugger, because the page's own policy forbids foreign scripts.
  await page.evaluate(axeSource);
  return page.evaluate(async () => {
    const report = await globalThis.axe.run(document, {
      runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'],
    });
    return report.violations.map(
      (v) => `${v.id}: ${v.nodes.map((n) => `${n.target} ${n.any[0]?.message ?? ''}`).join(' | ')}`,
    );
  });
}

/**
 * The content of the displayed image, as comparable text; null before there is one.
 */
export const pictureNow = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector('[data-testid=picture]');
    if (!canvas || !canvas.width) return null;
    const copy = document.createElement('canvas');
    copy.width = canvas.width;
    copy.height = canvas.height;
    const context = copy.getContext('2d');
    context.drawImage(canvas, 0, 0);
    const bytes = context.getImageData(0, 0, copy.width, copy.height).data;
    let shown = 0,
      hash = 0;
    for (let i = 0; i < bytes.length; i += 4) {
      if (bytes[i + 3]) shown += 1;
      hash = (hash * 31 + bytes[i] * 65536 + bytes[i + 1] * 256 + bytes[i + 2]) | 0;
    }
    return shown ? { hash, share: shown / (copy.width * copy.height) } : null;
  });

/**
 * Waits until check() deeply equals the expected value: the page may be about to change.
 */
export async function settles(what, check, expected) {
  let last;
  const agrees = async () => isDeepStrictEqual((last = await check()), expected);
  await until(() => `${what}: ${inspect(expected)}, not ${inspect(last)}`, agrees, 30_000);
}

/** what: a text, or a function that returns it when the wait fails. */
export async function until(what, check, timeoutMs = 120_000) {
  const end = Date.now() + timeoutMs;
  for (;;) {
    const value = await check();
    if (value) return value;
    if (Date.now() > end) {
      const text = typeof what === 'function' ? what() : what;
      throw new Error(`not within ${timeoutMs / 1000} s: ${text}`);
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

/** Waits for an image that differs from the previous one. */
export async function isOther(page, before) {
  const now = await pictureNow(page);
  return now !== null && now.hash !== before.hash;
}

/** The scene selected in the form, once there is one. */
export const sceneOf = (page) => page.inputValue('[data-testid=scene]');

/** Fills in the form and presses Render. size: an entry of the list; by default a small image. */
export async function submit(page, { scene, size = 'custom', samples = 64 } = {}) {
  if (scene) await page.selectOption('[data-testid=scene]', scene);
  else await until('scenes in the list', () => sceneOf(page));
  await page.selectOption('[data-testid=size]', size);
  if (size === 'custom') {
    await page.fill('[data-testid=width]', '160');
    await page.fill('[data-testid=height]', '90');
  }
  await page.fill('[data-testid=stop-samples]', String(samples));
  const before = page.url();
  await page.click('[data-testid=submit]');
  await page.waitForURL((url) => url.href !== before && /#\/jobs\//.test(url.href));
}

/** The smallest model that can be rendered, one lit triangle: its document and its buffer. */
function triangle(uri) {
  const bin = Buffer.from(new Float32Array([-1, 0, 0, 1, 0, 0, 0, 1.6, 0]).buffer);
  const pbrMetallicRoughness = { baseColorFactor: [0.9, 0.5, 0.2, 1], metallicFactor: 0 };
  const document = {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0 }] }],
    materials: [{ doubleSided: true, pbrMetallicRoughness }],
    buffers: [{ byteLength: bin.length, ...(uri && { uri }) }],
    bufferViews: [{ buffer: 0, byteLength: bin.length }],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count: 3,
        type: 'VEC3',
        min: [-1, 0, 0],
        max: [1, 1.6, 0],
      },
    ],
  };
  return { json: JSON.stringify(document), bin };
}

/** A document and its buffer in one file. */
export function glbOf(text, bin) {
  const json = text + ' '.repeat((4 - (text.length % 4)) % 4);
  const head = Buffer.alloc(20);
  head.write('glTF', 0, 'latin1');
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(28 + json.length + bin.length, 8);
  head.writeUInt32LE(json.length, 12);
  head.write('JSON', 16, 'latin1');
  const middle = Buffer.alloc(8);
  middle.writeUInt32LE(bin.length, 0);
  middle.write('BIN\0', 4, 'latin1');
  return Buffer.concat([head, Buffer.from(json), middle, bin]);
}

export function triangleGlb() {
  const { json, bin } = triangle(null);
  return glbOf(json, bin);
}

/** A triangle that emits light; a strength above 1 makes it a lamp. */
export function glowingGlb(strength) {
  const { json, bin } = triangle(null);
  const document = JSON.parse(json);
  document.materials = [{ emissiveFactor: [1, 1, 1], doubleSided: true }];
  document.meshes[0].primitives[0].material = 0;
  if (strength > 1) {
    document.extensionsUsed = ['KHR_materials_emissive_strength'];
    document.materials[0].extensions = {
      KHR_materials_emissive_strength: { emissiveStrength: strength },
    };
  }
  return glbOf(JSON.stringify(document), bin);
}

/** The same as two files; the buffer's name must be escaped in the document. */
export function triangleFiles() {
  const { json, bin } = triangle('the%20buffer.bin');
  return [
    { name: 'triangle.gltf', bytes: Buffer.from(json) },
    { name: 'the buffer.bin', bytes: bin },
  ];
}

/** A triangle that moves by (1, 0, 0) in a second, with the variant "plain". */
export function movingGlb() {
  const bin = Buffer.from(
    new Float32Array([-1, 0, 0, 1, 0, 0, 0, 1.6, 0, 0, 1, 0, 0, 0, 1, 0, 0]).buffer,
  );
  const at = [0, 36, 44, 68];
  const document = {
    asset: { version: '2.0' },
    extensionsUsed: ['KHR_materials_variants'],
    extensions: { KHR_materials_variants: { variants: [{ name: 'plain' }] } },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0 }] }],
    materials: [{ doubleSided: true }],
    animations: [
      {
        samplers: [{ input: 1, output: 2 }],
        channels: [{ sampler: 0, target: { node: 0, path: 'translation' } }],
      },
    ],
    buffers: [{ byteLength: bin.length }],
    bufferViews: [0, 1, 2].map((i) => ({
      buffer: 0,
      byteOffset: at[i],
      byteLength: at[i + 1] - at[i],
    })),
    accessors: [
      { type: 'VEC3', count: 3, min: [-1, 0, 0], max: [1, 1.6, 0] },
      { type: 'SCALAR', count: 2, min: [0], max: [1] },
      { type: 'VEC3', count: 2 },
    ].map((accessor, i) => ({ bufferView: i, componentType: 5126, ...accessor })),
  };
  return glbOf(JSON.stringify(document), bin);
}

/** An environment map of one grey pixel, in Radiance format. */
export const panorama = () =>
  Buffer.concat([
    Buffer.from('#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n'),
    Buffer.from([128, 128, 128, 129]),
  ]);

/** Drops files on the page like a user. files: [{name, bytes}]. */
export async function drop(page, files) {
  const transfer = await page.evaluateHandle(
    (list) => {
      const data = new DataTransfer();
      for (const { name, base64 } of list) {
        data.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
      }
      return data;
    },
    files.map(({ name, bytes }) => ({ name, base64: bytes.toString('base64') })),
  );
  for (const type of ['dragenter', 'dragover', 'drop'])
    await page.dispatchEvent('body', type, { dataTransfer: transfer });
}
