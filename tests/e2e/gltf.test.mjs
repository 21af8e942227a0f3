// The Khronos validator as an oracle: files that the server writes are valid; of a file changed in
// many ways, every version that the validator accepts loads as a scene.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import validator from 'gltf-validator';
import { ask, Server } from './harness.mjs';

// The mock server reads no glTF.
const skip = process.env.TESSERA_URL || process.env.TESSERA_BINARY ? false : 'needs the server';
const names = [
  'cornell-box',
  'furnace',
  'veach-mis',
  'many-lights',
  'glass',
  'interior',
  'keyhole',
  'caustic-pool',
  'still-life',
];
const server = new Server();
before(() => skip || server.start());
after(() => server.stop());

const glbOf = async (name) =>
  Buffer.from(await (await ask(`${server.url}/v1/scenes/${name}/gltf`)).arrayBuffer());

/** Codes and locations of the errors in a GLB. */
async function faults(glb) {
  const report = await validator.validateBytes(new Uint8Array(glb), { maxIssues: 0 });
  return report.issues.messages
    .filter((message) => message.severity === 0)
    .map((message) => `${message.code} ${message.pointer}`);
}

for (const name of names) {
  test(`${name} is valid`, { skip }, async () => {
    assert.deepEqual(await faults(await glbOf(name)), []);
  });
}

/** The same GLB with other JSON. */
function withJson(glb, document) {
  const binary = glb.subarray(20 + glb.readUInt32LE(12));
  let text = Buffer.from(JSON.stringify(document));
  text = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, ' ')]);
  const head = Buffer.from(glb.subarray(0, 20));
  head.writeUInt32LE(20 + text.length + binary.length, 8);
  head.writeUInt32LE(text.length, 12);
  return Buffer.concat([head, text, binary]);
}

/** Every place in a document: an object or array, and a key of it. */
function placesOf(value, found = []) {
  for (const key of Object.keys(value)) {
    found.push([value, key]);
    if (value[key] && typeof value[key] === 'object') placesOf(value[key], found);
  }
  return found;
}

test('every file that the validator accepts is a scene', { skip }, async () => {
  const glb = await glbOf('cornell-box');
  const document = JSON.parse(glb.subarray(20, 20 + glb.readUInt32LE(12)).toString());
  const count = placesOf(document).length;
  const values = [0, -1, 1, 0.5, '', [], {}, null, true, undefined];
  let valid = 0;
  for (let place = 0; place < count; place += 3) {
    const changed = structuredClone(document);
    const [object, key] = placesOf(changed)[place];
    const value = values[(place / 3) % values.length];
    if (value !== undefined) object[key] = value;
    else if (Array.isArray(object)) object.splice(Number(key), 1);
    else delete object[key];
    const file = withJson(glb, changed);
    // It stops at some values that it does not check, without reporting them.
    const found = await faults(file).catch((stopped) => [String(stopped)]);
    if (found.length > 0) continue;
    valid += 1;
    const answer = await ask(`${server.url}/v1/scenes`, {
      method: 'POST',
      headers: { 'Content-Type': 'model/gltf-binary' },
      body: file,
    });
    const text = await answer.text();
    const what = `${JSON.stringify(value)} for ${key}: ${text}`;
    assert.ok(answer.status === 200 || answer.status === 201, what);
  }
  assert.ok(valid > 10, `${valid} valid files`);
});
