// Views of a scene for a shop: GET /views/30.png. Run with: node express.mjs [PORT]
import express from 'express';
import { Client, RequestError } from 'tessera-render';

const { TESSERA_SERVER = 'http://127.0.0.1:8080', TESSERA_KEY: key } = process.env;
const client = new Client(TESSERA_SERVER, { key });
const app = express();

app.get('/views/:theta.png', async (request, response) => {
  // Who leaves the page no longer waits for its images.
  const left = new AbortController();
  response.on('close', () => left.abort());
  const { bytes, type } = await client.render('glass', {
    camera: { orbit: { theta_degrees: Number(request.params.theta) } },
    size: [160, 90],
    error: 0.2,
    signal: left.signal,
  });
  response.type(type).set('cache-control', 'public, max-age=86400').send(Buffer.from(bytes));
});

app.use((error, request, response, next) => {
  if (response.headersSent || response.destroyed) return;
  if (!(error instanceof RequestError)) return next(error);
  response.status(error.status).json(error.problem);
});

const listener = app.listen(Number(process.argv[2] ?? 3000), '127.0.0.1', () =>
  console.log(`http://127.0.0.1:${listener.address().port}/views/30.png`),
);
