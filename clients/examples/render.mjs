// An image in 30 lines of JavaScript, without packages: node render.mjs [SCENE] [FILE.png]
import { writeFile } from 'node:fs/promises';

const server = process.env.TESSERA_SERVER ?? 'http://127.0.0.1:8080';
const key = process.env.TESSERA_KEY;
const headers = key ? { Authorization: `Bearer ${key}` } : {};
const [scene = 'cornell-box', file = 'image.png'] = process.argv.slice(2);

async function call(path, body) {
  const sent = body && { method: 'POST', body: JSON.stringify(body) };
  const type = { 'Content-Type': 'application/json' };
  const answer = await fetch(server + path, { headers: { ...headers, ...type }, ...sent });
  if (!answer.ok) throw new Error(`${path}: ${await answer.text()}`);
  return answer;
}

const request = { scene, film: { width: 160, height: 90 }, stop: { relative_error: 0.15 } };
const job = await (await call('/v1/jobs', request)).json();
let text = '';
const events = (await call(job.links.events)).body.pipeThrough(new TextDecoderStream());
for await (const piece of events) {
  const messages = (text + piece).split('\n\n');
  text = messages.pop();
  for (const message of messages) {
    const [, type] = /^event: (progress|end)$/m.exec(message) ?? [];
    const [, data] = /^data: (.*)$/m.exec(message) ?? [];
    if (type) console.log(`${type}: relative error ${JSON.parse(data).error.relative}`);
  }
}
await writeFile(file, Buffer.from(await (await call(`${job.links.image}.png`)).arrayBuffer()));
