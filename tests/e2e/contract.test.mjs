// A client whose types openapi-typescript makes from /openapi.json compiles in strict mode, and
// renders an image.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { ask, Server } from './harness.mjs';

const here = path.dirname(fileURLToPath(import.meta.url));
const modules = path.join(here, 'node_modules');
// Below node_modules, so that its packages are found.
const home = path.join(modules, '.contract');

// The mock server has no OpenAPI description.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const server = new Server();
before(async () => {
  if (skip) return;
  await server.start();
  fs.rmSync(home, { recursive: true, force: true });
  fs.mkdirSync(home, { recursive: true });
});
after(() => server.stop());

const run = (program, ...flags) =>
  execFileSync(process.execPath, [path.join(modules, program), ...flags], {
    cwd: home,
    encoding: 'utf8',
  });

test('a client with generated types renders an image and uploads a scene', { skip }, async () => {
  const document = await (await ask(`${server.url}/openapi.json`)).text();
  fs.writeFileSync(path.join(home, 'openapi.json'), document);
  fs.copyFileSync(path.join(here, 'contract_tour.ts'), path.join(home, 'tour.ts'));
  fs.writeFileSync(path.join(home, 'package.json'), '{"type": "module"}');
  run('openapi-typescript/bin/cli.js', 'openapi.json', '-o', 'schema.d.ts');
  const flags = '--strict --target ES2022 --lib ES2022,DOM --module NodeNext --skipLibCheck';
  run('typescript/bin/tsc', 'tour.ts', ...flags.split(' '));
  const { tour } = await import(pathToFileURL(path.join(home, 'tour.js')));
  const send = (request) => ask(request, { headers: Object.fromEntries(request.headers) });
  assert.deepEqual(await tour(server.url, send), {
    state: 'finished',
    image: '89504e470d0a1a0a',
    scene: 'box.glb',
    refused: 404,
  });
});
