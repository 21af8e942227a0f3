/** Submit, wait, image, upload by types of openapi-typescript. Run by contract.test.mjs. */
import createClient from 'openapi-fetch';
import type { components, paths } from './schema.js';

// Defaults make no member required: the scene is enough.
const least: components['schemas']['JobRequest'] = { scene: 'cornell-box' };

export async function tour(baseUrl: string, fetch: (request: Request) => Promise<Response>) {
  const client = createClient<paths>({ baseUrl, fetch });
  const submitted = await client.POST('/v1/jobs', {
    body: { ...least, film: { width: 48, height: 32 }, stop: { samples_per_pixel: 4 } },
  });
  if (!submitted.data || !('state' in submitted.data)) throw new Error('not submitted');
  let job: components['schemas']['Job'] = submitted.data;
  while (job.state !== 'finished' && job.state !== 'failed') {
    const { data, error } = await client.GET('/v1/jobs/{id}', {
      params: { path: { id: job.id }, query: { wait: 20 } },
    });
    if (!data) throw new Error(error.detail);
    job = data;
  }
  const image = await client.GET('/v1/jobs/{id}/image.{format}', {
    params: { path: { id: job.id, format: 'png' }, query: { exposure: 1 } },
    parseAs: 'arrayBuffer',
  });
  if (!image.data) throw new Error('no picture');
  const glb = await client.GET('/v1/scenes/{id}/gltf', {
    params: { path: { id: 'cornell-box' } },
    parseAs: 'blob',
  });
  if (!glb.data) throw new Error('no scene');
  const content = glb.data;
  const uploaded = await client.POST('/v1/scenes', {
    params: { query: { name: 'box.glb' } },
    body: '',
    bodySerializer: () => content,
    headers: { 'content-type': 'model/gltf-binary' },
  });
  const refused = await client.POST('/v1/jobs', { body: { scene: 'nowhere' } });
  return {
    state: job.state,
    image: [...new Uint8Array(image.data).subarray(0, 8)]
      .map((byte) => byte.toString(16).padStart(2, '0'))
      .join(''),
    scene: uploaded.data?.name,
    refused: refused.error?.status,
  };
}
