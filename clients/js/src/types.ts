/**
 * The bodies of the HTTP interface, as they are in JSON.
 * Made by clients/generate.py from /openapi.json; not edited by hand.
 */

/** Position on a sphere around the target, instead of position and target. */
export interface JobRequestCameraOrbit {
  /**
   * Angle of the camera about +y, counter-clockwise seen from above; 0 is in front (+z). Default:
   * 0.
   */
  theta_degrees?: number;
  /** Angle from +y: 0 looks down from above, 90 is level. Default: 75. */
  phi_degrees?: number;
  /** Distance from the target, metres; 'auto': the whole scene is in view. Default: "auto". */
  radius?: string | number;
  /**
   * Point that the camera looks at, metres; 'auto': the centre of the scene's box. Default: "auto".
   */
  target?: string | [number, number, number];
}

/** Position and rotation as a matrix, instead of position, target and up. */
export interface JobRequestCameraPose {
  /** Axes of the camera. The world's are always those of the scene, y up. Default: "opencv". */
  convention?: string;
  /**
   * 4x4, row by row, from the camera's axes to the world, metres (the inverse of OpenCV's
   * extrinsics): a rotation and the camera's position.
   */
  matrix: number[];
}

/** Lens distortion of a pinhole camera. */
export interface JobRequestCameraDistortion {
  /** Formula. Default: "none". */
  model?: string;
  /** Coefficients in OpenCV's order: 4, 5, 8 or 12 for opencv, 4 for fisheye. Default: []. */
  k?: number[];
}

/**
 * Null members keep the value of the file's camera, selected by name or index, otherwise the first.
 */
export interface JobRequestCamera {
  /** Name of the file's camera. */
  name?: string | null;
  /** Index of the file's camera; excludes name. */
  index?: number | null;
  /**
   * Camera position in world space, metres. Requires target; together they replace the file's pose.
   */
  position?: [number, number, number] | null;
  /** Point that the camera looks at, in world space, metres. */
  target?: [number, number, number] | null;
  /** Up direction; [0, 1, 0] if position and target are given without it. */
  up?: [number, number, number] | null;
  /** Position on a sphere around the target, instead of position and target. */
  orbit?: JobRequestCameraOrbit | null;
  /** Position and rotation as a matrix, instead of position, target and up. */
  pose?: JobRequestCameraPose | null;
  /** Projection; by default the file camera's, and perspective where the pose is given. */
  type?: string;
  /**
   * Height of an orthographic view, metres; null: the file camera's, or what a perspective camera
   * sees at the target's distance.
   */
  orthographic_height?: number | null;
  /** Vertical field of view, degrees; perspective cameras only. */
  vertical_fov_degrees?: number | null;
  /**
   * Lens shift of a perspective camera: how far the view moves to the right and up, in widths and
   * heights of the film. Verticals stay vertical.
   */
  shift?: [number, number] | null;
  /** Focal length of a pinhole camera, in pixels of the full film. */
  fx?: number | null;
  /** The same along y; null: fx. */
  fy?: number | null;
  /**
   * Principal point of a pinhole camera, in pixels; null: the film's centre. Pixel 0 goes from 0 to
   * 1, as in COLMAP and nerfstudio: add 0.5 to OpenCV's cx and cy, which count from the centre of
   * pixel 0.
   */
  cx?: number | null;
  /** The same along y, downwards. */
  cy?: number | null;
  /** Lens distortion of a pinhole camera. */
  distortion?: JobRequestCameraDistortion | null;
  /** Radius of the lens, metres; 0 is a pinhole. */
  aperture_radius?: number | null;
  /** Distance of the plane in focus, metres. */
  focus_distance?: number | null;
}

/**
 * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
 * null: none.
 */
export interface JobRequestMedium {
  /** Kind of medium. Default: "homogeneous". */
  type?: string;
  /** Coefficient in 1/m, linear RGB. Default: [0,0,0]. */
  scattering?: [number, number, number];
  /** Coefficient in 1/m, linear RGB. Default: [0,0,0]. */
  absorption?: [number, number, number];
  /**
   * Mean cosine of the scattering angle (Henyey and Greenstein): 0 is isotropic, above 0 forward.
   * Default: 0.
   */
  g?: number;
  /**
   * Density is proportional to exp(-height_falloff y); the coefficients are those at y = 0.
   * Default: 0.
   */
  height_falloff?: number;
}

/**
 * Sun and clear sky for a location and time, in cd/m2 (683 lm/W): at noon they light level ground
 * with about 100,000 lux, so show images with exposure auto. Sky: Preetham, Shirley and Smits 1999,
 * turbidity 3. Position: NOAA. The sun is sampled as a disc. North is -z, east is +x.
 */
export interface JobRequestEnvironmentSun {
  /** Degrees; north is positive. */
  latitude: number;
  /** Degrees; east is positive. */
  longitude: number;
  /** RFC 3339 time during the day. */
  time: string;
}

/**
 * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's own,
 * if it has one; otherwise white, unless the scene has a punctual light or an emissive strength
 * above 1.
 */
export interface JobRequestEnvironment {
  /** Asset with an equirectangular image (.hdr, .exr) in cd/m2; null: one colour. */
  asset?: string | null;
  /** Procedural studio light, as strong as a white environment of 1 cd/m2; instead of an asset. */
  preset?: string;
  /**
   * Sun and clear sky for a location and time, in cd/m2 (683 lm/W): at noon they light level ground
   * with about 100,000 lux, so show images with exposure auto. Sky: Preetham, Shirley and Smits
   * 1999, turbidity 3. Position: NOAA. The sun is sampled as a disc. North is -z, east is +x.
   */
  sun?: JobRequestEnvironmentSun | null;
  /** Linear Rec.709; multiplies the image. Default: [1,1,1]. */
  color?: [number, number, number];
  /** Multiplies colour and image. Default: 1. */
  intensity?: number;
  /** Positive angles rotate it counter-clockwise seen from above. Default: 0. */
  rotation_degrees?: number;
  /**
   * If false, the environment lights the scene but the background is transparent: short form of
   * background type 'transparent'. Default: true.
   */
  visible?: boolean;
}

/**
 * What the camera sees behind the scene; mirrors, and glass unless through_glass is true, show the
 * environment.
 */
export interface JobRequestBackground {
  /**
   * Kind of background. Default: 'transparent' with ground 'catcher', otherwise 'environment'.
   * Default: "environment".
   */
  type?: string;
  /** Linear Rec.709. Default: [1,1,1]. */
  color?: [number, number, number];
  /**
   * Glass, water and other clear surfaces show the background, not the environment: surfaces that
   * camera paths cross, bent or not, with a roughness of at most 0.1. With type 'transparent' their
   * alpha is 1 less the luminance of the light that they let through. Default: true for
   * 'transparent' with integrators that support it, otherwise false.
   */
  through_glass?: boolean;
}

/** The shadow on a catcher. */
export interface JobRequestGroundShadow {
  /** Colour of the shadow. Default: "neutral". */
  color?: string;
  /** Factor of the blocked light: 0 is no shadow. Default: 1. */
  strength?: number;
  /**
   * Sine of the angle by which every light is widened for the shadow: 0 is the shadow that the
   * lights cast. Default: 0.
   */
  softness?: number;
}

/** Horizontal ground added to the scene. */
export interface JobRequestGround {
  /** Kind of ground. Default: "none". */
  type?: string;
  /** Height (y), metres; null: the model's lowest point. */
  height?: number | null;
  /**
   * Albedo of its surface, linear Rec.709; also of a catcher, which lights the model from below.
   * Default: [0.8,0.8,0.8].
   */
  color?: [number, number, number];
  /**
   * Weight of a smooth clear coat that reflects the model: 0 is diffuse, 1 is a lacquered surface,
   * which reflects 4% at normal incidence and more at grazing angles. Default: 0.
   */
  reflection?: number;
  /** The shadow on a catcher. */
  shadow?: JobRequestGroundShadow;
}

/** Part of the film to render; null: all of it. */
export interface JobRequestFilmCrop {
  /** Left column, in pixels of the full film. */
  x: number;
  /** Top row, in pixels of the full film. */
  y: number;
  /** Pixels. */
  width: number;
  /** Pixels. */
  height: number;
}

/** Reconstruction filter. */
export interface JobRequestFilmFilter {
  /** Kind of filter. Default: "blackman-harris". */
  type?: string;
  /** Radius in pixels. Default: 1.5. */
  radius?: number;
}

/** Size, filter and recorded layers; null: no image, only a meter. */
export interface JobRequestFilm {
  /** Pixels. Width times height is limited to 64 megapixels (413). Default: 960. */
  width?: number;
  /** Pixels. Default: 540. */
  height?: number;
  /** Part of the film to render; null: all of it. */
  crop?: JobRequestFilmCrop | null;
  /** Reconstruction filter. */
  filter?: JobRequestFilmFilter;
  /**
   * Layers to record: albedo, normal, depth, object, instance, material, primitive, position, uv,
   * motion, z_depth, cryptomatte:object, cryptomatte:material, light shares (bounce:N and
   * light:NAME for path and bdpt, st:S,T for bdpt), and irradiance. All other layers are always
   * recorded. Default: ["albedo","normal","depth"].
   */
  layers?: string[];
}

/** How light paths are traced. */
export interface JobRequestIntegrator {
  /** Algorithm. Default: "path". */
  type?: string;
  /** Scattering events on a path; 0 shows emitters only, 1 adds direct light. Default: 16. */
  max_depth?: number;
  /**
   * Whether photons bring what lamps and sun send through glass and water or off mirrors. The job
   * then has the options, and the type, of path-caustics. Default: "off".
   */
  caustics?: string;
  /**
   * Particles emitted from the lights for each sample of the pixels; 0: one per pixel of the full
   * film (path-caustics: one per two pixels), at least 4096 and at most 262144. Default: 0.
   */
  photons?: number;
  /**
   * Radius within which photons are gathered, in metres; sppm and vcm: initial radius. 0: three
   * pixels at the distance of the visible surfaces. Default: 0.
   */
  radius_m?: number;
  /**
   * After N samples of each replicate, the area in which photons are gathered, and the bias, are
   * about N^(alpha - 1) of the initial ones; the variance falls as N^-alpha. With 2/3 the squared
   * bias and the variance fall at the same rate. Default: 0.6666667.
   */
  alpha?: number;
  /**
   * Directions in which each path continues to look up the photon map at the next surface; 0: shows
   * the map itself, including direct light. Default: 1.
   */
  final_gather?: number;
  /**
   * Relative interpolation error up to which an irradiance record is used; half of it needs about
   * four times as many records. Default: 0.25.
   */
  tolerance?: number;
  /** Paths over the hemisphere of each record. Default: 256. */
  rays?: number;
  /**
   * Maximum number of records of each replicate. Where there are none, indirect light is path
   * traced. Default: 32768.
   */
  records?: number;
}

/** Weights of multiple importance sampling. */
export interface JobRequestEstimatorMis {
  /** Heuristic. Default: "power". */
  type?: string;
  /** Exponent of the power heuristic. Default: 2. */
  exponent?: number;
}

/** Russian roulette. */
export interface JobRequestEstimatorRoulette {
  /** Rule for the survival probability. Default: "throughput". */
  type?: string;
  /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. Default: 0.02. */
  delta?: number;
}

/** Splitting of a path into several at its first surface. */
export interface JobRequestEstimatorSplitting {
  /** How their number is chosen. Default: "measured". */
  type?: string;
  /** Number of continuations. Default: 2. */
  count?: number;
}

/** Quantity that is subtracted from samples and added in closed form. */
export interface JobRequestEstimatorControlVariate {
  /** Kind of control variate. Default: "none". */
  type?: string;
}

/** How paths are sampled and combined. */
export interface JobRequestEstimator {
  /** How directions are sampled. Default: "mis". */
  strategy?: string;
  /** Weights of multiple importance sampling. */
  mis?: JobRequestEstimatorMis;
  /** Russian roulette. */
  roulette?: JobRequestEstimatorRoulette;
  /** Splitting of a path into several at its first surface. */
  splitting?: JobRequestEstimatorSplitting;
  /** Quantity that is subtracted from samples and added in closed form. */
  control_variate?: JobRequestEstimatorControlVariate;
  /**
   * True: absorption and transparency weight paths; false: they terminate paths at random. Default:
   * true.
   */
  expected_values?: boolean;
}

/** Sequence of sample points. */
export interface JobRequestSampler {
  /** Type of point set. Each has a rule for sample counts; see /v1/server. Default: "sobol". */
  type?: string;
  /** Number of independent randomisations per pixel; even. Default: 2. */
  replicates?: number;
  /**
   * Number of the seed's first replicate; even. Jobs with different replicates can be merged into
   * the film of a single job. Default: 0.
   */
  first_replicate?: number;
}

/** How a light is selected. */
export interface JobRequestLightSampler {
  /** Method of selection. Default: "measured". */
  type?: string;
  /** Candidate light samples, of which one is selected. Default: 2. */
  candidates?: number;
  /** Side, in pixels, of the squares whose pixels share light samples. Default: 3. */
  block?: number;
  /**
   * Passes that also share light samples: successive samples of a replicate. At most 64 paths share
   * samples: block x block x history. Default: 1.
   */
  history?: number;
  /** Candidate light samples of each path, of which one is shared. Default: 1. */
  candidates_per_pixel?: number;
}

/** Adaptive sampling. */
export interface JobRequestAdaptive {
  /**
   * Rule that assigns samples. Default: 'pilot' for jobs with stop.relative_error, otherwise
   * 'none'. Default: "none".
   */
  type?: string;
  /**
   * Samples of every pixel before the first decision, all replicates together; rounded up to a
   * count at which decisions are made: 20, or 1, 1.25, 1.5 and 1.75 times 2^k of each replicate.
   * Default: 32.
   */
  min_samples?: number;
  /** Unit that gets the same number of samples. Default: "pixel". */
  granularity?: string;
  /**
   * Radius in pixels, in tiles for granularity 'tile': each takes the largest need of its
   * neighbours. Default: 1.
   */
  dilation?: number;
}

/** A point with its normal. */
export interface JobRequestMeterPoints {
  /** World space, metres. */
  position: [number, number, number];
  /** Normal; any length except 0. */
  normal: [number, number, number];
}

/** Points at the centres of the cells of a rectangle, row by row; they follow the single points. */
export interface JobRequestMeterPlane {
  /** Corner of the rectangle, world space, metres. */
  origin: [number, number, number];
  /** Vector from origin to the next corner; the plane faces along edge_u x edge_v. */
  edge_u: [number, number, number];
  /** Vector from origin to the other adjacent corner. */
  edge_v: [number, number, number];
  /** Cells along edge_u. */
  columns: number;
  /** Cells along edge_v. */
  rows: number;
}

/**
 * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
 * for each sample of a pixel; see GET /v1/jobs/{id}/meter.
 */
export interface JobRequestMeter {
  /** Points at which irradiance is measured. Default: []. */
  points?: JobRequestMeterPoints[];
  /**
   * Points at the centres of the cells of a rectangle, row by row; they follow the single points.
   */
  plane?: JobRequestMeterPlane | null;
}

/**
 * When to stop: the first rule met ends the job. If given, only the rules in it apply. Default:
 * {"samples_per_pixel":256}.
 */
export interface JobRequestStop {
  /**
   * Stop at this mean number of samples per pixel of the crop, all replicates together. Rounded up
   * to a count that the sampler supports. Default: 256.
   */
  samples_per_pixel?: number | null;
  /** Stop when the relative error is at most this, with `confidence`. */
  relative_error?: number | null;
  /**
   * Stop when the relative error of the denoised image (`mixed`) is at most this, with
   * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to check.
   */
  denoised_error?: number | null;
  /**
   * Confidence of relative_error, denoised_error, light_not_found and of the interval in `error`.
   * Default: 0.95.
   */
  confidence?: number;
  /** Region whose error must reach the target. Default: "image". */
  scope?: string;
  /** Stop after this many seconds of rendering, without pauses and downtime. */
  seconds?: number | null;
  /** Stop after this many CPU seconds of rendering, summed over all threads. */
  cpu_seconds?: number | null;
  /** Stop when (high - low) / illuminance_lux of every point of the meter is at most this. */
  meter_error?: number | null;
  /**
   * Stop when `light_not_found.at_most` is at most this, with `confidence`. Beside relative_error,
   * denoised_error or meter_error: these end the job only then.
   */
  light_not_found?: number | null;
  /** Stop at this time (RFC 3339). */
  deadline?: string | null;
}

/** Denoised images, which are made on demand and are not part of the film. */
export interface JobRequestDenoise {
  /** Denoiser. Default: "auto". */
  type?: string;
  /** If false, there are none until the job has ended. Default: true. */
  preview?: boolean;
}

/** Webhook to notify. */
export interface JobRequestWebhook {
  /** http or https; receives a signed POST (Standard Webhooks) for each event. */
  url: string;
  /** Events to send. Default: ["end"]. */
  events?: string[];
}

/** A job: what to render, how, and when to stop. */
export interface JobRequest {
  /** Id from POST /v1/scenes, or the name of a built-in scene. */
  scene: string;
  /** Display name. Default: "". */
  name?: string;
  /** Key-value pairs for finding jobs. Default: {}. */
  labels?: Record<string, string>;
  /** Higher values are served first. Default: 0. */
  priority?: number;
  /** Seed for all random numbers in the job. Default: 0. */
  seed?: number;
  /**
   * Null members keep the value of the file's camera, selected by name or index, otherwise the
   * first.
   */
  camera?: JobRequestCamera;
  /** Material variant of the file by name (KHR_materials_variants). */
  variant?: string | null;
  /** Animation time, seconds; null: the rest pose given by the file's transforms. Default: 0. */
  time_seconds?: number | null;
  /**
   * Time that the shutter is open, in seconds, starting at time_seconds: animated objects and the
   * file's camera are blurred. 0: no motion blur. Default: 0.
   */
  shutter_seconds?: number;
  /**
   * Time from time_seconds to the second moment of the layer motion, which includes the motion of
   * the file's camera; negative: an earlier moment. In the rest pose nothing moves. Default:
   * 0.041666666666666664.
   */
  motion_seconds?: number;
  /**
   * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
   * null: none.
   */
  medium?: JobRequestMedium | null;
  /** Scheduling class. Default: "normal". */
  class?: string;
  /** A later preview with the same key supersedes this one; class preview only. */
  preview_key?: string | null;
  /**
   * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's
   * own, if it has one; otherwise white, unless the scene has a punctual light or an emissive
   * strength above 1.
   */
  environment?: JobRequestEnvironment | null;
  /**
   * What the camera sees behind the scene; mirrors, and glass unless through_glass is true, show
   * the environment.
   */
  background?: JobRequestBackground;
  /** Horizontal ground added to the scene. */
  ground?: JobRequestGround;
  /** Size, filter and recorded layers; null: no image, only a meter. */
  film?: JobRequestFilm | null;
  /** How light paths are traced. */
  integrator?: JobRequestIntegrator;
  /** How paths are sampled and combined. */
  estimator?: JobRequestEstimator;
  /** Sequence of sample points. */
  sampler?: JobRequestSampler;
  /** How a light is selected. */
  light_sampler?: JobRequestLightSampler;
  /** Adaptive sampling. */
  adaptive?: JobRequestAdaptive;
  /**
   * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
   * for each sample of a pixel; see GET /v1/jobs/{id}/meter.
   */
  meter?: JobRequestMeter | null;
  /** Unit of radiance, irradiance and intensity. Default: "photometric". */
  units?: string;
  /** True: paths carry three wavelengths instead of three colours. Default: false. */
  spectral?: boolean;
  /**
   * When to stop: the first rule met ends the job. If given, only the rules in it apply. Default:
   * {"samples_per_pixel":256}.
   */
  stop?: JobRequestStop;
  /** Denoised images, which are made on demand and are not part of the film. */
  denoise?: JobRequestDenoise;
  /** Webhook to notify. */
  webhook?: JobRequestWebhook | null;
  /** Time after its end at which the job and its files are deleted; null: kept. */
  retention_seconds?: number | null;
}

/** Rules to change; null removes one, others are kept. */
export interface JobPatchStop extends JobRequestStop {}

/** A merge patch (RFC 7396) of the changeable members. */
export interface JobPatch extends Pick<JobRequest, 'priority' | 'name'> {
  /** Labels to set; null removes one, others are kept. */
  labels?: Record<string, string | null>;
  /** Rules to change; null removes one, others are kept. */
  stop?: JobPatchStop;
  /** True pauses, false resumes. */
  paused?: boolean;
}

/** A scene from uploaded assets. */
export interface SceneFromAssets {
  /** Asset with the glTF or GLB file. */
  gltf: string;
  /** Asset id of each uri in the glTF. Default: {}. */
  files?: Record<string, string>;
}

/** The new rules; they replace the old ones. */
export interface ExtendRequestStop extends JobRequestStop {}

/** New stop rules for a finished job. */
export interface ExtendRequest {
  /** The new rules; they replace the old ones. */
  stop: ExtendRequestStop;
}

/** Films to merge. */
export interface MergeRequest {
  /** Compatible films that share no samples. */
  films: string[];
}

/** A job template for many images. */
export interface PresetRequest {
  /** A JobRequest without `scene`; class normal. */
  job: Record<string, unknown>;
  /**
   * Images need no signature, in the film's size and in those of `sizes`. The name must be free
   * among the public presets of all tenants. Default: false.
   */
  public?: boolean;
  /** Sizes [width, height] of public images in pixels, `dpr` included. Default: []. */
  sizes?: [number, number][];
  /**
   * The first request of an image waits at most this long (and at most --max-wait); then it gets
   * the image as it is, if every pixel has a sample, or 503. Default: 2.
   */
  deadline_seconds?: number;
  /**
   * The model has the same size at every theta, for images that turn it: the least distance at
   * which 8% of each side are free from all around. Otherwise each angle has its own. Default:
   * false.
   */
  turntable?: boolean;
}

/** A preset. */
export interface Preset {
  /** A JobRequest without `scene`; class normal. */
  job: Record<string, unknown>;
  /**
   * Images need no signature, in the film's size and in those of `sizes`. The name must be free
   * among the public presets of all tenants.
   */
  public: boolean;
  /** Sizes [width, height] of public images in pixels, `dpr` included. */
  sizes: [number, number][];
  /**
   * The first request of an image waits at most this long (and at most --max-wait); then it gets
   * the image as it is, if every pixel has a sample, or 503.
   */
  deadline_seconds: number;
  /**
   * The model has the same size at every theta, for images that turn it: the least distance at
   * which 8% of each side are free from all around. Otherwise each angle has its own.
   */
  turntable: boolean;
  name: string;
}

/** All presets. */
export interface PresetList {
  /** Sorted by name. */
  presets: Preset[];
}

/** A new signing key. */
export interface SigningKey {
  id: string;
  /** Unpadded base64url of 32 random bytes, which is returned only once. */
  key: string;
}

/** A signing key, without its text. */
export interface SigningKeyRow {
  id: string;
  tenant: string;
  created_at: string;
}

/** All signing keys. */
export interface SigningKeyList {
  /** Oldest first. */
  keys: SigningKeyRow[];
}

/** Jobs for which to create a ticket. */
export interface TicketRequest {
  /** Jobs that the ticket's bearer may watch. */
  jobs: string[];
}

/** An experiment to run; whole runs are limited to `lab_evaluations`. */
export interface LabRequest {
  /** Experiment to run; see `experiments` of GET /v1/server. */
  experiment: string;
  /** One of the experiment's estimators; its default if absent. */
  estimator?: string;
  /** Sampler to use, if the experiment supports it; its default if absent. */
  sampler?: string;
  /**
   * Numbers of evaluations per replicate, each of which gives one line of the response; rounded as
   * required by estimator and sampler.
   */
  n?: number[];
  /** Independent repetitions, from which the errors are measured. Default: 64. */
  replicates?: number;
  /** Random seed; the same seed gives identical results, except for timings. Default: 0. */
  seed?: number;
  /** Parameters of the experiment, by name. */
  params?: Record<string, number>;
}

/** One error of the input. */
export interface FieldError {
  /** JSON pointer into the body; /name for the query parameter `name`. */
  pointer: string;
  /** What was found and what is allowed. */
  detail: string;
}

/** RFC 9457. */
export interface Problem {
  /** Type of problem, a URI reference. */
  type: string;
  /** Same for every problem of the type. */
  title: string;
  /** HTTP status. */
  status: number;
  /** About this problem. */
  detail: string;
  /** URL path of the request. */
  instance?: string;
  /** Errors of the input. */
  errors?: FieldError[];
}

/** The state of a job. */
export type JobState =
  | 'queued'
  | 'loading'
  | 'rendering'
  | 'paused'
  | 'finished'
  | 'failed'
  | 'cancelled';

/** Position on a sphere around the target, instead of position and target. */
export interface JobSpecCameraOrbit extends Required<JobRequestCameraOrbit> {}

/** Position and rotation as a matrix, instead of position, target and up. */
export interface JobSpecCameraPose extends Required<JobRequestCameraPose> {}

/** Lens distortion of a pinhole camera. */
export interface JobSpecCameraDistortion extends Required<JobRequestCameraDistortion> {}

/**
 * Null members keep the value of the file's camera, selected by name or index, otherwise the first.
 */
export interface JobSpecCamera extends
    Required<Pick<
      JobRequestCamera,
      | 'name'
      | 'index'
      | 'position'
      | 'target'
      | 'up'
      | 'vertical_fov_degrees'
      | 'aperture_radius'
      | 'focus_distance'
    >>,
    Pick<
      JobRequestCamera,
      | 'type'
      | 'orthographic_height'
      | 'shift'
      | 'fx'
      | 'fy'
      | 'cx'
      | 'cy'
    > {
  /** Position on a sphere around the target, instead of position and target. */
  orbit?: JobSpecCameraOrbit | null;
  /** Position and rotation as a matrix, instead of position, target and up. */
  pose?: JobSpecCameraPose | null;
  /** Lens distortion of a pinhole camera. */
  distortion?: JobSpecCameraDistortion | null;
}

/**
 * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
 * null: none.
 */
export interface JobSpecMedium extends Required<JobRequestMedium> {}

/**
 * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's own,
 * if it has one; otherwise white, unless the scene has a punctual light or an emissive strength
 * above 1.
 */
export interface JobSpecEnvironment extends
    Required<Omit<JobRequestEnvironment, 'preset' | 'sun'>>,
    Pick<JobRequestEnvironment, 'preset' | 'sun'> {}

/**
 * What the camera sees behind the scene; mirrors, and glass unless through_glass is true, show the
 * environment.
 */
export interface JobSpecBackground extends
    Required<Pick<JobRequestBackground, 'type'>>,
    Omit<JobRequestBackground, 'type'> {}

/** The shadow on a catcher. */
export interface JobSpecGroundShadow extends Required<JobRequestGroundShadow> {}

/** Horizontal ground added to the scene. */
export interface JobSpecGround extends
    Required<Pick<JobRequestGround, 'type'>>,
    Omit<JobRequestGround, 'type' | 'shadow'> {
  /** The shadow on a catcher. */
  shadow?: JobSpecGroundShadow;
}

/** Reconstruction filter. */
export interface JobSpecFilmFilter extends Required<JobRequestFilmFilter> {}

/** Size, filter and recorded layers; null: no image, only a meter. */
export interface JobSpecFilm extends Required<Omit<JobRequestFilm, 'filter'>> {
  /** Reconstruction filter. */
  filter: JobSpecFilmFilter;
}

/** How light paths are traced. */
export interface JobSpecIntegrator extends
    Required<Pick<JobRequestIntegrator, 'type' | 'max_depth'>>,
    Omit<JobRequestIntegrator, 'type' | 'max_depth'> {}

/** Weights of multiple importance sampling. */
export interface JobSpecEstimatorMis extends
    Required<Pick<JobRequestEstimatorMis, 'type'>>,
    Pick<JobRequestEstimatorMis, 'exponent'> {}

/** Russian roulette. */
export interface JobSpecEstimatorRoulette extends
    Required<Pick<JobRequestEstimatorRoulette, 'type'>>,
    Pick<JobRequestEstimatorRoulette, 'delta'> {}

/** Splitting of a path into several at its first surface. */
export interface JobSpecEstimatorSplitting extends
    Required<Pick<JobRequestEstimatorSplitting, 'type'>>,
    Pick<JobRequestEstimatorSplitting, 'count'> {}

/** Quantity that is subtracted from samples and added in closed form. */
export interface JobSpecEstimatorControlVariate extends
    Required<JobRequestEstimatorControlVariate> {}

/** How paths are sampled and combined. */
export interface JobSpecEstimator extends
    Required<Pick<JobRequestEstimator, 'strategy' | 'expected_values'>> {
  /** Weights of multiple importance sampling. */
  mis: JobSpecEstimatorMis;
  /** Russian roulette. */
  roulette: JobSpecEstimatorRoulette;
  /** Splitting of a path into several at its first surface. */
  splitting: JobSpecEstimatorSplitting;
  /** Quantity that is subtracted from samples and added in closed form. */
  control_variate: JobSpecEstimatorControlVariate;
}

/** Sequence of sample points. */
export interface JobSpecSampler extends
    Required<Omit<JobRequestSampler, 'first_replicate'>>,
    Pick<JobRequestSampler, 'first_replicate'> {}

/** How a light is selected. */
export interface JobSpecLightSampler extends
    Required<Pick<JobRequestLightSampler, 'type'>>,
    Omit<JobRequestLightSampler, 'type'> {}

/** Adaptive sampling. */
export interface JobSpecAdaptive extends
    Required<Pick<JobRequestAdaptive, 'type'>>,
    Omit<JobRequestAdaptive, 'type'> {}

/**
 * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
 * for each sample of a pixel; see GET /v1/jobs/{id}/meter.
 */
export interface JobSpecMeter extends Required<JobRequestMeter> {}

/** When to stop: the first rule met ends the job. If given, only the rules in it apply. */
export interface JobSpecStop extends JobRequestStop {}

/** Denoised images, which are made on demand and are not part of the film. */
export interface JobSpecDenoise extends Required<JobRequestDenoise> {}

/** Webhook to notify. */
export interface JobSpecWebhook extends Required<JobRequestWebhook> {}

/** The job request with all defaults filled in. */
export interface JobSpec extends
    Required<Pick<
      JobRequest,
      | 'scene'
      | 'name'
      | 'labels'
      | 'priority'
      | 'seed'
      | 'variant'
      | 'time_seconds'
      | 'class'
      | 'preview_key'
      | 'units'
      | 'spectral'
    >>,
    Pick<JobRequest, 'shutter_seconds' | 'motion_seconds' | 'retention_seconds'> {
  /**
   * Null members keep the value of the file's camera, selected by name or index, otherwise the
   * first.
   */
  camera: JobSpecCamera;
  /**
   * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
   * null: none.
   */
  medium: JobSpecMedium | null;
  /**
   * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's
   * own, if it has one; otherwise white, unless the scene has a punctual light or an emissive
   * strength above 1.
   */
  environment?: JobSpecEnvironment | null;
  /**
   * What the camera sees behind the scene; mirrors, and glass unless through_glass is true, show
   * the environment.
   */
  background?: JobSpecBackground;
  /** Horizontal ground added to the scene. */
  ground?: JobSpecGround;
  /** Size, filter and recorded layers; null: no image, only a meter. */
  film: JobSpecFilm | null;
  /** How light paths are traced. */
  integrator: JobSpecIntegrator;
  /** How paths are sampled and combined. */
  estimator: JobSpecEstimator;
  /** Sequence of sample points. */
  sampler: JobSpecSampler;
  /** How a light is selected. */
  light_sampler: JobSpecLightSampler;
  /** Adaptive sampling. */
  adaptive: JobSpecAdaptive;
  /**
   * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
   * for each sample of a pixel; see GET /v1/jobs/{id}/meter.
   */
  meter?: JobSpecMeter | null;
  /** When to stop: the first rule met ends the job. If given, only the rules in it apply. */
  stop: JobSpecStop;
  /** Denoised images, which are made on demand and are not part of the film. */
  denoise?: JobSpecDenoise;
  /** Webhook to notify. */
  webhook?: JobSpecWebhook | null;
}

/** Samples per pixel, over the pixels of the crop. */
export interface ProgressSamplesPerPixel {
  min: number;
  mean: number;
  max: number;
}

/** Progress of the job. */
export interface Progress {
  /** From 0 to 1; 1 only at the end. */
  fraction: number;
  /** Samples per pixel, over the pixels of the crop. */
  samples_per_pixel: ProgressSamplesPerPixel;
  /** Rendering time without pauses and downtime. */
  elapsed_seconds: number;
  /** CPU time summed over all threads. */
  cpu_seconds: number;
  /** Time until the end; null: unknown. */
  eta_seconds: number | null;
  /** Lower and upper bound of eta_seconds at the current speed; null: unknown. */
  eta_interval_seconds: [number, number] | null;
}

/**
 * Error estimate of the current image I against the truth mu: the mean over pixels of (sum over
 * channels of |I - mu|) / (sum of max(I, mu) + F), F = 0.05 (mean root of the luminance)^2.
 */
export interface ErrorEstimate {
  /**
   * grain + doubt / 2: the average pixel is off by this share of its brightness, 0 to 1; null:
   * unknown.
   */
  relative: number | null;
  /** Lower end of the interval; null: unknown, or not valid. */
  low: number | null;
  /** Upper end of the interval. */
  high: number | null;
  /**
   * Mean over pixels of r = sum |A - B| / sum (|A| + |B| + 2 F). By comparison: 0.8 times the mean
   * root of (I - U)(I - V), relative, for two unbiased images U and V; `relative` is then the same.
   */
  grain: number | null;
  /**
   * Light that only one half has found: mean over squares of 16 pixels of sum (|A - B| r) / sum
   * (|A| + |B| + 2 F).
   */
  doubt: number | null;
  /** Confidence level of the interval. */
  confidence: number;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  /**
   * False: the error is unknown, since no unbiased integrator can render the image to compare it
   * with.
   */
  valid: boolean;
  /**
   * More light is in doubt than is visible as grain (doubt above grain): rare bright paths are
   * still being found, and the interval may miss.
   */
  unreliable: boolean;
  /** Deprecated: the same as `relative`; removed in version 2. */
  relative_rmse: number | null;
}

/** How much light may be missing from the image, from particles that are counted beside it. */
export interface LightNotFound {
  /**
   * Light that neither the image nor the particles may have found, with the confidence, over the
   * image's mean luminance; 1 for a black image. Above 1 the particles are too few for a view this
   * small: nothing is known.
   */
  at_most: number;
  /**
   * Light that the particles found and the image lacks, over the image's mean luminance; 0: none.
   */
  detected: number;
  /** Confidence level of `at_most`, and of all tiles together. */
  confidence: number;
  /** Number of particles. */
  particles: number;
  /** Number of tiles that lack light. */
  tiles: number;
  /** Those tiles, by number. */
  lacking: number[];
  /**
   * A sentence: whose light is missing, and which integrator finds it; null: no tile lacks light.
   */
  reason: string | null;
  /** The integrators in `reason`; empty: no tile lacks light. */
  integrators: string[];
}

/** Cost of the job. */
export interface Statistics {
  rays: number;
  rays_per_second: number | null;
  /** 1 / (relative error^2 * CPU seconds). */
  efficiency: number | null;
  /** From the interval of `error`. */
  efficiency_low: number | null;
  /** Null also if `error.low` is 0. */
  efficiency_high: number | null;
  /** Samples that were not finite, counted as zero. */
  rejected_samples: number;
  /** Memory; null: unknown. */
  peak_bytes: number | null;
  /**
   * Number of continuations that splitting 'measured' has found; null: not yet known, or another
   * type.
   */
  split_count: number | null;
  /**
   * sppm, vcm: radius of the newest sample's disks relative to the first sample's; null: no sample
   * yet, or another integrator.
   */
  radius_ratio: number | null;
}

/**
 * By how much the error of images of a video changes from one frame to the next, relative to their
 * light, along the motion of the surfaces.
 */
export interface Flicker {
  /** Root of its mean square. */
  relative: number;
  /** Lower end of its 95% interval. */
  low: number;
  high: number;
}

/** The newest denoised image, with the error of `mixed`. */
export interface Denoised {
  /** The denoiser. */
  type: string;
  version: string;
  /** Hash of the file with its weights; null: it has none. */
  sha256: string | null;
  /** null: the denoiser has no quality settings. */
  quality: string | null;
  /** Why `auto` did not choose the better denoiser. */
  note: string | null;
  /** Uses albedo, normal, depth and emission; false: the scene was deleted. */
  features: boolean;
  /** As in `error`, bias included; 0 if it is too small to be measured. */
  relative: number | null;
  /**
   * Lower end of its 95% interval; null: not valid; 0 if an error target ended the job, because
   * only `high` holds then.
   */
  low: number | null;
  high: number | null;
  /** What remains wrong in the average pixel. */
  grain: number | null;
  /** That of the image before denoising. */
  doubt: number | null;
  /** Doubt is above grain. */
  unreliable: boolean;
  /** Error of `full`, the denoiser's own image. */
  full_relative: number | null;
  /** Deprecated: the same as `relative`; removed in version 2. */
  relative_rmse: number | null;
  /** Deprecated: the same as `full_relative`. */
  full_relative_rmse: number | null;
  /**
   * (plain error / this one)^2: factor of samples that the plain image would need for the same
   * error.
   */
  gain: number | null;
  /** Revision of the image that was denoised. */
  revision: number;
  /** Time that denoising took. */
  seconds: number;
  /** Frames beside it in the batch that it was averaged with: of `video`. */
  frames: number;
  flicker: Flicker | null;
}

/** A job. */
export interface Job {
  /** UUID. */
  id: string;
  state: JobState;
  /**
   * Why the job is paused; null: it is not. `storage_full`: it resumes by itself when the disk has
   * space.
   */
  pause_reason: 'requested' | 'storage_full' | null;
  /** Why the job ended; null until it has ended. */
  stop_reason:
    | 'samples_per_pixel'
    | 'relative_error'
    | 'denoised_error'
    | 'seconds'
    | 'cpu_seconds'
    | 'deadline'
    | 'meter_error'
    | 'light_not_found'
    | 'limit'
    | 'cancelled'
    | 'failed'
    | null;
  created_at: string;
  started_at: string | null;
  finished_at: string | null;
  spec: JobSpec;
  progress: Progress;
  error: ErrorEstimate;
  light_not_found: LightNotFound | null;
  failure: Problem | null;
  /** 0: the next job; null: not waiting. */
  queue_position: number | null;
  statistics: Statistics;
  /** Number of changes of the image. */
  revision: number;
  /**
   * Parts that can be requested now: `image`, which includes pixels; `denoised`, the image with
   * ?denoise=mixed or full; `meter`. Requests for others are a 409.
   */
  available: ('image' | 'denoised' | 'meter')[];
  /** SHA-256 of the film's exact content, once finished. */
  film_digest: string | null;
  denoised: Denoised | null;
  /** A denoised image is being made: on request, while it renders or afterwards. */
  denoising: boolean;
  /**
   * A worker that rendered parts of the image unchecked returned wrong results later: the image may
   * be wrong. A warning says what helps.
   */
  doubted: boolean;
  /**
   * The film was merged from samples that no single job renders: the job cannot be extended or
   * retried.
   */
  merged: boolean;
  /** Adjustments made to the request, and other warnings. */
  warnings: string[];
  /** Those of `warnings` that are about the scene's file, for programs. */
  warning_details: Warning[];
  /** URLs of related resources. */
  links: Record<string, string>;
}

/** A page of jobs. */
export interface JobList {
  /** Newest first. */
  jobs: Job[];
  /**
   * Ids of jobs whose stored records are damaged: nothing is known of them, and they can only be
   * deleted.
   */
  damaged: string[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** Estimate from a pilot of at most half a second. */
export interface DryRunEstimate {
  /** Rendering time on an idle server. */
  seconds: number;
  /** Lower end of the interval. */
  seconds_low: number;
  /** Upper end of the interval. */
  seconds_high: number;
  /** Confidence level of the interval. */
  confidence: number;
  cpu_seconds: number;
  /** Estimated samples per pixel required. */
  samples_per_pixel: number;
  /** Film and scene. */
  memory_bytes: number;
  /** Memory of the film. */
  memory_bytes_low: number;
  /** Memory reserved at admission: the larger of loading and rendering. */
  memory_bytes_high: number;
  /** CPU time of the pilot. */
  pilot_cpu_seconds: number;
}

/** A job's effective request and its estimated cost. */
export interface DryRun {
  spec: JobSpec;
  /** Same as the warnings of a job. */
  warnings: string[];
  /** Estimate from a pilot of at most half a second. */
  estimate: DryRunEstimate;
}

/** A stream ticket. */
export interface Ticket {
  /** Value of `?ticket=`. */
  ticket: string;
  expires_at: string;
  /** Ids of the jobs that its bearer may watch. */
  jobs: string[];
}

/** The state has changed. */
export interface StateEvent extends Pick<Job, 'pause_reason' | 'stop_reason' | 'queue_position'> {
  state: JobState;
  /** Number of changes of `spec`. */
  spec_version: number;
}

/** The image has progressed. */
export interface ProgressEvent {
  state: JobState;
  progress: Progress;
  error: ErrorEstimate;
  light_not_found: LightNotFound | null;
  statistics: Statistics;
  /** Number of changes of the image. */
  revision: number;
  /**
   * Parts that can be requested now: `image`, which includes pixels; `denoised`, the image with
   * ?denoise=mixed or full; `meter`. Requests for others are a 409.
   */
  available: ('image' | 'denoised' | 'meter')[];
  denoised: Denoised | null;
}

/** A tile has changed; only the newest event of each tile is kept. */
export interface TileEvent {
  /** Left column, in pixels of the full film. */
  x: number;
  /** Top row. */
  y: number;
  width: number;
  height: number;
  /** Revision of the image. */
  revision: number;
  /** Samples per pixel. */
  samples: number;
  /** Relative error of the tile; null: unknown. */
  error: number | null;
  /** The tile's part of the image. */
  url: string;
}

/** A new entry of the job's `warnings`. */
export interface WarningEvent {
  message: string;
}

/** The job has ended. */
export interface EndEvent extends
    Pick<Job, 'stop_reason' | 'film_digest' | 'revision' | 'available'> {
  state: JobState;
  error: ErrorEstimate;
  light_not_found: LightNotFound | null;
  failure: Problem | null;
}

/** Events were lost; a snapshot follows. */
export interface ResetEvent {
  reason: string;
}

/** The stream is refused: the server's limit of streams is reached. */
export interface OverloadedEvent {
  detail: string;
  retry_after_seconds: number;
}

/** The body of a webhook, signed as defined by Standard Webhooks. */
export interface Webhook {
  /** `job.state`, `job.warning` or `job.end`. */
  type: string;
  timestamp: string;
  data: Job;
}

/** A stored file. */
export interface Asset {
  /** sha256, hex. */
  id: string;
  bytes: number;
}

/**
 * What was read otherwise than the file says, or not at all. Its text in `warnings` is `pointer:
 * detail`.
 */
export interface Warning {
  /**
   * Kind: `clamped`, `normalized`, `missing`, `padding`, `left_out`, `not_drawn`,
   * `animation_ignored`, `extension_ignored`, ... Further kinds may be added.
   */
  code: string;
  /** JSON pointer into the glTF document; empty: none. */
  pointer: string;
  /** What was seen, and what was done. */
  detail: string;
}

/** A camera of the file. */
export interface SceneCamera {
  index: number;
  name: string;
  type: 'perspective' | 'orthographic';
  /** Null: orthographic. */
  vertical_fov_degrees: number | null;
  /** Metres. */
  position: [number, number, number];
  /** Viewing direction, unit vector. */
  direction: [number, number, number];
  /** Unit vector. */
  up: [number, number, number];
}

/** A punctual light of the file. */
export interface SceneLight {
  name: string;
  type: 'directional' | 'point' | 'spot' | 'profile';
  /** W/sr, or W/m2 if directional, or a factor of a light profile; linear RGB. */
  intensity: [number, number, number];
}

/** Axis-aligned box, metres; null: empty. */
export interface SceneBounds {
  min: [number, number, number];
  max: [number, number, number];
}

/** A loaded scene. */
export interface Scene {
  /** Value of `scene` in a job request. */
  id: string;
  name: string;
  /** Memory of geometry, acceleration structure and textures. */
  bytes: number;
  /** Axis-aligned box, metres; null: empty. */
  bounds: SceneBounds | null;
  /** Counted per use: a mesh used twice counts twice. */
  triangles: number;
  instances: number;
  cameras: SceneCamera[];
  /** Punctual lights. */
  lights: SceneLight[];
  /** Names for the layers light:NAME. */
  light_groups: string[];
  /** Names. */
  materials: string[];
  /** Names. */
  variants: string[];
  /** Names. */
  animations: string[];
  /** Extensions that the file uses. */
  extensions: string[];
  warnings: string[];
  /** Those of `warnings` that are about the scene's file, for programs. */
  warning_details: Warning[];
}

/** A page of scenes. */
export interface SceneList {
  /** Newest first. */
  scenes: Scene[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** The state of a job at one error check. */
export interface ConvergencePoint {
  samples_per_pixel: number;
  elapsed_seconds: number;
  cpu_seconds: number;
  rays: number;
  relative: number | null;
  low: number | null;
  high: number | null;
  grain: number | null;
  doubt: number | null;
  /** Deprecated: the same as `relative`. */
  relative_rmse: number | null;
}

/** Slope of log error against log samples, by least squares, with its 95% interval. */
export interface ConvergenceSlope {
  value: number | null;
  low: number | null;
  high: number | null;
}

/** Get the error over samples and time. */
export interface Convergence {
  /** One for each error check. */
  points: ConvergencePoint[];
  /** Slope of log error against log samples, by least squares, with its 95% interval. */
  slope: ConvergenceSlope;
}

/** One layer at one pixel, with one number per channel. */
export interface PixelLayer {
  mean: (number | null)[];
  standard_error: (number | null)[];
  /** Lower bounds of the 95% interval. */
  low: (number | null)[];
  /** Upper bounds of the 95% interval. */
  high: (number | null)[];
  /** Halves A and B; null if the layer has none. */
  halves: ((number | null)[])[] | null;
}

/** One pixel. */
export interface Pixel {
  x: number;
  y: number;
  samples: number;
  /** Layers by name. */
  layers: Record<string, PixelLayer>;
}

/** Light that arrives at one side of a point, in lux for all sources alike. */
export interface MeterReading {
  /** World, metres. */
  position: [number, number, number];
  /** Unit normal. */
  normal: [number, number, number];
  /** Illuminance divided by 683 lm/W, for nominal white. */
  irradiance_w_m2: number;
  /** Luminance (Rec. 709) of irradiance_rgb. */
  illuminance_lux: number;
  /** End of the 95% interval of illuminance_lux. */
  low: number;
  /** End of the 95% interval of illuminance_lux. */
  high: number;
  /**
   * One of the 16 randomisations makes up most of the interval, or no path has found light: the
   * interval is only a guess.
   */
  unreliable: boolean;
  /** Lux per channel, linear. */
  irradiance_rgb: [number, number, number];
  /** Paths, of 16 independent randomisations. */
  samples: number;
}

/** Current readings of a job's meter. */
export interface Meter {
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  /** Confidence level of the intervals. */
  confidence: number;
  /** Mean illuminance of the points. */
  mean_lux: number | null;
  /** Least illuminance divided by the mean (U0 of EN 12464-1). */
  uniformity: number | null;
  /**
   * Illuminance of an upward surface under the open sky of the job's environment, with its sun;
   * null: it has none.
   */
  outdoor_lux: number | null;
  /**
   * mean_lux / outdoor_lux, a share: the CIE's daylight factor if the environment is an overcast
   * sky and the only light.
   */
  daylight_factor: number | null;
  /** The points, followed by the cells of the plane. */
  points: MeterReading[];
}

/** Figures of a job's meter; see Meter. */
export interface MeterFigures {
  /** UUID. */
  job: string;
  mean_lux: number;
  uniformity: number | null;
  daylight_factor: number | null;
}

/** A point of two meters. */
export interface MeterPair {
  /** World, metres. */
  position: [number, number, number];
  a_lux: number;
  b_lux: number;
  /** a - b. */
  difference_lux: number;
  /** End of the 95% interval of the difference. */
  low: number;
  /** End of the 95% interval of the difference. */
  high: number;
}

/** The meters of two jobs compared point by point; b is the reference. */
export interface MeterComparison {
  a: MeterFigures;
  b: MeterFigures;
  /** Mean of a - b. */
  difference_lux: number;
  /** In the order of the meters. */
  points: MeterPair[];
}

/** Statistics of (a-b) / standard error. */
export interface ComparisonZ {
  mean: number | null;
  variance: number | null;
  share_above_3: number | null;
}

/** Paths. */
export interface ComparisonLinks {
  self: string;
  difference: string;
  z: string;
  flip: string;
  a: string;
  b: string;
}

/** Two images compared; b is the reference. */
export interface Comparison {
  id: string;
  mse: number | null;
  /** Mean of (a-b)^2 / (b^2 + 0.01). */
  relmse: number | null;
  /** LDR, 67 pixels per degree. */
  flip: number | null;
  /** Mean of a - b; its interval is null if the error of a side is unknown. */
  bias: ConvergenceSlope;
  /** Statistics of (a-b) / standard error. */
  z: ComparisonZ;
  /** Paths. */
  links: ComparisonLinks;
}

/**
 * Bounding box of the pixels whose centre shows it, on the full film; null: none, or the job did
 * not record ids.
 */
export interface SceneObjectVisible {
  x: number;
  y: number;
  width: number;
  height: number;
  /** Number of pixels that show it. */
  pixels: number;
}

/** Bounding box of its part within the film, hidden or not, in pixels; null: nothing. */
export interface SceneObjectAmodal {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** A node of the file that shows a mesh. */
export interface SceneObject {
  /** Id in the layer object: 1 + the node's index. */
  id: number;
  /** JSON pointer into the glTF document. */
  pointer: string;
  /** Name of the node or its mesh, made unique; used by Cryptomatte. */
  name: string;
  /** Id in the layer instance. */
  first_instance: number;
  /** Number of consecutive ids in the layer instance. */
  instances: number;
  /** Bounding box in world space, metres; null: not in this view. */
  bounds: SceneBounds | null;
  /**
   * Bounding box of the pixels whose centre shows it, on the full film; null: none, or the job did
   * not record ids.
   */
  visible: SceneObjectVisible | null;
  /** Bounding box of its part within the film, hidden or not, in pixels; null: nothing. */
  amodal: SceneObjectAmodal | null;
}

/** An instance of an object that the image shows. */
export interface ObjectInstance extends Pick<SceneObject, 'bounds' | 'visible' | 'amodal'> {
  /** Id in the layer instance. */
  id: number;
  /** Id of its object. */
  object: number;
}

/** Meaning of an id in the layers material and primitive. */
export interface Label {
  id: number;
  /** Null: glTF's default material. */
  pointer: string | null;
  name: string;
}

/** Lens distortion of a pinhole camera. */
export interface SceneObjectsCameraDistortion {
  /** Formula. */
  model?: 'none' | 'opencv' | 'fisheye';
  /** Coefficients in OpenCV's order: 4, 5, 8 or 12 for opencv, 4 for fisheye. */
  k?: number[];
}

/**
 * The camera without its lens. With (x, y, z) = world_to_camera (X, Y, Z, 1) the point is seen at
 * the pixel (cx + fx x / z, cy + fy y / z) of a perspective or pinhole image, where z > 0, after
 * the lens's distortion has moved (x / z, y / z); at (cx + fx x, cy + fy y) of an orthographic one;
 * and at (cx + fx atan2(x, z), cy + fy atan2(y, hypot(x, z))) of a panorama. Pixel i goes from i to
 * i + 1; for tools that count from its centre, subtract 0.5.
 */
export interface SceneObjectsCamera {
  type: 'perspective' | 'orthographic' | 'panorama' | 'pinhole';
  width: number;
  height: number;
  /** Focal length in pixels; orthographic: pixels per metre; panorama: pixels per radian. */
  fx: number;
  fy: number;
  /** Principal point; the centre of pixel 0 is at 0.5. */
  cx: number;
  cy: number;
  /** Lens distortion of a pinhole camera. */
  distortion: SceneObjectsCameraDistortion;
  /** 16 numbers, row by row; x to the right, y down, z forward, as in OpenCV and COCO. */
  world_to_camera: (number | null)[];
  /** 16 numbers, column by column; x to the right, y up, -z forward, as in glTF. */
  to_world: (number | null)[];
}

/**
 * Meaning of the ids in an image's layers. They follow from the file alone: all views, variants and
 * times of a scene have the same ids.
 */
export interface SceneObjects {
  /**
   * The camera without its lens. With (x, y, z) = world_to_camera (X, Y, Z, 1) the point is seen at
   * the pixel (cx + fx x / z, cy + fy y / z) of a perspective or pinhole image, where z > 0, after
   * the lens's distortion has moved (x / z, y / z); at (cx + fx x, cy + fy y) of an orthographic
   * one; and at (cx + fx atan2(x, z), cy + fy atan2(y, hypot(x, z))) of a panorama. Pixel i goes
   * from i to i + 1; for tools that count from its centre, subtract 0.5.
   */
  camera: SceneObjectsCamera;
  /** Whether the job recorded ids, so that `visible` is known. */
  has_ids: boolean;
  /** All objects of the file. */
  objects: SceneObject[];
  /** Instances that are visible. */
  instances: ObjectInstance[];
  materials: Label[];
  primitives: Label[];
}

/** Default values of a job request. */
export interface JobDefaults extends
    Omit<
      JobSpec,
      | 'scene'
      | 'shutter_seconds'
      | 'motion_seconds'
      | 'environment'
      | 'background'
      | 'ground'
      | 'meter'
      | 'denoise'
      | 'webhook'
      | 'retention_seconds'
    >,
    Pick<
      JobSpec,
      | 'shutter_seconds'
      | 'motion_seconds'
      | 'environment'
      | 'background'
      | 'ground'
      | 'meter'
      | 'denoise'
      | 'webhook'
      | 'retention_seconds'
    > {}

/** A name that requests can use. */
export interface TypeInfo {
  /** Name in requests. */
  type: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
  /** JSON pointers of the job request that it supports. */
  accepts: string[];
}

/** An algorithm that traces light paths. */
export interface IntegratorInfo extends Omit<TypeInfo, 'summary'> {
  /** How the error of its images is known. */
  error: 'valid' | 'from-chains' | 'by-comparison';
  summary: string;
  /** Merge patch (RFC 7396) of `defaults` for its jobs. */
  defaults: Record<string, unknown>;
}

/** An estimator setting. */
export interface EstimationOption {
  name: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
  /** Merge patch (RFC 7396) of the job request that selects it. */
  patch: Record<string, unknown>;
}

export interface ExperimentEstimators {
  name: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
}

export interface ExperimentParams {
  name: string;
  min: number;
  max: number;
  default: number;
  integer: boolean;
  summary: string;
}

/** An experiment of the laboratory. */
export interface Experiment {
  name: string;
  title: string;
  summary: string;
  /** Estimated quantity. */
  estimates: string;
  formula: string;
  /** What to look for. */
  look_for: string;
  estimators: ExperimentEstimators[];
  /** Default estimator. */
  estimator: string;
  /** Samplers that it supports. */
  samplers: string[];
  /** Default sampler. */
  sampler: string;
  /** Default values of n. */
  n: number[];
  /** Unit of n. */
  unit: string;
  /** Default number of replicates. */
  replicates: number;
  params: ExperimentParams[];
  /** Exact value with the default parameters. */
  expected: number;
  /** Dimensions of the points that it shows; 0: none. */
  pattern_dimensions: number;
}

/** Build and machine properties on which the bits of a film depend besides the job. */
export interface ServerBuild {
  id: string;
  commit: string;
  compiler: string;
  /** Instruction set for ray tracing. */
  isa: string;
  embree: string;
  /** Paths with default options are traced in groups of eight. */
  waves: boolean;
}

export interface ServerScenes {
  name: string;
  summary: string;
}

/** Server capabilities. */
export interface Server {
  version: string;
  /** Build and machine properties on which the bits of a film depend besides the job. */
  build: ServerBuild;
  /** Every limit by name. */
  limits: Record<string, number>;
  defaults: JobDefaults;
  integrators: IntegratorInfo[];
  samplers: TypeInfo[];
  light_samplers: TypeInfo[];
  adaptive: TypeInfo[];
  /** Every other estimator setting. */
  options: EstimationOption[];
  /** Layers that are recorded by default. */
  layers: string[];
  /** Layers that are recorded only if `film.layers` lists them. */
  optional_layers: string[];
  /** Patterns of layers with a number or name. */
  layer_patterns: string[];
  /** Extensions. */
  image_formats: string[];
  tone_maps: string[];
  filters: string[];
  /** Built-in scenes. */
  scenes: ServerScenes[];
  /** Experiments of the laboratory. */
  experiments: Experiment[];
  /** Supported glTF extensions. */
  extensions: string[];
}

/** Whether the server accepts new jobs, and its remaining work. */
export interface Drain {
  /** New jobs are refused with 503, and queued jobs do not start. */
  draining: boolean;
  /** Jobs that are loading, rendering or ending; they continue. */
  running: number;
  /** Queued jobs. */
  queued: number;
}

/** Results for one n. */
export interface LabPoint {
  /** Samples per trial, after rounding. */
  n: number;
  /** The requested n, before rounding. */
  n_asked: number;
  /** Mean of the replicates. */
  mean: number;
  /** Root mean square error of the replicates. */
  rmse: number;
  /** Standard error of the mean. */
  standard_error: number;
  /** Mean work of a replicate; n unless the experiment counts it. */
  cost: number;
  /**
   * CPU time of all replicates. It is measured and differs from run to run; all other members are
   * reproducible.
   */
  seconds: number;
}

/** The outcome; last line of the response. */
export interface LabOutcome {
  /** Exact value, from a formula. */
  expected: number;
  /**
   * Slope of log RMSE over log n, by least squares; null with fewer than two n, or without an
   * error.
   */
  slope: number | null;
  /** Lower and upper end of the 95% interval; null without a slope. */
  slope_interval: [number, number] | null;
  /** Slope predicted by theory; null if unknown. */
  expected_slope: number | null;
  /** log RMSE = intercept + slope log n, natural logarithms. */
  intercept: number | null;
  /**
   * 1 / (relative MSE * CPU seconds of a replicate), at the largest n. Measured: differs from run
   * to run.
   */
  efficiency: number | null;
  /** The same with `cost` instead of seconds; reproducible. */
  efficiency_by_cost: number | null;
  /**
   * agrees: means and slope agree with theory (a false `differs` has a probability of 0.2%);
   * biased: as declared by the estimator; undecided: nothing to compare, fewer than eight
   * replicates, or too wide an interval of the slope.
   */
  verdict: 'agrees' | 'differs' | 'biased' | 'undecided';
  /** Explanation of the verdict. */
  explanation: string;
  experiment: string;
  estimator: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  sampler: string;
  replicates: number;
  seed: number;
  /** Effective parameters. */
  params: Record<string, number>;
  /** Points of the first replicate, where the experiment shows them; at most 1024. */
  pattern: number[][];
}

/** Last line instead of the outcome if the server shuts down. */
export interface LabCancelled {
  cancelled: boolean;
}

/** A key to create. */
export interface KeyRequest {
  /** Display name. */
  name: string;
  /**
   * Tenant of the key: letters, digits, `.`, `_`, `-`; null: a new one. To replace a key, give its
   * tenant.
   */
  tenant?: string | null;
  /**
   * Scopes; `admin` requires `read` and `write`; `worker` is only for `tessera worker`. Default:
   * ["read","write"].
   */
  scopes?: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests per minute; 0: no limit; null: the server's default. */
  rate_limit?: number | null;
  /** Maximum priority of its jobs. Default: 0. */
  max_priority?: number;
  /** Days until the key expires; null: never. */
  days?: number | null;
}

/** A key, without its text. */
export interface Key {
  /** Identifies the key in lists and logs. */
  id: string;
  /** Display name. */
  name: string;
  /** Tenant whose objects it sees and to which its objects belong. */
  tenant: string;
  /** Scopes. */
  scopes: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests per minute; 0: no limit; null: the server's default. */
  rate_limit: number | null;
  /** Maximum priority of its jobs. */
  max_priority: number;
  created_at: string;
  /** null: never. */
  expires_at: string | null;
}

/** A new key. */
export interface IssuedKey extends Omit<Key, 'created_at'> {
  created_at: string;
  /** Text of the key, which is returned only once. */
  key: string;
}

/** All keys. */
export interface KeyList {
  /** Oldest first. */
  keys: Key[];
}

export interface UsageTenants {
  /** Empty: the operator. */
  tenant: string;
  /** Stored jobs. */
  jobs: number;
  /** Stored jobs that have not ended. */
  unfinished_jobs: number;
  /** CPU time of all jobs except previews, including deleted jobs. */
  cpu_seconds: number;
  /** Number of deleted jobs. */
  deleted_jobs: number;
  /** Assets and scenes of the tenant. */
  asset_bytes: number;
  /** Films, including space reserved for jobs that are rendering. */
  film_bytes: number;
  /** Open event and tile streams. */
  streams: number;
}

/** Quotas of each tenant; 0: no limit. */
export interface UsageQuotas {
  /** Unfinished jobs. */
  jobs: number;
  /** Concurrent previews. */
  previews: number;
  /** Open streams. */
  streams: number;
  /** Concurrent experiments. */
  lab_runs: number;
  /** Assets and films. */
  stored_bytes: number;
}

/** Usage of tenants: all for the operator and admins, otherwise only the key's own. */
export interface Usage {
  /** Sorted by name. */
  tenants: UsageTenants[];
  /** Quotas of each tenant; 0: no limit. */
  quotas: UsageQuotas;
}

/** A webhook call. */
export interface Delivery {
  /** The webhook-id that is sent with every attempt. */
  id: string;
  /** Job or batch of the event; null: a test. */
  job: string | null;
  /** Type of event: `state`, `end` or `test`. */
  event: string;
  url: string;
  /** `failed`: no further attempts. */
  state: 'pending' | 'delivered' | 'failed';
  /** Number of attempts. */
  attempts: number;
  created_at: string;
  /** Set while the call is pending. */
  next_attempt_at: string | null;
  ended_at: string | null;
  /** Status of the last response; null: none. */
  status: number | null;
  /** Why the last attempt failed; null: it did not fail. */
  detail: string | null;
}

/** A page of calls. */
export interface DeliveryList {
  /** Newest first. */
  deliveries: Delivery[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** Receiver of a test call. */
export interface WebhookTestRequest {
  /** Address to which a call of type `test` is sent. */
  url: string;
}

/** The secret that signs calls. */
export interface WebhookSecret {
  /** `whsec_` and base64. */
  secret: string;
}

/** State of a worker and its units. */
export interface WorkerReport {
  /** Id of the worker's build. */
  build: string;
  /** Arithmetic class of the worker. */
  arithmetic: string;
  /** Units that it renders concurrently. Default: 1. */
  threads?: number;
  /** The worker takes no more units. Default: false. */
  draining?: boolean;
  /** Units that the worker holds. */
  units?: Record<string, number>;
}

/** Lease or return of a unit. */
export interface UnitRequest {
  /** Id of the worker. */
  worker: string;
  /** Why a returned unit was not rendered; empty: not because of a fault. Default: "". */
  fault?: string;
}

/** Orders for a worker. */
export interface WorkerOrders {
  /** Whether the worker gets units. */
  suitable: boolean;
  /** Why the worker gets no units. */
  reason: string | null;
  /** Time until the next report. */
  report_seconds: number;
  /** Units whose results are no longer needed. */
  dropped: string[];
}

/** Inputs of a job's units. */
export interface WorkInputs {
  /** The job's `spec`. */
  spec: Record<string, unknown>;
  /** Asset ids by uri; "" is the glTF document. Empty: a built-in scene. */
  files: Record<string, string>;
}

/** A process that renders units of this server's jobs. */
export interface Worker {
  /** Changes each time the worker is started. */
  id: string;
  /** Build of the worker. */
  build: string;
  /** Arithmetic class of the worker. */
  arithmetic: string;
  /** Units that it renders concurrently. */
  threads: number;
  /** Pixel samples per second while rendering. */
  rate: number;
  /** Units that the worker holds. */
  leases: number;
  /** Names of those of them whose jobs the key can see. Each begins with its job's id and a dot. */
  held: string[];
  /** Results that were accepted. */
  units: number;
  /** Units that it lost or failed, or whose results were wrong. */
  faults: number;
  state: 'idle' | 'working' | 'draining' | 'suspended' | 'unsuitable' | 'left' | 'lost';
  /**
   * Why the worker is unsuitable or suspended; for the operator and keys with the scope admin, with
   * the error that it reported.
   */
  reason: string | null;
  /** Time of the last report. */
  seen_at: string;
}

/** A tile that a worker is rendering. Pixels count from the top left of the full film. */
export interface WorkerTile {
  /** Id of the worker. */
  worker: string;
  x: number;
  y: number;
  width: number;
  height: number;
}

/** All workers seen recently. */
export interface WorkerList {
  workers: Worker[];
}

/** Tiles of a job that workers are rendering. */
export interface WorkerTiles {
  tiles: WorkerTile[];
}

/** A template and a matrix of values that define jobs. */
export interface BatchRequest {
  /** A JobRequest; members that the matrix sets may be missing. Class normal only. */
  template: Record<string, unknown>;
  /**
   * Paths of members of the job request, each with an array of values: {"variant": ["a", "b"]}.
   * Every combination is a job; the last member changes fastest. Values that are objects are merged
   * into the member. At most `batch_jobs` jobs.
   */
  matrix: Record<string, unknown[]>;
  /**
   * Pattern of the jobs' names. {variant} is replaced by the value of a member, given by its path
   * or the last part of it; {index} counts from 1. Empty: the values of the matrix. Default: "".
   */
  name?: string;
  /** One call when all jobs have ended; `events` has no effect. */
  webhook?: JobRequestWebhook | null;
}

/** A job of a batch. */
export interface BatchJob {
  /** Id of the job. */
  id: string;
  name: string;
  /** State of the job. */
  state: string;
  fraction: number;
  /** Number of changes of its image; 0: there is no image yet. */
  revision: number;
  /** Values that the matrix assigned to it. */
  values: Record<string, unknown>;
}

/** Progress of all jobs together. */
export interface BatchProgress {
  /** Mean over the jobs; 1 for jobs that have ended. */
  fraction: number;
  cpu_seconds: number;
}

/** Jobs in each state. */
export interface BatchCounts {
  queued: number;
  loading: number;
  rendering: number;
  paused: number;
  failed: number;
  cancelled: number;
  finished: number;
}

/** Jobs that were submitted together. */
export interface Batch {
  id: string;
  /** The pattern of the jobs' names. */
  name: string;
  /**
   * Once all jobs have ended: failed if any failed or is damaged, otherwise cancelled if any was
   * cancelled.
   */
  state: 'queued' | 'rendering' | 'paused' | 'failed' | 'cancelled' | 'finished';
  created_at: string;
  /** Progress of all jobs together. */
  progress: BatchProgress;
  /** Jobs in each state. */
  counts: BatchCounts;
  flicker: Flicker | null;
  /**
   * Ids of jobs whose stored records are damaged: nothing is known of them, and they can only be
   * deleted.
   */
  damaged: string[];
  /** Paths of related resources. */
  links: Record<string, string>;
  /** In the order of the matrix. */
  jobs: BatchJob[];
}

/** A batch without its jobs. */
export interface BatchSummary extends Omit<Batch, 'id' | 'created_at' | 'flicker' | 'jobs'> {
  id: string;
  created_at: string;
  flicker: Flicker | null;
}

/** A page of batches. */
export interface BatchList {
  /** Newest first. */
  batches: BatchSummary[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** The jobs that a batch would create. */
export interface BatchDryRun {
  /** Names of the jobs, in their order. */
  names: string[];
}

/** Two images; b is the reference. */
export interface ComparisonRequest {
  /** Job id (UUID) or asset id (64 hex digits). */
  a: string;
  /** Job id (UUID) or asset id (64 hex digits). */
  b: string;
  /**
   * Which image of job a. For a denoised image the errors of individual pixels are unknown, so
   * bias.low, bias.high and z are null. Default: "off".
   */
  a_denoise?: 'off' | 'mixed' | 'full' | 'video';
  /** Which image of job b. Default: "off". */
  b_denoise?: 'off' | 'mixed' | 'full' | 'video';
}
