// Renders a file to an image: node node.mjs MODEL.glb IMAGE.png
import { readFile, writeFile } from 'node:fs/promises';
import { Client } from 'tessera-render';

const { TESSERA_SERVER = 'http://127.0.0.1:8080', TESSERA_KEY: key } = process.env;
const [model, file] = process.argv.slice(2);

const client = new Client(TESSERA_SERVER, { key });
const { bytes, job } = await client.render(await readFile(model), {
  size: [320, 180],
  error: 0.1,
  query: { exposure: 'auto' },
});
await writeFile(file, bytes);
console.log(`The average pixel is ${(100 * job.error.relative).toFixed(1)}% off.`);
