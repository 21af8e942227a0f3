// The mock server's response to GET /v1/server.

export const scenes = [
  { name: 'still-life', summary: 'Tea for two by a window.' },
  { name: 'cornell-box', summary: 'The measured box: two blocks, one lamp, four walls.' },
  { name: 'furnace', summary: 'Every surface must come out exactly as bright as the sky.' },
  { name: 'veach-mis', summary: 'Four plates from mirror-like to dull under lamps of all sizes.' },
  { name: 'many-lights', summary: 'A thousand small lamps.' },
  { name: 'glass', summary: 'A glass ball and the caustic beneath it.' },
  { name: 'interior', summary: 'A room lit through one small opening.' },
  { name: 'keyhole', summary: 'A dark room beside a bright one.' },
  { name: 'caustic-pool', summary: 'Caustics under waves.' },
];
export const info = {
  version: '1.0.0-mock',
  build: { id: 'mock', commit: '0000000', compiler: 'node', isa: 'avx2', embree: '4.3.3' },
  limits: {
    samples_per_pixel: 65536,
    width: 16384,
    height: 16384,
    pixels: 67108864,
    asset_bytes: 1073741824,
  },
  integrators: [
    {
      type: 'path',
      bias: 'none',
      summary: 'Path tracing with next-event estimation.',
      accepts: ['estimator', 'light_sampler', 'adaptive'],
    },
    {
      type: 'ao',
      bias: 'biased',
      summary: 'Ambient occlusion; ignores materials and lights.',
      accepts: [],
    },
  ],
  samplers: [
    {
      type: 'sobol',
      bias: 'none',
      summary: 'Owen-scrambled Sobol points: the lowest error for most pictures.',
    },
    { type: 'independent', bias: 'none', summary: 'Plain random numbers, as the textbook has it.' },
  ],
  light_samplers: [
    { type: 'tree', bias: 'none', summary: 'Light tree: near and bright lamps first.' },
    { type: 'uniform', bias: 'none', summary: 'Every lamp equally often.' },
  ],
  adaptive: [
    { type: 'pilot', bias: 'none', summary: 'More samples where a pilot stream found noise.' },
    { type: 'none', bias: 'none', summary: 'The same number everywhere.' },
  ],
  options: [],
  layers: ['beauty', 'albedo', 'normal', 'depth', 'alpha', 'samples', 'variance', 'error'],
  image_formats: ['png', 'jpg', 'webp', 'exr', 'hdr', 'tif'],
  tone_maps: ['srgb', 'linear', 'aces', 'agx', 'khronos-neutral'],
  filters: ['blackman-harris', 'box', 'tent', 'gaussian', 'mitchell'],
  scenes,
  experiments: [],
  extensions: [],
};
