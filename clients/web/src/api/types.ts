/**
 * The bodies of the HTTP interface, as they are in JSON.
 * Made by clients/generate.py from /openapi.json; not edited by hand.
 */

/** A job: what to render, how, and when to stop. */
export interface JobRequest {
  /** Id from POST /v1/scenes, or the name of a built-in scene. */
  scene: string;
  /** Display name. Default: "". */
  name?: string;
  /** Free key-value pairs to find jobs by. Default: {}. */
  labels?: Record<string, string>;
  /** Higher is served first. Default: 0. */
  priority?: number;
  /** Seed for all random numbers in the job. Default: 0. */
  seed?: number;
  /**
   * Null members keep the value of the file's camera, selected by name or index (default: the first
   * camera).
   */
  camera?: {
    /** Camera of the file by name. */
    name?: string | null;
    /** Camera of the file by index; not together with name. */
    index?: number | null;
    /**
     * Camera position in world space, metres. Requires target; together they replace the file's
     * pose.
     */
    position?: [number, number, number] | null;
    /** Point that the camera looks at, in world space, metres. */
    target?: [number, number, number] | null;
    /** Upward direction; [0, 1, 0] if position and target are given without it. */
    up?: [number, number, number] | null;
    /** Camera position on a sphere around the target, instead of position and target. */
    orbit?: {
      /**
       * Turns the camera about +y, counter-clockwise seen from above; 0 is in front (+z). Default:
       * 0.
       */
      theta_degrees?: number;
      /** From +y: 0 looks from above, 90 is level. Default: 75. */
      phi_degrees?: number;
      /**
       * Distance from the target, metres; 'auto': all of the scene is in the view. Default: "auto".
       */
      radius?: string | number;
      /**
       * Point that the camera looks at, metres; 'auto': the centre of the scene's box. Default:
       * "auto".
       */
      target?: string | [number, number, number];
    } | null;
    /** Projection; by default the file camera's, and perspective where the pose is given. */
    type?: string;
    /**
     * Height of an orthographic view, metres; null: the file camera's, or what a perspective camera
     * sees at the target's distance.
     */
    orthographic_height?: number | null;
    /** Vertical field of view, degrees; perspective cameras only. */
    vertical_fov_degrees?: number | null;
    /** Radius of the lens, metres; 0 is a pinhole. */
    aperture_radius?: number | null;
    /** Distance of the plane in focus, metres. */
    focus_distance?: number | null;
  };
  /** Material variant of the file by name (KHR_materials_variants). */
  variant?: string | null;
  /**
   * Animation time, seconds; null: the rest pose, which the file's own transforms give. Default: 0.
   */
  time_seconds?: number | null;
  /**
   * Exposure time in seconds, starting at time_seconds: motion of animated objects and of the
   * file's camera during that time is blurred. 0: no motion blur. Default: 0.
   */
  shutter_seconds?: number;
  /**
   * Time difference, in seconds, over which the layer motion is measured, including motion of the
   * file's camera; negative values look back. In the rest pose nothing moves. Default:
   * 0.041666666666666664.
   */
  motion_seconds?: number;
  /**
   * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
   * null: none.
   */
  medium?: {
    /** Kind of medium. Default: "homogeneous". */
    type?: string;
    /** Coefficient in 1/m, linear RGB. Default: [0,0,0]. */
    scattering?: [number, number, number];
    /** Coefficient in 1/m, linear RGB. Default: [0,0,0]. */
    absorption?: [number, number, number];
    /**
     * Mean cosine of the scattering angle (Henyey and Greenstein): 0 is isotropic, positive values
     * are forward scattering. Default: 0.
     */
    g?: number;
    /**
     * The density falls with exp(-height_falloff y); the coefficients apply at y = 0. Default: 0.
     */
    height_falloff?: number;
  } | null;
  /** Scheduling class. Default: "normal". */
  class?: string;
  /** A later preview with the same key supersedes this one; class preview only. */
  preview_key?: string | null;
  /**
   * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's
   * own, if it has one; else white, unless the scene has a punctual light or an emissive strength
   * above 1.
   */
  environment?: {
    /** Asset with an equirectangular image (.hdr, .exr); null: one colour. */
    asset?: string | null;
    /** Studio lighting generated in code, as strong as a white environment; instead of an asset. */
    preset?: string;
    /**
     * Sun and clear sky at a place and time, in W/(m2 sr) of nominal white (683 lm/W): at noon
     * about 100 times as bright as a white environment. Sky: Preetham, Shirley and Smits 1999,
     * turbidity 3. Position: NOAA. The sun is a disc that is sampled as a light. North is -z, east
     * +x.
     */
    sun?: {
      /** Degrees; north is positive. */
      latitude: number;
      /** Degrees; east is positive. */
      longitude: number;
      /** RFC 3339; the sun must be above the horizon. */
      time: string;
    } | null;
    /** Linear Rec.709; multiplies the image. Default: [1,1,1]. */
    color?: [number, number, number];
    /** Multiplies colour and image. Default: 1. */
    intensity?: number;
    /** Positive values rotate it counter-clockwise seen from above. Default: 0. */
    rotation_degrees?: number;
    /**
     * If false, the environment lights the scene but the background is transparent; same as
     * background type 'transparent'. Default: true.
     */
    visible?: boolean;
  } | null;
  /** What the camera sees where it hits no surface; mirrors and glass show the environment. */
  background?: {
    /**
     * Kind of background. If absent: 'transparent' with ground 'catcher', otherwise 'environment'.
     * Default: "environment".
     */
    type?: string;
    /** Linear Rec.709. Default: [1,1,1]. */
    color?: [number, number, number];
  };
  /** Horizontal ground added to the scene. */
  ground?: {
    /** Kind of ground. Default: "none". */
    type?: string;
    /** y of the ground, metres; null: the model's lowest point. */
    height?: number | null;
    /**
     * Surface colour, linear Rec.709; a catcher uses it too, because it lights the model from
     * below. Default: [0.8,0.8,0.8].
     */
    color?: [number, number, number];
    /**
     * Weight of a polished clear coat that mirrors the model: 0 is matte, 1 a lacquered surface,
     * which reflects 4% seen from above and more at grazing angles. Default: 0.
     */
    reflection?: number;
  };
  /** Size, filter and recorded layers. */
  film?: {
    /** Pixels. Width times height is limited to 64 megapixels (413). Default: 960. */
    width?: number;
    /** Pixels. Default: 540. */
    height?: number;
    /** Part of the film to render; null: all of it. */
    crop?: {
      /** Left column, in pixels of the full film. */
      x: number;
      /** Top row, in pixels of the full film. */
      y: number;
      /** Pixels. */
      width: number;
      /** Pixels. */
      height: number;
    } | null;
    /** Reconstruction filter. */
    filter?: {
      /** Kind of filter. Default: "blackman-harris". */
      type?: string;
      /** Radius in pixels. Default: 1.5. */
      radius?: number;
    };
    /**
     * Layers to record: albedo, normal, depth, object, instance, material, primitive, position, uv,
     * motion, cryptomatte:object, cryptomatte:material, shares of the light, bounce:N and
     * light:NAME (path and bdpt) and st:S,T (bdpt), and irradiance. The others are always there.
     * Default: ["albedo","normal","depth"].
     */
    layers?: string[];
  };
  /** How light paths are traced. */
  integrator?: {
    /** Algorithm. Default: "path". */
    type?: string;
    /** Scattering events on a path; 0 shows emitters only, 1 adds direct light. Default: 16. */
    max_depth?: number;
    /**
     * Particles emitted from the lights per sample; 0: as many as the full film has pixels, from
     * 1024 to 262144. Default: 0.
     */
    photons?: number;
    /**
     * Radius within which photons are gathered, metres; for sppm, the initial radius. 0: three
     * pixels at the distance that the camera sees. Default: 0.
     */
    radius_m?: number;
    /**
     * After N samples of each replicate, the area of the disk and the bias are about N^(alpha - 1)
     * times the initial ones, while the variance falls as N^-alpha. With 2/3, the squared bias and
     * the variance fall at the same rate. Default: 0.6666667.
     */
    alpha?: number;
    /**
     * Directions in which each path queries the photon map one reflection later; 0: show the map
     * itself, including direct light. Default: 1.
     */
    final_gather?: number;
    /**
     * Maximum relative interpolation error at which an irradiance record is used; half of it takes
     * about four times as many records. Default: 0.25.
     */
    tolerance?: number;
    /** Paths over the hemisphere of each record. Default: 256. */
    rays?: number;
    /**
     * Maximum number of records per replicate. Where there are none, indirect light is path traced.
     * Default: 32768.
     */
    records?: number;
  };
  /** How paths are sampled and combined. */
  estimator?: {
    /** How directions are sampled. Default: "mis". */
    strategy?: string;
    /** Weights of multiple importance sampling. */
    mis?: {
      /** Heuristic. Default: "power". */
      type?: string;
      /** Exponent of the power heuristic. Default: 2. */
      exponent?: number;
    };
    /** Russian roulette. */
    roulette?: {
      /** Criterion for the survival of a path. Default: "throughput". */
      type?: string;
      /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. Default: 0.02. */
      delta?: number;
    };
    /** Splitting of paths at their first surface. */
    splitting?: {
      /** How the number of continuations is chosen. Default: "measured". */
      type?: string;
      /** Continuations of each path. Default: 2. */
      count?: number;
    };
    /** A known part of the light that is computed in closed form instead of sampled. */
    control_variate?: {
      /** Kind of control variate. Default: "none". */
      type?: string;
    };
    /**
     * True: absorption and transparency are factors; false: they end paths at random. Default:
     * true.
     */
    expected_values?: boolean;
  };
  /** Source of random numbers. */
  sampler?: {
    /** Kind of point set. Each supports certain sample counts; see /v1/server. Default: "sobol". */
    type?: string;
    /** Number of independent randomisations per pixel; even. Default: 2. */
    replicates?: number;
    /**
     * Number of the first replicate of the seed; even. Jobs with different replicates can be merged
     * into the film of one job. Default: 0.
     */
    first_replicate?: number;
  };
  /** How a light is selected. */
  light_sampler?: {
    /** Type of light selection. Default: "tree". */
    type?: string;
    /** Number of candidate light samples, of which one is used. Default: 2. */
    candidates?: number;
    /** Side in pixels of the squares whose pixels share light samples. Default: 3. */
    block?: number;
    /**
     * Number of successive passes (samples of a replicate) that share light samples. At most 64
     * paths share, block x block x history. Default: 1.
     */
    history?: number;
    /** Candidate light samples per path, of which one is shared. Default: 1. */
    candidates_per_pixel?: number;
  };
  /** Adaptive sampling. */
  adaptive?: {
    /**
     * Rule that distributes samples. If absent: 'pilot' for jobs with stop.relative_error,
     * otherwise 'none'. Default: "none".
     */
    type?: string;
    /**
     * Samples of every pixel before the first decision, over all replicates; rounded up to the
     * counts at which decisions are made: 20, or 1, 1.25, 1.5 and 1.75 times 2^k per replicate.
     * Default: 32.
     */
    min_samples?: number;
    /** Unit within which all pixels get the same number of samples. Default: "pixel". */
    granularity?: string;
    /**
     * Radius in pixels, or in tiles for granularity 'tile': the neighbour within it that needs most
     * samples counts. Default: 1.
     */
    dilation?: number;
  };
  /**
   * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
   * per sample of a pixel; see GET /v1/jobs/{id}/meter.
   */
  meter?: {
    /** Points at which irradiance is measured. Default: []. */
    points?: {
      /** World space, metres. */
      position: [number, number, number];
      /** Direction that it faces; any length except 0. */
      normal: [number, number, number];
    }[];
    /**
     * Points at the centres of the cells of a rectangle, row by row; they follow the single points.
     */
    plane?: {
      /** Corner of the rectangle, world space, metres. */
      origin: [number, number, number];
      /** Vector from the origin to the next corner; the plane faces along edge_u x edge_v. */
      edge_u: [number, number, number];
      /** Vector from the origin to the previous corner. */
      edge_v: [number, number, number];
      /** Cells along edge_u. */
      columns: number;
      /** Cells along edge_v. */
      rows: number;
    } | null;
  } | null;
  /** True: paths carry three wavelengths instead of three colours. Default: false. */
  spectral?: boolean;
  /**
   * When to stop: the first rule met ends the job. If given, only the rules in it apply. Default:
   * {"samples_per_pixel":256}.
   */
  stop?: {
    /**
     * Stop at this mean number of samples per pixel of the crop, over all replicates. Rounded up to
     * a count that the sampler supports. Default: 256.
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
     * Confidence of relative_error, of denoised_error and of the interval in `error`. Default:
     * 0.95.
     */
    confidence?: number;
    /** What has to meet the error target. Default: "image". */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** Denoised images, which are computed on request and never part of the film. */
  denoise?: {
    /** The denoiser. Default: "auto". */
    type?: string;
    /** If false, images are not denoised before the job has ended. Default: true. */
    preview?: boolean;
  };
  /** Webhook to notify. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. Default: ["end"]. */
    events?: string[];
  } | null;
  /** The job and its files are deleted this many seconds after its end; null: kept. */
  retention_seconds?: number | null;
}

/** A merge patch (RFC 7396) of the members that can be changed. */
export interface JobPatch {
  /** Higher is served first. */
  priority?: number;
  /** Labels to set; null removes a label, labels not listed stay. */
  labels?: Record<string, string | null>;
  /** Display name. */
  name?: string;
  /** Rules to change; null removes a rule, rules not listed stay. */
  stop?: {
    /**
     * Stop at this mean number of samples per pixel of the crop, over all replicates. Rounded up to
     * a count that the sampler supports. Default: 256.
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
     * Confidence of relative_error, of denoised_error and of the interval in `error`. Default:
     * 0.95.
     */
    confidence?: number;
    /** What has to meet the error target. Default: "image". */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** True pauses, false resumes. */
  paused?: boolean;
}

/** A scene from uploaded assets. */
export interface SceneFromAssets {
  /** Asset with the glTF or GLB file. */
  gltf: string;
  /** Asset ids of the files that the glTF refers to, by uri. Default: {}. */
  files?: Record<string, string>;
}

/** How to extend a job. */
export interface ExtendRequest {
  /** The new rules; they replace the old ones. */
  stop: {
    /**
     * Stop at this mean number of samples per pixel of the crop, over all replicates. Rounded up to
     * a count that the sampler supports.
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
     * Confidence of relative_error, of denoised_error and of the interval in `error`. Default:
     * 0.95.
     */
    confidence?: number;
    /** What has to meet the error target. Default: "image". */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
}

/** Films to merge. */
export interface MergeRequest {
  /** Compatible films that share no samples. */
  films: string[];
}

/** The jobs for which to create a ticket. */
export interface TicketRequest {
  /** Jobs that the ticket gives access to. */
  jobs: string[];
}

/** An experiment to run; whole runs are limited to `lab_evaluations`. */
export interface LabRequest {
  /** Estimator of the experiment; see `experiments` in GET /v1/server. */
  experiment: string;
  /** One of the experiment's; default: the experiment's own. */
  estimator?: string;
  /** Sampler to use, if the experiment supports it; its own default when absent. */
  sampler?: string;
  /**
   * Numbers of evaluations per replicate; each gives one line of the response. Rounded as the
   * estimator and sampler require.
   */
  n?: number[];
  /** Independent repetitions from which the errors are measured. Default: 64. */
  replicates?: number;
  /** Random seed; the same seed gives identical results, except for timings. Default: 0. */
  seed?: number;
  /** Parameters of the experiment, by name. */
  params?: Record<string, number>;
}

/** One fault of the input. */
export interface FieldError {
  /** JSON pointer into the body; /name for the query parameter `name`. */
  pointer: string;
  /** The value found, and what is allowed. */
  detail: string;
}

/** RFC 9457. */
export interface Problem {
  /** Problem type, a URI reference. */
  type: string;
  /** Summary; the same for every problem of this type. */
  title: string;
  /** HTTP status. */
  status: number;
  /** Explanation of this occurrence. */
  detail: string;
  /** URL path of the request. */
  instance?: string;
  /** Faults of the input. */
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

/** The job request with all effective values. */
export interface JobSpec {
  /** Id from POST /v1/scenes, or the name of a built-in scene. */
  scene: string;
  /** Display name. */
  name: string;
  /** Free key-value pairs to find jobs by. */
  labels: Record<string, string>;
  /** Higher is served first. */
  priority: number;
  /** Seed for all random numbers in the job. */
  seed: number;
  /**
   * Null members keep the value of the file's camera, selected by name or index (default: the first
   * camera).
   */
  camera: {
    /** Camera of the file by name. */
    name: string | null;
    /** Camera of the file by index; not together with name. */
    index: number | null;
    /**
     * Camera position in world space, metres. Requires target; together they replace the file's
     * pose.
     */
    position: [number, number, number] | null;
    /** Point that the camera looks at, in world space, metres. */
    target: [number, number, number] | null;
    /** Upward direction; [0, 1, 0] if position and target are given without it. */
    up: [number, number, number] | null;
    /** Camera position on a sphere around the target, instead of position and target. */
    orbit?: {
      /** Turns the camera about +y, counter-clockwise seen from above; 0 is in front (+z). */
      theta_degrees: number;
      /** From +y: 0 looks from above, 90 is level. */
      phi_degrees: number;
      /** Distance from the target, metres; 'auto': all of the scene is in the view. */
      radius: string | number;
      /** Point that the camera looks at, metres; 'auto': the centre of the scene's box. */
      target: string | [number, number, number];
    } | null;
    /** Projection; by default the file camera's, and perspective where the pose is given. */
    type?: string;
    /**
     * Height of an orthographic view, metres; null: the file camera's, or what a perspective camera
     * sees at the target's distance.
     */
    orthographic_height?: number | null;
    /** Vertical field of view, degrees; perspective cameras only. */
    vertical_fov_degrees: number | null;
    /** Radius of the lens, metres; 0 is a pinhole. */
    aperture_radius: number | null;
    /** Distance of the plane in focus, metres. */
    focus_distance: number | null;
  };
  /** Material variant of the file by name (KHR_materials_variants). */
  variant: string | null;
  /** Animation time, seconds; null: the rest pose, which the file's own transforms give. */
  time_seconds: number | null;
  /**
   * Exposure time in seconds, starting at time_seconds: motion of animated objects and of the
   * file's camera during that time is blurred. 0: no motion blur.
   */
  shutter_seconds?: number;
  /**
   * Time difference, in seconds, over which the layer motion is measured, including motion of the
   * file's camera; negative values look back. In the rest pose nothing moves.
   */
  motion_seconds?: number;
  /**
   * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
   * null: none.
   */
  medium: {
    /** Kind of medium. */
    type: string;
    /** Coefficient in 1/m, linear RGB. */
    scattering: [number, number, number];
    /** Coefficient in 1/m, linear RGB. */
    absorption: [number, number, number];
    /**
     * Mean cosine of the scattering angle (Henyey and Greenstein): 0 is isotropic, positive values
     * are forward scattering.
     */
    g: number;
    /** The density falls with exp(-height_falloff y); the coefficients apply at y = 0. */
    height_falloff: number;
  } | null;
  /** Scheduling class. */
  class: string;
  /** A later preview with the same key supersedes this one; class preview only. */
  preview_key: string | null;
  /**
   * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's
   * own, if it has one; else white, unless the scene has a punctual light or an emissive strength
   * above 1.
   */
  environment?: {
    /** Asset with an equirectangular image (.hdr, .exr); null: one colour. */
    asset: string | null;
    /** Studio lighting generated in code, as strong as a white environment; instead of an asset. */
    preset?: string;
    /**
     * Sun and clear sky at a place and time, in W/(m2 sr) of nominal white (683 lm/W): at noon
     * about 100 times as bright as a white environment. Sky: Preetham, Shirley and Smits 1999,
     * turbidity 3. Position: NOAA. The sun is a disc that is sampled as a light. North is -z, east
     * +x.
     */
    sun?: {
      /** Degrees; north is positive. */
      latitude: number;
      /** Degrees; east is positive. */
      longitude: number;
      /** RFC 3339; the sun must be above the horizon. */
      time: string;
    } | null;
    /** Linear Rec.709; multiplies the image. */
    color: [number, number, number];
    /** Multiplies colour and image. */
    intensity: number;
    /** Positive values rotate it counter-clockwise seen from above. */
    rotation_degrees: number;
    /**
     * If false, the environment lights the scene but the background is transparent; same as
     * background type 'transparent'.
     */
    visible: boolean;
  } | null;
  /** What the camera sees where it hits no surface; mirrors and glass show the environment. */
  background?: {
    /**
     * Kind of background. If absent: 'transparent' with ground 'catcher', otherwise 'environment'.
     */
    type: string;
    /** Linear Rec.709. */
    color?: [number, number, number];
  };
  /** Horizontal ground added to the scene. */
  ground?: {
    /** Kind of ground. */
    type: string;
    /** y of the ground, metres; null: the model's lowest point. */
    height?: number | null;
    /**
     * Surface colour, linear Rec.709; a catcher uses it too, because it lights the model from
     * below.
     */
    color?: [number, number, number];
    /**
     * Weight of a polished clear coat that mirrors the model: 0 is matte, 1 a lacquered surface,
     * which reflects 4% seen from above and more at grazing angles.
     */
    reflection?: number;
  };
  /** Size, filter and recorded layers. */
  film: {
    /** Pixels. Width times height is limited to 64 megapixels (413). */
    width: number;
    /** Pixels. */
    height: number;
    /** Part of the film to render; null: all of it. */
    crop: {
      /** Left column, in pixels of the full film. */
      x: number;
      /** Top row, in pixels of the full film. */
      y: number;
      /** Pixels. */
      width: number;
      /** Pixels. */
      height: number;
    } | null;
    /** Reconstruction filter. */
    filter: {
      /** Kind of filter. */
      type: string;
      /** Radius in pixels. */
      radius: number;
    };
    /**
     * Layers to record: albedo, normal, depth, object, instance, material, primitive, position, uv,
     * motion, cryptomatte:object, cryptomatte:material, shares of the light, bounce:N and
     * light:NAME (path and bdpt) and st:S,T (bdpt), and irradiance. The others are always there.
     */
    layers: string[];
  };
  /** How light paths are traced. */
  integrator: {
    /** Algorithm. */
    type: string;
    /** Scattering events on a path; 0 shows emitters only, 1 adds direct light. */
    max_depth: number;
    /**
     * Particles emitted from the lights per sample; 0: as many as the full film has pixels, from
     * 1024 to 262144.
     */
    photons?: number;
    /**
     * Radius within which photons are gathered, metres; for sppm, the initial radius. 0: three
     * pixels at the distance that the camera sees.
     */
    radius_m?: number;
    /**
     * After N samples of each replicate, the area of the disk and the bias are about N^(alpha - 1)
     * times the initial ones, while the variance falls as N^-alpha. With 2/3, the squared bias and
     * the variance fall at the same rate.
     */
    alpha?: number;
    /**
     * Directions in which each path queries the photon map one reflection later; 0: show the map
     * itself, including direct light.
     */
    final_gather?: number;
    /**
     * Maximum relative interpolation error at which an irradiance record is used; half of it takes
     * about four times as many records.
     */
    tolerance?: number;
    /** Paths over the hemisphere of each record. */
    rays?: number;
    /**
     * Maximum number of records per replicate. Where there are none, indirect light is path traced.
     */
    records?: number;
  };
  /** How paths are sampled and combined. */
  estimator: {
    /** How directions are sampled. */
    strategy: string;
    /** Weights of multiple importance sampling. */
    mis: {
      /** Heuristic. */
      type: string;
      /** Exponent of the power heuristic. */
      exponent?: number;
    };
    /** Russian roulette. */
    roulette: {
      /** Criterion for the survival of a path. */
      type: string;
      /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. */
      delta?: number;
    };
    /** Splitting of paths at their first surface. */
    splitting: {
      /** How the number of continuations is chosen. */
      type: string;
      /** Continuations of each path. */
      count?: number;
    };
    /** A known part of the light that is computed in closed form instead of sampled. */
    control_variate: {
      /** Kind of control variate. */
      type: string;
    };
    /** True: absorption and transparency are factors; false: they end paths at random. */
    expected_values: boolean;
  };
  /** Source of random numbers. */
  sampler: {
    /** Kind of point set. Each supports certain sample counts; see /v1/server. */
    type: string;
    /** Number of independent randomisations per pixel; even. */
    replicates: number;
    /**
     * Number of the first replicate of the seed; even. Jobs with different replicates can be merged
     * into the film of one job.
     */
    first_replicate?: number;
  };
  /** How a light is selected. */
  light_sampler: {
    /** Type of light selection. */
    type: string;
    /** Number of candidate light samples, of which one is used. */
    candidates?: number;
    /** Side in pixels of the squares whose pixels share light samples. */
    block?: number;
    /**
     * Number of successive passes (samples of a replicate) that share light samples. At most 64
     * paths share, block x block x history.
     */
    history?: number;
    /** Candidate light samples per path, of which one is shared. */
    candidates_per_pixel?: number;
  };
  /** Adaptive sampling. */
  adaptive: {
    /**
     * Rule that distributes samples. If absent: 'pilot' for jobs with stop.relative_error,
     * otherwise 'none'.
     */
    type: string;
    /**
     * Samples of every pixel before the first decision, over all replicates; rounded up to the
     * counts at which decisions are made: 20, or 1, 1.25, 1.5 and 1.75 times 2^k per replicate.
     */
    min_samples?: number;
    /** Unit within which all pixels get the same number of samples. */
    granularity?: string;
    /**
     * Radius in pixels, or in tiles for granularity 'tile': the neighbour within it that needs most
     * samples counts.
     */
    dilation?: number;
  };
  /**
   * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
   * per sample of a pixel; see GET /v1/jobs/{id}/meter.
   */
  meter?: {
    /** Points at which irradiance is measured. */
    points: {
      /** World space, metres. */
      position: [number, number, number];
      /** Direction that it faces; any length except 0. */
      normal: [number, number, number];
    }[];
    /**
     * Points at the centres of the cells of a rectangle, row by row; they follow the single points.
     */
    plane: {
      /** Corner of the rectangle, world space, metres. */
      origin: [number, number, number];
      /** Vector from the origin to the next corner; the plane faces along edge_u x edge_v. */
      edge_u: [number, number, number];
      /** Vector from the origin to the previous corner. */
      edge_v: [number, number, number];
      /** Cells along edge_u. */
      columns: number;
      /** Cells along edge_v. */
      rows: number;
    } | null;
  } | null;
  /** True: paths carry three wavelengths instead of three colours. */
  spectral: boolean;
  /** When to stop: the first rule met ends the job. If given, only the rules in it apply. */
  stop: {
    /**
     * Stop at this mean number of samples per pixel of the crop, over all replicates. Rounded up to
     * a count that the sampler supports.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to check.
     */
    denoised_error?: number | null;
    /** Confidence of relative_error, of denoised_error and of the interval in `error`. */
    confidence?: number;
    /** What has to meet the error target. */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** Denoised images, which are computed on request and never part of the film. */
  denoise?: {
    /** The denoiser. */
    type: string;
    /** If false, images are not denoised before the job has ended. */
    preview: boolean;
  };
  /** Webhook to notify. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. */
    events: string[];
  } | null;
  /** The job and its files are deleted this many seconds after its end; null: kept. */
  retention_seconds?: number | null;
}

/** State of the drain. */
export interface Progress {
  /** 0 to 1; 1 only at the end. */
  fraction: number;
  /** Samples per pixel, over the pixels of the crop. */
  samples_per_pixel: {
    min: number;
    mean: number;
    max: number;
  };
  /** Rendering time without pauses and downtime. */
  elapsed_seconds: number;
  /** CPU time summed over all threads. */
  cpu_seconds: number;
  /** Until the end; null: unknown. */
  eta_seconds: number | null;
  /** Lower and upper bound of eta_seconds at the current rate; null: unknown. */
  eta_interval_seconds: [number, number] | null;
}

/** Error estimate of the current image. */
export interface ErrorEstimate {
  /**
   * Noise over signal of the average tile: sqrt(mean over tiles of N / (S + F)), N the sum of (A -
   * B)^2 / 4 over pixels and channels, S that of A B, A and B the halves' means, F the floor 3 n
   * (0.05 L)^2 of n pixels in an image of mean luminance L; null: unknown.
   */
  relative_rmse: number | null;
  /** Lower end of the interval; null: unknown, or not valid. */
  low: number | null;
  /** Upper end of the interval. */
  high: number | null;
  /** Of the interval. */
  confidence: number;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  /** False: the two halves are not independent, so there is no interval. */
  valid: boolean;
  /** A few places in the image dominate the error, so the interval is a guess. */
  unreliable: boolean;
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
  /** Number of continuations of splitting 'measured'; null: unknown or other type. */
  split_count: number | null;
}

/** The latest denoised image, and the error of the mixed one. */
export interface Denoised {
  /** The denoiser. */
  type: string;
  version: string;
  /** Hash of the weights' file; null: it has none. */
  sha256: string | null;
  /** Quality setting; null: the denoiser has none. */
  quality: string | null;
  /** Why `auto` did not use the better denoiser. */
  note: string | null;
  /** Uses albedo, normal, depth and emission; false: the scene was deleted. */
  features: boolean;
  /** As in `error`, including bias; 0 if too small to be measured. */
  relative_rmse: number | null;
  /**
   * Lower end of the 95% interval; null: not valid; 0 if an error target ended the job, because
   * only `high` is then guaranteed.
   */
  low: number | null;
  high: number | null;
  /** Error of the denoiser's own image. */
  full_relative_rmse: number | null;
  /**
   * (relative_rmse of the plain image / this one)^2: the factor in samples that the plain image
   * would need for the same error.
   */
  gain: number | null;
  /** Revision of the image from which it was computed. */
  revision: number;
  /** Seconds that it took. */
  seconds: number;
}

/** A job. */
export interface Job {
  /** UUID. */
  id: string;
  state: JobState;
  /** Why it is paused, or null. */
  pause_reason: 'requested' | 'storage_full' | null;
  /** What ended the job; null before. */
  stop_reason:
    | 'samples_per_pixel'
    | 'relative_error'
    | 'denoised_error'
    | 'seconds'
    | 'cpu_seconds'
    | 'deadline'
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
  failure: Problem | null;
  /** 0: the next job; null: not waiting. */
  queue_position: number | null;
  statistics: Statistics;
  /** Number of changes of the image so far. */
  revision: number;
  /** SHA-256 of the film's exact content, once finished. */
  film_digest: string | null;
  denoised: Denoised | null;
  /** Adjustments made to the request, and other warnings. */
  warnings: string[];
  /** URLs of related resources. */
  links: Record<string, string>;
}

/** A page of jobs. */
export interface JobList {
  /** Newest first. */
  jobs: Job[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** The effective settings of a job, and its estimated cost. */
export interface DryRun {
  spec: JobSpec;
  /** As in a job. */
  warnings: string[];
  /** From a pilot of at most half a second. */
  estimate: {
    /** On an idle server. */
    seconds: number;
    /** Lower end of the interval. */
    seconds_low: number;
    /** Upper end of the interval. */
    seconds_high: number;
    /** Of the interval. */
    confidence: number;
    cpu_seconds: number;
    /** Estimated samples per pixel required. */
    samples_per_pixel: number;
    /** Film and scene. */
    memory_bytes: number;
    /** Memory of the film. */
    memory_bytes_low: number;
    /** Memory with which the job is admitted: the maximum while it is loading or rendering. */
    memory_bytes_high: number;
    /** Duration of the pilot. */
    pilot_cpu_seconds: number;
  };
}

/** A stream ticket. */
export interface Ticket {
  /** Value for `?ticket=`. */
  ticket: string;
  expires_at: string;
  /** Ids of the jobs that it gives access to. */
  jobs: string[];
}

/** The state has changed. */
export interface StateEvent {
  state: JobState;
  /** Why it is paused, or null. */
  pause_reason: 'requested' | 'storage_full' | null;
  /** What ended the job; null before. */
  stop_reason:
    | 'samples_per_pixel'
    | 'relative_error'
    | 'denoised_error'
    | 'seconds'
    | 'cpu_seconds'
    | 'deadline'
    | 'limit'
    | 'cancelled'
    | 'failed'
    | null;
  /** 0: the next job; null: not waiting. */
  queue_position: number | null;
  /** Number of changes of `spec`. */
  spec_version: number;
}

/** The image has progressed. */
export interface ProgressEvent {
  state: JobState;
  progress: Progress;
  error: ErrorEstimate;
  statistics: Statistics;
  /** Number of changes of the image so far. */
  revision: number;
  denoised: Denoised | null;
}

/** A tile has changed; only the latest version of each tile is kept. */
export interface TileEvent {
  /** Left column, in pixels of the full film. */
  x: number;
  /** Top row. */
  y: number;
  width: number;
  height: number;
  /** Of the image. */
  revision: number;
  /** Per pixel. */
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
export interface EndEvent {
  state: JobState;
  /** What ended the job; null before. */
  stop_reason:
    | 'samples_per_pixel'
    | 'relative_error'
    | 'denoised_error'
    | 'seconds'
    | 'cpu_seconds'
    | 'deadline'
    | 'limit'
    | 'cancelled'
    | 'failed'
    | null;
  /** SHA-256 of the film's exact content, once finished. */
  film_digest: string | null;
  /** Number of changes of the image so far. */
  revision: number;
  error: ErrorEstimate;
  failure: Problem | null;
}

/** Events were lost; a snapshot follows. */
export interface ResetEvent {
  reason: string;
}

/** The stream is refused: the server is at its limit of streams. */
export interface OverloadedEvent {
  detail: string;
  retry_after_seconds: number;
}

/** The body of a webhook, signed as Standard Webhooks are. */
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

/** A loaded scene. */
export interface Scene {
  /** Value for a job's `scene`. */
  id: string;
  name: string;
  /** Memory of geometry, acceleration structure and textures. */
  bytes: number;
  /** Axis-aligned box, metres; null: empty. */
  bounds: {
    min: [number, number, number];
    max: [number, number, number];
  } | null;
  /** Number of triangle instances: a mesh used twice counts twice. */
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
  relative_rmse: number | null;
  low: number | null;
  high: number | null;
}

/** Error over samples and time. */
export interface Convergence {
  /** The state at each error check. */
  points: ConvergencePoint[];
  /** Slope of log error against log samples by least squares, with 95% interval. */
  slope: {
    value: number | null;
    low: number | null;
    high: number | null;
  };
}

/** Values of one layer at one pixel, per channel. */
export interface PixelLayer {
  mean: (number | null)[];
  standard_error: (number | null)[];
  /** Of the 95% interval. */
  low: (number | null)[];
  /** Of the 95% interval. */
  high: (number | null)[];
  /** Halves A and B; null where the layer has none. */
  halves: ((number | null)[])[] | null;
}

/** One pixel. */
export interface Pixel {
  x: number;
  y: number;
  samples: number;
  /** By name. */
  layers: Record<string, PixelLayer>;
}

/** Irradiance on one side of a point. One lux from a light in the scene is one lux here. */
export interface MeterReading {
  /** World space, metres. */
  position: [number, number, number];
  /** Direction that it faces, unit vector. */
  normal: [number, number, number];
  /** Illuminance over 683 lm/W: of nominal white. */
  irradiance_w_m2: number;
  /** Luminance (Rec. 709) of irradiance_rgb. */
  illuminance_lux: number;
  /** Of the 95% interval of illuminance_lux. */
  low: number;
  /** Of the 95% interval of illuminance_lux. */
  high: number;
  /** In the scene's units, linear. */
  irradiance_rgb: [number, number, number];
  /** Paths, of 16 independent randomisations. */
  samples: number;
}

/** Readings of a job's meter so far. */
export interface Meter {
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  /** The points, followed by the cells of the plane. */
  points: MeterReading[];
}

/** Two images compared; b is the reference. */
export interface Comparison {
  id: string;
  mse: number | null;
  /** Mean of (a-b)^2 / (b^2 + 0.01). */
  relmse: number | null;
  /** LDR, 67 pixels per degree. */
  flip: number | null;
  /** Mean of a - b; its interval is null if the error of one side is unknown. */
  bias: {
    value: number | null;
    low: number | null;
    high: number | null;
  };
  /** Statistics of (a-b) / standard error. */
  z: {
    mean: number | null;
    variance: number | null;
    share_above_3: number | null;
  };
  /** Paths. */
  links: {
    self: string;
    difference: string;
    z: string;
    flip: string;
    a: string;
    b: string;
  };
}

/** A node of the file that shows a mesh. */
export interface SceneObject {
  /** Of the layer object: 1 + the node's number. */
  id: number;
  /** JSON pointer into the glTF document. */
  pointer: string;
  /** Name of the node or its mesh, made unique as in Cryptomatte. */
  name: string;
  /** Of the layer instance. */
  first_instance: number;
  /** Ids of the layer instance, one after another. */
  instances: number;
  /** Box in the world, metres; null: not placed in this view. */
  bounds: {
    min: [number, number, number];
    max: [number, number, number];
  } | null;
  /**
   * Box of the pixels of the full film whose centre shows it; null: none, or the job did not record
   * ids.
   */
  visible: {
    x: number;
    y: number;
    width: number;
    height: number;
    /** That show it. */
    pixels: number;
  } | null;
  /** Box, in pixels, of everything within the film, hidden or not; null: nothing. */
  amodal: {
    x: number;
    y: number;
    width: number;
    height: number;
  } | null;
}

/** An instance of an object that the image shows. */
export interface ObjectInstance {
  /** Of the layer instance. */
  id: number;
  /** Id of its object. */
  object: number;
  /** Box in the world, metres; null: not placed in this view. */
  bounds: {
    min: [number, number, number];
    max: [number, number, number];
  } | null;
  /**
   * Box of the pixels of the full film whose centre shows it; null: none, or the job did not record
   * ids.
   */
  visible: {
    x: number;
    y: number;
    width: number;
    height: number;
    /** That show it. */
    pixels: number;
  } | null;
  /** Box, in pixels, of everything within the film, hidden or not; null: nothing. */
  amodal: {
    x: number;
    y: number;
    width: number;
    height: number;
  } | null;
}

/** The meaning of an id in the layers material and primitive. */
export interface Label {
  id: number;
  /** Null: glTF's default material. */
  pointer: string | null;
  name: string;
}

/**
 * The meaning of the ids in an image's layers. They depend on the file alone and are the same for
 * all views, variants and times of a scene.
 */
export interface Objects {
  /**
   * The camera without its lens. With (x, y, z) = world_to_camera (X, Y, Z, 1) the point is seen at
   * the pixel (cx + fx x / z, cy + fy y / z) of a perspective image, where z > 0; at (cx + fx x, cy
   * + fy y) of an orthographic one; and at (cx + fx atan2(x, z), cy + fy atan2(y, hypot(x, z))) of
   * a panorama. Pixel i goes from i to i + 1; for tools that count from its centre, subtract 0.5.
   */
  camera: {
    type: 'perspective' | 'orthographic' | 'panorama';
    width: number;
    height: number;
    /** Focal length in pixels; orthographic: pixels a metre; panorama: a radian. */
    fx: number;
    fy: number;
    /** Centre of the film; the centre of pixel 0 is at 0.5. */
    cx: number;
    cy: number;
    /** 16 numbers, row by row; x to the right, y down, z ahead, as in OpenCV and COCO. */
    world_to_camera: (number | null)[];
    /** 16 numbers, column by column; x to the right, y up, -z ahead, as in glTF. */
    to_world: (number | null)[];
  };
  /** The job recorded ids, and `visible` is known. */
  has_ids: boolean;
  /** All of the file. */
  objects: SceneObject[];
  /** Those that are seen. */
  instances: ObjectInstance[];
  materials: Label[];
  primitives: Label[];
}

/** Defaults of a job request. */
export interface JobDefaults {
  /** Display name. */
  name: string;
  /** Free key-value pairs to find jobs by. */
  labels: Record<string, string>;
  /** Higher is served first. */
  priority: number;
  /** Seed for all random numbers in the job. */
  seed: number;
  /**
   * Null members keep the value of the file's camera, selected by name or index (default: the first
   * camera).
   */
  camera: {
    /** Camera of the file by name. */
    name: string | null;
    /** Camera of the file by index; not together with name. */
    index: number | null;
    /**
     * Camera position in world space, metres. Requires target; together they replace the file's
     * pose.
     */
    position: [number, number, number] | null;
    /** Point that the camera looks at, in world space, metres. */
    target: [number, number, number] | null;
    /** Upward direction; [0, 1, 0] if position and target are given without it. */
    up: [number, number, number] | null;
    /** Camera position on a sphere around the target, instead of position and target. */
    orbit?: {
      /** Turns the camera about +y, counter-clockwise seen from above; 0 is in front (+z). */
      theta_degrees: number;
      /** From +y: 0 looks from above, 90 is level. */
      phi_degrees: number;
      /** Distance from the target, metres; 'auto': all of the scene is in the view. */
      radius: string | number;
      /** Point that the camera looks at, metres; 'auto': the centre of the scene's box. */
      target: string | [number, number, number];
    } | null;
    /** Projection; by default the file camera's, and perspective where the pose is given. */
    type?: string;
    /**
     * Height of an orthographic view, metres; null: the file camera's, or what a perspective camera
     * sees at the target's distance.
     */
    orthographic_height?: number | null;
    /** Vertical field of view, degrees; perspective cameras only. */
    vertical_fov_degrees: number | null;
    /** Radius of the lens, metres; 0 is a pinhole. */
    aperture_radius: number | null;
    /** Distance of the plane in focus, metres. */
    focus_distance: number | null;
  };
  /** Material variant of the file by name (KHR_materials_variants). */
  variant: string | null;
  /** Animation time, seconds; null: the rest pose, which the file's own transforms give. */
  time_seconds: number | null;
  /**
   * Exposure time in seconds, starting at time_seconds: motion of animated objects and of the
   * file's camera during that time is blurred. 0: no motion blur.
   */
  shutter_seconds?: number;
  /**
   * Time difference, in seconds, over which the layer motion is measured, including motion of the
   * file's camera; negative values look back. In the rest pose nothing moves.
   */
  motion_seconds?: number;
  /**
   * Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside solids.
   * null: none.
   */
  medium: {
    /** Kind of medium. */
    type: string;
    /** Coefficient in 1/m, linear RGB. */
    scattering: [number, number, number];
    /** Coefficient in 1/m, linear RGB. */
    absorption: [number, number, number];
    /**
     * Mean cosine of the scattering angle (Henyey and Greenstein): 0 is isotropic, positive values
     * are forward scattering.
     */
    g: number;
    /** The density falls with exp(-height_falloff y); the coefficients apply at y = 0. */
    height_falloff: number;
  } | null;
  /** Scheduling class. */
  class: string;
  /** A later preview with the same key supersedes this one; class preview only. */
  preview_key: string | null;
  /**
   * Distant environment lighting, added to the scene's lights. Null: black. Absent: the scene's
   * own, if it has one; else white, unless the scene has a punctual light or an emissive strength
   * above 1.
   */
  environment?: {
    /** Asset with an equirectangular image (.hdr, .exr); null: one colour. */
    asset: string | null;
    /** Studio lighting generated in code, as strong as a white environment; instead of an asset. */
    preset?: string;
    /**
     * Sun and clear sky at a place and time, in W/(m2 sr) of nominal white (683 lm/W): at noon
     * about 100 times as bright as a white environment. Sky: Preetham, Shirley and Smits 1999,
     * turbidity 3. Position: NOAA. The sun is a disc that is sampled as a light. North is -z, east
     * +x.
     */
    sun?: {
      /** Degrees; north is positive. */
      latitude: number;
      /** Degrees; east is positive. */
      longitude: number;
      /** RFC 3339; the sun must be above the horizon. */
      time: string;
    } | null;
    /** Linear Rec.709; multiplies the image. */
    color: [number, number, number];
    /** Multiplies colour and image. */
    intensity: number;
    /** Positive values rotate it counter-clockwise seen from above. */
    rotation_degrees: number;
    /**
     * If false, the environment lights the scene but the background is transparent; same as
     * background type 'transparent'.
     */
    visible: boolean;
  } | null;
  /** What the camera sees where it hits no surface; mirrors and glass show the environment. */
  background?: {
    /**
     * Kind of background. If absent: 'transparent' with ground 'catcher', otherwise 'environment'.
     */
    type: string;
    /** Linear Rec.709. */
    color?: [number, number, number];
  };
  /** Horizontal ground added to the scene. */
  ground?: {
    /** Kind of ground. */
    type: string;
    /** y of the ground, metres; null: the model's lowest point. */
    height?: number | null;
    /**
     * Surface colour, linear Rec.709; a catcher uses it too, because it lights the model from
     * below.
     */
    color?: [number, number, number];
    /**
     * Weight of a polished clear coat that mirrors the model: 0 is matte, 1 a lacquered surface,
     * which reflects 4% seen from above and more at grazing angles.
     */
    reflection?: number;
  };
  /** Size, filter and recorded layers. */
  film: {
    /** Pixels. Width times height is limited to 64 megapixels (413). */
    width: number;
    /** Pixels. */
    height: number;
    /** Part of the film to render; null: all of it. */
    crop: {
      /** Left column, in pixels of the full film. */
      x: number;
      /** Top row, in pixels of the full film. */
      y: number;
      /** Pixels. */
      width: number;
      /** Pixels. */
      height: number;
    } | null;
    /** Reconstruction filter. */
    filter: {
      /** Kind of filter. */
      type: string;
      /** Radius in pixels. */
      radius: number;
    };
    /**
     * Layers to record: albedo, normal, depth, object, instance, material, primitive, position, uv,
     * motion, cryptomatte:object, cryptomatte:material, shares of the light, bounce:N and
     * light:NAME (path and bdpt) and st:S,T (bdpt), and irradiance. The others are always there.
     */
    layers: string[];
  };
  /** How light paths are traced. */
  integrator: {
    /** Algorithm. */
    type: string;
    /** Scattering events on a path; 0 shows emitters only, 1 adds direct light. */
    max_depth: number;
    /**
     * Particles emitted from the lights per sample; 0: as many as the full film has pixels, from
     * 1024 to 262144.
     */
    photons?: number;
    /**
     * Radius within which photons are gathered, metres; for sppm, the initial radius. 0: three
     * pixels at the distance that the camera sees.
     */
    radius_m?: number;
    /**
     * After N samples of each replicate, the area of the disk and the bias are about N^(alpha - 1)
     * times the initial ones, while the variance falls as N^-alpha. With 2/3, the squared bias and
     * the variance fall at the same rate.
     */
    alpha?: number;
    /**
     * Directions in which each path queries the photon map one reflection later; 0: show the map
     * itself, including direct light.
     */
    final_gather?: number;
    /**
     * Maximum relative interpolation error at which an irradiance record is used; half of it takes
     * about four times as many records.
     */
    tolerance?: number;
    /** Paths over the hemisphere of each record. */
    rays?: number;
    /**
     * Maximum number of records per replicate. Where there are none, indirect light is path traced.
     */
    records?: number;
  };
  /** How paths are sampled and combined. */
  estimator: {
    /** How directions are sampled. */
    strategy: string;
    /** Weights of multiple importance sampling. */
    mis: {
      /** Heuristic. */
      type: string;
      /** Exponent of the power heuristic. */
      exponent?: number;
    };
    /** Russian roulette. */
    roulette: {
      /** Criterion for the survival of a path. */
      type: string;
      /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. */
      delta?: number;
    };
    /** Splitting of paths at their first surface. */
    splitting: {
      /** How the number of continuations is chosen. */
      type: string;
      /** Continuations of each path. */
      count?: number;
    };
    /** A known part of the light that is computed in closed form instead of sampled. */
    control_variate: {
      /** Kind of control variate. */
      type: string;
    };
    /** True: absorption and transparency are factors; false: they end paths at random. */
    expected_values: boolean;
  };
  /** Source of random numbers. */
  sampler: {
    /** Kind of point set. Each supports certain sample counts; see /v1/server. */
    type: string;
    /** Number of independent randomisations per pixel; even. */
    replicates: number;
    /**
     * Number of the first replicate of the seed; even. Jobs with different replicates can be merged
     * into the film of one job.
     */
    first_replicate?: number;
  };
  /** How a light is selected. */
  light_sampler: {
    /** Type of light selection. */
    type: string;
    /** Number of candidate light samples, of which one is used. */
    candidates?: number;
    /** Side in pixels of the squares whose pixels share light samples. */
    block?: number;
    /**
     * Number of successive passes (samples of a replicate) that share light samples. At most 64
     * paths share, block x block x history.
     */
    history?: number;
    /** Candidate light samples per path, of which one is shared. */
    candidates_per_pixel?: number;
  };
  /** Adaptive sampling. */
  adaptive: {
    /**
     * Rule that distributes samples. If absent: 'pilot' for jobs with stop.relative_error,
     * otherwise 'none'.
     */
    type: string;
    /**
     * Samples of every pixel before the first decision, over all replicates; rounded up to the
     * counts at which decisions are made: 20, or 1, 1.25, 1.5 and 1.75 times 2^k per replicate.
     */
    min_samples?: number;
    /** Unit within which all pixels get the same number of samples. */
    granularity?: string;
    /**
     * Radius in pixels, or in tiles for granularity 'tile': the neighbour within it that needs most
     * samples counts.
     */
    dilation?: number;
  };
  /**
   * Points at which irradiance is measured in addition to the image, by path tracing with 16 paths
   * per sample of a pixel; see GET /v1/jobs/{id}/meter.
   */
  meter?: {
    /** Points at which irradiance is measured. */
    points: {
      /** World space, metres. */
      position: [number, number, number];
      /** Direction that it faces; any length except 0. */
      normal: [number, number, number];
    }[];
    /**
     * Points at the centres of the cells of a rectangle, row by row; they follow the single points.
     */
    plane: {
      /** Corner of the rectangle, world space, metres. */
      origin: [number, number, number];
      /** Vector from the origin to the next corner; the plane faces along edge_u x edge_v. */
      edge_u: [number, number, number];
      /** Vector from the origin to the previous corner. */
      edge_v: [number, number, number];
      /** Cells along edge_u. */
      columns: number;
      /** Cells along edge_v. */
      rows: number;
    } | null;
  } | null;
  /** True: paths carry three wavelengths instead of three colours. */
  spectral: boolean;
  /** When to stop: the first rule met ends the job. If given, only the rules in it apply. */
  stop: {
    /**
     * Stop at this mean number of samples per pixel of the crop, over all replicates. Rounded up to
     * a count that the sampler supports.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to check.
     */
    denoised_error?: number | null;
    /** Confidence of relative_error, of denoised_error and of the interval in `error`. */
    confidence?: number;
    /** What has to meet the error target. */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** Denoised images, which are computed on request and never part of the film. */
  denoise?: {
    /** The denoiser. */
    type: string;
    /** If false, images are not denoised before the job has ended. */
    preview: boolean;
  };
  /** Webhook to notify. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. */
    events: string[];
  } | null;
  /** The job and its files are deleted this many seconds after its end; null: kept. */
  retention_seconds?: number | null;
}

/** A name that requests can use. */
export interface TypeInfo {
  /** Name in requests. */
  type: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
  /** JSON pointers of the members of a job request that it supports. */
  accepts: string[];
}

/** An algorithm that traces light paths. */
export interface IntegratorInfo {
  /** Name in requests. */
  type: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  /** Whether the halves of its images give the error. */
  error: 'valid' | 'from-chains' | 'none';
  summary: string;
  /** JSON pointers of the members of a job request that it supports. */
  accepts: string[];
  /** Merge patch (RFC 7396) of `defaults`, which holds for its jobs. */
  defaults: Record<string, unknown>;
}

/** An option of the estimator. */
export interface EstimationOption {
  name: string;
  /** How the expected value of the image relates to the true image. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
  /** Merge patch (RFC 7396) of a job request that enables it. */
  patch: Record<string, unknown>;
}

/** An experiment of the laboratory. */
export interface Experiment {
  name: string;
  title: string;
  summary: string;
  /** The quantity. */
  estimates: string;
  formula: string;
  /** What to look for. */
  look_for: string;
  estimators: ({
    name: string;
    /** How the expected value of the image relates to the true image. */
    bias: 'none' | 'consistent' | 'biased';
    summary: string;
  })[];
  /** Default. */
  estimator: string;
  /** That it takes. */
  samplers: string[];
  /** Default. */
  sampler: string;
  /** Default. */
  n: number[];
  /** What n counts. */
  unit: string;
  /** Default. */
  replicates: number;
  params: {
    name: string;
    min: number;
    max: number;
    default: number;
    integer: boolean;
    summary: string;
  }[];
  /** Exact value with the default parameters. */
  expected: number;
  /** Coordinates of the points shown; 0: none. */
  pattern_dimensions: number;
}

/** Server capabilities. */
export interface Server {
  version: string;
  /** What determines the bits of a film in addition to the job. */
  build: {
    id: string;
    commit: string;
    compiler: string;
    /** Instruction set used to trace rays. */
    isa: string;
    embree: string;
    /** Jobs with default options trace eight paths at a time. */
    waves: boolean;
  };
  /** All limits by name. */
  limits: Record<string, number>;
  defaults: JobDefaults;
  integrators: IntegratorInfo[];
  samplers: TypeInfo[];
  light_samplers: TypeInfo[];
  adaptive: TypeInfo[];
  /** All other options of the estimator. */
  options: EstimationOption[];
  /** Layers of a job that does not name any. */
  layers: string[];
  /** Layers that have to be requested in `film.layers`. */
  optional_layers: string[];
  /** Layers with a number or name in their name. */
  layer_patterns: string[];
  /** Extensions. */
  image_formats: string[];
  tone_maps: string[];
  filters: string[];
  /** Built-in scenes. */
  scenes: {
    name: string;
    summary: string;
  }[];
  /** Of the laboratory. */
  experiments: Experiment[];
  /** Of glTF. */
  extensions: string[];
}

/** Whether the server accepts new jobs, and its remaining jobs. */
export interface Drain {
  /** New jobs are refused with 503, and queued jobs do not start. */
  draining: boolean;
  /** Active jobs; they continue. */
  running: number;
  /** Waiting jobs. */
  queued: number;
}

/** Measurements at one n. */
export interface LabPoint {
  /** In force. */
  n: number;
  /** As in the request. */
  n_asked: number;
  /** Of the replicates. */
  mean: number;
  /** Of the replicates against the exact value. */
  rmse: number;
  /** Of the mean. */
  standard_error: number;
  /** Mean work of a replicate; n unless the experiment counts it otherwise. */
  cost: number;
  /**
   * CPU time of all replicates. It is measured and differs from run to run; all other members are
   * reproducible.
   */
  seconds: number;
}

/** The outcome, the last line of the response. */
export interface LabOutcome {
  /** Exact value, from a formula. */
  expected: number;
  /**
   * Slope of log RMSE against log n by least squares; null with fewer than two n, or without an
   * error.
   */
  slope: number | null;
  /** 95%, low and high; null without a slope. */
  slope_interval: [number, number] | null;
  /** Theoretical slope; null if there is none. */
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
   * agrees: means and slope agree with theory (`differs` is wrong with a probability of 0.2%);
   * biased: as expected from the estimator; undecided: nothing to compare, fewer than eight
   * replicates, or the interval of the slope is too wide.
   */
  verdict: 'agrees' | 'differs' | 'biased' | 'undecided';
  /** The verdict in words. */
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

/** Last line instead of the outcome: the server is stopping. */
export interface LabCancelled {
  cancelled: boolean;
}

/** A key to create. */
export interface KeyRequest {
  /** Display name. */
  name: string;
  /**
   * Tenant of the key: letters, digits, `.`, `_`, `-`; null: one of its own. To replace a key, use
   * the tenant of the old one.
   */
  tenant?: string | null;
  /**
   * Permissions; `admin` requires `read` and `write`; `worker` is for `tessera worker` only.
   * Default: ["read","write"].
   */
  scopes?: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests per minute; 0: no limit; null: the server's default. */
  rate_limit?: number | null;
  /** Maximum priority of its jobs. Default: 0. */
  max_priority?: number;
  /** Days until it expires; null: never. */
  days?: number | null;
}

/** A key, without its text. */
export interface Key {
  /** Id of the key in lists and logs. */
  id: string;
  /** Display name. */
  name: string;
  /** Tenant whose work it sees and creates. */
  tenant: string;
  /** Permissions. */
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
export interface NewKey {
  /** Id of the key in lists and logs. */
  id: string;
  /** Display name. */
  name: string;
  /** Tenant whose work it sees and creates. */
  tenant: string;
  /** Permissions. */
  scopes: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests per minute; 0: no limit; null: the server's default. */
  rate_limit: number | null;
  /** Maximum priority of its jobs. */
  max_priority: number;
  created_at: string;
  /** null: never. */
  expires_at: string | null;
  /** The key itself. It is not shown again. */
  key: string;
}

/** All keys. */
export interface KeyList {
  /** Oldest first. */
  keys: Key[];
}

/** Resource usage of tenants: of all for the operator and admins, otherwise of one's own. */
export interface Usage {
  /** By name. */
  tenants: {
    /** Empty: the operator. */
    tenant: string;
    /** Stored jobs. */
    jobs: number;
    /** Number of these that have not ended. */
    unfinished_jobs: number;
    /** CPU seconds of all jobs except previews, including deleted jobs. */
    cpu_seconds: number;
    /** Number of deleted jobs. */
    deleted_jobs: number;
    /** Bytes of assets and scenes. */
    asset_bytes: number;
    /** Bytes of films, including space reserved for those being rendered. */
    film_bytes: number;
    /** Open event and tile streams. */
    streams: number;
  }[];
  /** Quotas per tenant; 0: no limit. */
  quotas: {
    /** Unfinished jobs. */
    jobs: number;
    /** Simultaneous previews. */
    previews: number;
    /** Open streams. */
    streams: number;
    /** Simultaneous experiments. */
    lab_runs: number;
    /** Assets and films. */
    stored_bytes: number;
  };
}

/** A webhook call. */
export interface Delivery {
  /** The webhook-id that the receiver gets on every attempt. */
  id: string;
  /** Job or batch that it is about; null: a test. */
  job: string | null;
  /** Kind of event: `state`, `end` or `test`. */
  event: string;
  url: string;
  /** `failed`: all attempts failed. */
  state: 'pending' | 'delivered' | 'failed';
  /** Number of attempts. */
  attempts: number;
  created_at: string;
  /** While it is pending. */
  next_attempt_at: string | null;
  ended_at: string | null;
  /** Status of the last response; null: there was none. */
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

/** Target of the call. */
export interface WebhookTestRequest {
  /** Where to send a call of type `test`. */
  url: string;
}

/** Secret with which calls are signed. */
export interface WebhookSecret {
  /** `whsec_` and base64. */
  secret: string;
}

/** Report of a worker. */
export interface WorkerReport {
  /** Id of its build. */
  build: string;
  /** Its arithmetic class. */
  arithmetic: string;
  /** Number of units that it renders at a time. Default: 1. */
  threads?: number;
  /** Whether it accepts no more units. Default: false. */
  draining?: boolean;
  /** Units that it holds. */
  units?: Record<string, number>;
}

/** A worker takes or returns a unit. */
export interface UnitRequest {
  /** Id of the worker. */
  worker: string;
  /** Why a returned unit was not rendered; empty: not because of an error. Default: "". */
  fault?: string;
}

/** Instructions for a worker. */
export interface WorkerOrders {
  /** Whether it gets units. */
  suitable: boolean;
  /** Why it gets none. */
  reason: string | null;
  /** Until its next report. */
  report_seconds: number;
  /** Units whose results are no longer needed. */
  dropped: string[];
}

/** Inputs of the units of a job. */
export interface WorkInputs {
  /** The job's `spec`. */
  spec: Record<string, unknown>;
  /** Asset ids by uri; "" is the glTF document. Empty: the scene is built in. */
  files: Record<string, string>;
}

/** A process that renders units of this server's jobs. */
export interface Worker {
  /** Id of the worker process; new after each start. */
  id: string;
  /** Its build. */
  build: string;
  /** Its arithmetic class. */
  arithmetic: string;
  /** Number of units that it renders at a time. */
  threads: number;
  /** Pixel samples per second while rendering. */
  rate: number;
  /** Units that it holds. */
  leases: number;
  /** Number of its results that were accepted. */
  units: number;
  /** Number of units that it lost or failed, or for which it returned wrong results. */
  faults: number;
  state: 'idle' | 'working' | 'draining' | 'unsuitable' | 'left' | 'lost';
  /** Why it is unsuitable. */
  reason: string | null;
  /** Time of its last report. */
  seen_at: string;
}

/** A tile that a worker is rendering. Pixels are counted from the top left of the full film. */
export interface WorkerTile {
  /** Its id. */
  worker: string;
  x: number;
  y: number;
  width: number;
  height: number;
}

/** All recently seen workers. */
export interface WorkerList {
  workers: Worker[];
}

/** Tiles of a job that workers are rendering. */
export interface WorkerTiles {
  tiles: WorkerTile[];
}

/** A template and a matrix of values from which jobs are created. */
export interface BatchRequest {
  /** A JobRequest; members that the matrix sets may be missing. Class normal only. */
  template: Record<string, unknown>;
  /**
   * Paths of members of the job request, each with its values: {"variant": ["a", "b"]}. Every
   * combination becomes a job; the last member varies fastest. Values that are objects are merged
   * into the member. At most `batch_jobs` jobs.
   */
  matrix: Record<string, unknown[]>;
  /**
   * Pattern of the jobs' names. {variant} is replaced by the value of that member, given by its
   * path or the last part of it; {index} counts from 1. Empty: all values from the matrix. Default:
   * "".
   */
  name?: string;
  /** One call when all jobs have ended; `events` has no effect. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. Default: ["end"]. */
    events?: ('state' | 'warning' | 'end')[];
  } | null;
}

/** A job of a batch. */
export interface BatchJob {
  /** Of the job. */
  id: string;
  name: string;
  /** Of the job. */
  state: string;
  fraction: number;
  /** Its values from the matrix. */
  values: Record<string, unknown>;
}

/** Jobs that were created together. */
export interface Batch {
  id: string;
  /** The pattern of the jobs' names. */
  name: string;
  /** Once all jobs have ended: failed if one failed, otherwise cancelled if one was cancelled. */
  state: 'queued' | 'rendering' | 'paused' | 'failed' | 'cancelled' | 'finished';
  created_at: string;
  /** Of all jobs together. */
  progress: {
    /** Mean over the jobs; 1 where one has ended. */
    fraction: number;
    cpu_seconds: number;
  };
  /** Jobs in each state. */
  counts: {
    queued: number;
    loading: number;
    rendering: number;
    paused: number;
    failed: number;
    cancelled: number;
    finished: number;
  };
  /** URLs of related resources. */
  links: Record<string, string>;
  /** In the order of the matrix. */
  jobs: BatchJob[];
}

/** A batch without its jobs. */
export interface BatchSummary {
  id: string;
  /** The pattern of the jobs' names. */
  name: string;
  /** Once all jobs have ended: failed if one failed, otherwise cancelled if one was cancelled. */
  state: 'queued' | 'rendering' | 'paused' | 'failed' | 'cancelled' | 'finished';
  created_at: string;
  /** Of all jobs together. */
  progress: {
    /** Mean over the jobs; 1 where one has ended. */
    fraction: number;
    cpu_seconds: number;
  };
  /** Jobs in each state. */
  counts: {
    queued: number;
    loading: number;
    rendering: number;
    paused: number;
    failed: number;
    cancelled: number;
    finished: number;
  };
  /** URLs of related resources. */
  links: Record<string, string>;
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
  /** Of the jobs, in their order. */
  names: string[];
}

/** Two images; b is the reference. */
export interface ComparisonRequest {
  /** Job id (UUID) or asset id (64 hex digits). */
  a: string;
  /** Job id (UUID) or asset id (64 hex digits). */
  b: string;
  /**
   * Which image of a job. The errors of single pixels of a denoised image are unknown, so bias.low,
   * bias.high and z are null. Default: "off".
   */
  a_denoise?: 'off' | 'mixed' | 'full';
  /** The same of b. Default: "off". */
  b_denoise?: 'off' | 'mixed' | 'full';
}
