/** Shapes of the HTTP contract. Members that a server may leave out are optional. */

export type JobState =
  'queued' | 'loading' | 'rendering' | 'paused' | 'finished' | 'failed' | 'cancelled';

export interface ProblemItem {
  pointer: string;
  detail: string;
}

export interface Problem {
  type?: string;
  title: string;
  status: number;
  detail?: string;
  errors?: ProblemItem[];
}

export interface Choice {
  type: string;
  bias?: string;
  summary?: string;
  accepts?: string[];
}

export interface NamedScene {
  name: string;
  summary?: string;
}

export interface ServerInfo {
  version: string;
  build?: { id?: string; commit?: string; compiler?: string; isa?: string; embree?: string };
  limits?: Record<string, number>;
  integrators?: Choice[];
  samplers?: Choice[];
  light_samplers?: Choice[];
  adaptive?: Choice[];
  options?: { name: string; bias?: string; summary?: string; patch: unknown }[];
  layers?: (string | { name: string })[];
  image_formats?: (string | { name: string })[];
  tone_maps?: (string | { name: string })[];
  filters?: (string | { name: string; type?: string })[];
  scenes?: NamedScene[];
  experiments?: Experiment[];
}

export interface Experiment {
  name: string;
  title: string;
  summary: string;
  estimates: string;
  formula: string;
  look_for: string;
  estimators: { name: string; bias: string; summary: string }[];
  estimator: string;
  samplers: string[];
  sampler: string;
  n: number[];
  unit: string;
  replicates: number;
  params: {
    name: string;
    min: number;
    max: number;
    default: number;
    integer: boolean;
    summary: string;
  }[];
  expected: number;
  pattern_dimensions: number;
}

export interface LabPoint {
  n: number;
  n_asked: number;
  mean: number;
  rmse: number;
  standard_error: number;
  cost: number;
  seconds: number;
}

export interface LabOutcome {
  expected: number;
  slope: number | null;
  slope_interval: [number, number] | null;
  expected_slope: number | null;
  intercept: number | null;
  efficiency: number | null;
  efficiency_by_cost: number | null;
  verdict: 'agrees' | 'differs' | 'biased' | 'undecided';
  explanation: string;
  pattern: number[][];
}

export interface LabRequest {
  experiment: string;
  estimator: string;
  sampler: string;
  n: number[];
  replicates: number;
  seed: number;
  params: Record<string, number>;
}

export interface SceneCamera {
  index?: number;
  name?: string | null;
  type?: string;
  vertical_fov_degrees?: number | null;
  position?: [number, number, number];
  /** Where it looks, unit vector. */
  direction?: [number, number, number];
  /** Unit vector, upright to the direction. */
  up?: [number, number, number];
}

export interface SceneInfo {
  id: string;
  name?: string;
  bytes?: number;
  bounds?: { min: number[]; max: number[] };
  triangles?: number;
  instances?: number;
  cameras?: SceneCamera[];
  lights?: unknown[] | number;
  materials?: unknown[] | number;
  variants?: (string | { name: string })[];
  animations?: unknown[] | number;
  warnings?: Warning[];
}

export type Warning =
  string | { code?: string; detail?: string; message?: string; pointer?: string };

export interface ErrorEstimate {
  relative_rmse: number | null;
  low: number | null;
  high: number | null;
  confidence?: number;
  bias?: string;
  valid?: boolean;
  unreliable?: boolean;
}

export interface Progress {
  fraction: number;
  samples_per_pixel?: { min: number; mean: number; max: number };
  elapsed_seconds?: number;
  cpu_seconds?: number;
  eta_seconds?: number | null;
  eta_interval_seconds?: [number, number] | null;
}

export interface StopRule {
  samples_per_pixel?: number;
  relative_error?: number;
  confidence?: number;
  seconds?: number;
  deadline?: string;
}

export interface JobSpec {
  scene: string;
  name?: string;
  seed?: number;
  film: { width: number; height: number; crop?: unknown; layers?: string[] };
  camera?: { name?: string | null };
  integrator?: { type: string; max_depth?: number };
  sampler?: { type: string };
  adaptive?: { type: string };
  stop?: StopRule;
  class?: string;
  priority?: number;
  labels?: Record<string, string>;
}

export interface JobPage {
  jobs: Job[];
  next: string | null;
}

export interface Job {
  id: string;
  state: JobState;
  stop_reason?: string | null;
  created_at?: string;
  started_at?: string | null;
  finished_at?: string | null;
  spec: JobSpec;
  progress?: Progress;
  error?: ErrorEstimate | null;
  failure?: Problem | null;
  queue_position?: number | null;
  statistics?: {
    rays?: number;
    rays_per_second?: number;
    efficiency?: number | null;
    rejected_samples?: number;
    peak_bytes?: number;
  };
  revision?: number;
  film_digest?: string | null;
  warnings?: Warning[];
}

export interface ConvergencePoint {
  samples_per_pixel: number;
  elapsed_seconds: number;
  cpu_seconds?: number;
  rays?: number;
  relative_rmse: number | null;
  low: number | null;
  high: number | null;
}

export interface Convergence {
  points: ConvergencePoint[];
  slope?: { value: number | null; low: number | null; high: number | null } | null;
}

export interface PixelLayer {
  mean: number[] | number;
  standard_error?: number[] | number | null;
  low?: number[] | number | null;
  high?: number[] | number | null;
  halves?: number[][] | number[] | null;
}

export interface PixelReport {
  x: number;
  y: number;
  samples: number;
  layers: Record<string, PixelLayer>;
}

export interface Comparison {
  id: string;
  mse: number;
  relmse: number;
  flip: number;
  /** Null: a side does not know its error. */
  bias: { value: number; low: number | null; high: number | null };
  z: { mean: number | null; variance: number | null; share_above_3: number | null };
  links: { self: string; difference: string; z: string; flip: string; a: string; b: string };
}

export const isFinal = (state: JobState): boolean =>
  state === 'finished' || state === 'failed' || state === 'cancelled';

/** Entries of the server's lists are strings or objects with a name; both read the same here. */
export const nameOf = (entry: string | { name?: string | null; type?: string }): string =>
  typeof entry === 'string' ? entry : (entry.name ?? entry.type ?? '');

export const warningText = (w: Warning): string =>
  typeof w === 'string' ? w : (w.detail ?? w.message ?? w.code ?? '');
