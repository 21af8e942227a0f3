/** POST /render of a Next.js app: the model of a form's field `scene`, as an image. */
import { Client, RequestError } from 'tessera-render';

const { TESSERA_SERVER = 'http://127.0.0.1:8080', TESSERA_KEY: key } = process.env;
const client = new Client(TESSERA_SERVER, { key });

export async function POST(request: Request): Promise<Response> {
  const scene = (await request.formData()).get('scene');
  if (!(scene instanceof Blob)) return new Response('A file "scene" is needed.', { status: 422 });
  try {
    const { bytes, type, job } = await client.render(scene, {
      size: [160, 90],
      error: 0.2,
      signal: request.signal,
    });
    const headers = { 'content-type': type, 'x-error': String(job.error.relative) };
    return new Response(bytes as BodyInit, { headers });
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    return Response.json(error.problem, { status: error.status });
  }
}
