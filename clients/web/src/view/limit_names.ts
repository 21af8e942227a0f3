import { exact } from '../ui/format';

/** Names of limits whose identifier is unclear; the others use the words of their identifier. */
const plain: Record<string, string> = {
  body_bytes: 'JSON of a request',
  json_depth: 'Levels of nested JSON',
  json_key_bytes: 'Name of a JSON member',
  seed: 'Largest seed',
  priority: 'Largest priority',
  name_characters: 'Name of a render',
  labels: 'Labels of a render',
  label_key_characters: 'Name of a label',
  label_value_characters: 'Text of a label',
  film_side: 'Width or height of an image',
  film_pixels: 'Whole image',
  film_bytes: 'Film that is sent or merged',
  merge_films: 'Films of one merge',
  filter_radius: 'Radius of the pixel filter',
  light_shares: 'Shares of the light that a render keeps',
  mix_weight: 'Weight of a share in a mix',
  max_depth: 'Scattering events on a path',
  split_count: 'Continuations of a split path',
  light_block: 'Side of squares that share light samples',
  dilation: 'Radius of neighbours in adaptive sampling',
  first_replicate: 'Largest first replicate',
  stop_seconds: 'Maximum render time',
  wait_seconds: 'Time that a request may wait',
  page_size: 'Entries of one page of a list',
  scene_files: 'Files of a model',
  comparisons: 'Comparisons that are kept',
  comparison_pixels: 'Images that are compared',
  comparison_bytes: 'Maps of comparisons that are kept',
  retention_seconds: 'Time that a render may ask to be kept',
  webhook_url_characters: 'Address of a webhook',
  watched_jobs: 'Renders watched by one request',
  lab_evaluations: 'Random vectors of a run in the laboratory',
  lab_replicates: 'Replicates of a run in the laboratory',
  lab_runs: 'Runs in the laboratory at a time',
  errors_shown: 'Errors listed per response',
  queue_jobs: 'Renders that wait',
  running_jobs: 'Renders at a time',
  streams: 'Open streams',
  samples_per_job: 'Samples per pixel of a render',
  upload_bytes: 'File that is sent',
  memory_bytes_of_jobs: 'Memory of all renders',
  scene_cache_bytes: 'Models kept in memory',
  film_cache_bytes: 'Films kept in memory',
  stored_bytes: 'Files of the server',
  unfinished_jobs_of_a_key: 'Unfinished renders of a key',
  url_jobs_of_a_key: 'Unfinished renders that URLs of a key started',
  url_jobs_of_a_preset: 'Unfinished renders that URLs of a preset started',
  stored_bytes_of_a_key: 'Files of a key',
};

const unitOf = (name: string): string =>
  /(?:^|_)(bytes|seconds|characters|pixels|stops)(?:_|$)/.exec(name)?.[1] ?? '';

export function limitName(name: string): string {
  const words = plain[name] ?? name.replace(/_/g, ' ');
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** All digits, because exact values matter at a limit. */
export function limitText(name: string, value: unknown): string {
  if (typeof value !== 'number') return JSON.stringify(value);
  if (value === 0 && name.endsWith('_of_a_key')) return 'no limit';
  return `${exact(value)} ${unitOf(name)}`.trim();
}
