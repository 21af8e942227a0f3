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
  /** Null members keep the value of the file's camera, chosen by name or index, else the first. */
  camera?: {
    /** Camera of the file by name. */
    name?: string | null;
    /** Camera of the file by index; not together with name. */
    index?: number | null;
    /**
     * Camera position in world space, metres. Comes with target; together they replace the file's
     * pose.
     */
    position?: [number, number, number] | null;
    /** Point that the camera looks at, metres, world. */
    target?: [number, number, number] | null;
    /** Upward direction; [0, 1, 0] if position and target are given without it. */
    up?: [number, number, number] | null;
    /** Place on a sphere around the target, instead of position and target. */
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
   * How long the shutter is open, seconds, from time_seconds on: what animations move then, the
   * file's camera too, is blurred. 0: nothing is. Default: 0.
   */
  shutter_seconds?: number;
  /**
   * From time_seconds to the second time of the layer motion, whose file camera counts too; below
   * 0: before. In the rest pose nothing moves. Default: 0.041666666666666664.
   */
  motion_seconds?: number;
  /** Medium around the solids, within the sphere around the scene: fog, smoke, haze. null: none. */
  medium?: {
    /** Kind of medium. Default: "homogeneous". */
    type?: string;
    /** Coefficient in 1/m, linear RGB. Default: [0,0,0]. */
    scattering?: [number, number, number];
    /** Coefficient in 1/m, linear RGB. Default: [0,0,0]. */
    absorption?: [number, number, number];
    /**
     * Mean cosine of the angle of scattering (Henyey and Greenstein): 0 is even, above 0 forward.
     * Default: 0.
     */
    g?: number;
    /** Density falls with exp(-height_falloff y); coefficients are those at y = 0. Default: 0. */
    height_falloff?: number;
  } | null;
  /** How it is served. Default: "normal". */
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
    /** Studio light made in code, as strong as a white environment; instead of an asset. */
    preset?: string;
    /**
     * Sun and clear sky of a place and time, in W/(m2 sr) of nominal white (683 lm/W): at noon some
     * 100 times as bright as 1. Sky: Preetham, Shirley and Smits 1999, turbidity 3. Position: NOAA.
     * The sun is a disc that is sampled. North is -z, east +x.
     */
    sun?: {
      /** Degrees; north is positive. */
      latitude: number;
      /** Degrees; east is positive. */
      longitude: number;
      /** RFC 3339, by day. */
      time: string;
    } | null;
    /** Linear Rec.709; multiplies the image. Default: [1,1,1]. */
    color?: [number, number, number];
    /** Multiplies colour and image. Default: 1. */
    intensity?: number;
    /** Positive turns it counter-clockwise seen from above. Default: 0. */
    rotation_degrees?: number;
    /**
     * If false, the environment lights the scene but the background is transparent: short for
     * background type 'transparent'. Default: true.
     */
    visible?: boolean;
  } | null;
  /** What the camera sees where it meets nothing; mirrors and glass show the environment. */
  background?: {
    /**
     * Kind of background. When it is not given: 'transparent' with ground 'catcher', else
     * 'environment'. Default: "environment".
     */
    type?: string;
    /** Linear Rec.709. Default: [1,1,1]. */
    color?: [number, number, number];
  };
  /** Level ground that is added to the scene. */
  ground?: {
    /** Kind of ground. Default: "none". */
    type?: string;
    /** Its y, metres; null: the model's lowest point. */
    height?: number | null;
    /**
     * Of its surface, linear Rec.709: also of a catcher, which lights the model from below.
     * Default: [0.8,0.8,0.8].
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
    /** Part of the film that is rendered; null: all of it. */
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
     * Particles that leave the lights for each sample of the pixels; 0: as many as the full film
     * has pixels, from 1024 to 262144. Default: 0.
     */
    photons?: number;
    /**
     * Radius within which photons are gathered, metres; sppm: at first. 0: three pixels where the
     * camera looks. Default: 0.
     */
    radius_m?: number;
    /**
     * After N samples of each replicate the disk of photons is about N^(alpha - 1) of the first,
     * and so is the bias; the variance falls as N^-alpha. 2/3 lets both fall alike. Default:
     * 0.6666667.
     */
    alpha?: number;
    /**
     * Directions in which each path looks up the map one reflection later; 0: the map itself is
     * shown, direct light included. Default: 1.
     */
    final_gather?: number;
    /**
     * Error of interpolation up to which a record of irradiance is used, as a share; half of it
     * takes about four times as many records. Default: 0.25.
     */
    tolerance?: number;
    /** Paths over the hemisphere of each record. Default: 256. */
    rays?: number;
    /**
     * Most records of each replicate. Where there are none, other light than direct light is path
     * traced. Default: 32768.
     */
    records?: number;
  };
  /** How paths are made and combined. */
  estimator?: {
    /** Where directions come from. Default: "mis". */
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
      /** What decides about survival. Default: "throughput". */
      type?: string;
      /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. Default: 0.02. */
      delta?: number;
    };
    /** Several continuations of a path at its first surface. */
    splitting?: {
      /** How many there are. Default: "measured". */
      type?: string;
      /** Continuations of each path. Default: 2. */
      count?: number;
    };
    /** What is subtracted from samples and added in closed form. */
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
  /** Where random numbers come from. */
  sampler?: {
    /** Kind of point set. Each has a rule for sample counts; see /v1/server. Default: "sobol". */
    type?: string;
    /** Independent randomisations of a pixel; even. Default: 2. */
    replicates?: number;
    /**
     * Number of the first replicate of the seed; even. Jobs that hold different ones can be merged
     * into the film of one job. Default: 0.
     */
    first_replicate?: number;
  };
  /** How a light is selected. */
  light_sampler?: {
    /** Kind of choice. Default: "tree". */
    type?: string;
    /** Light samples of which one is taken. Default: 2. */
    candidates?: number;
    /** Side in pixels of the squares whose pixels share light samples. Default: 3. */
    block?: number;
    /**
     * Passes that share light samples too: samples of a replicate, one after another. At most 64
     * paths share, block x block x history. Default: 1.
     */
    history?: number;
    /** Light samples of each path, of which one is shared. Default: 1. */
    candidates_per_pixel?: number;
  };
  /** Adaptive sampling. */
  adaptive?: {
    /**
     * What decides. When it is not given: 'pilot' for jobs with stop.relative_error, 'none' for
     * others. Default: "none".
     */
    type?: string;
    /**
     * Samples of every pixel before the first decision, all replicates together; rounded up to
     * where decisions are taken: 20, or 1, 1.25, 1.5 and 1.75 times 2^k of each replicate. Default:
     * 32.
     */
    min_samples?: number;
    /** What gets the same number of samples. Default: "pixel". */
    granularity?: string;
    /**
     * Radius in pixels, in tiles for granularity 'tile': the neediest neighbour counts. Default: 1.
     */
    dilation?: number;
  };
  /**
   * Where irradiance is measured beside the image, by path tracing with 16 paths for each sample of
   * a pixel; GET /v1/jobs/{id}/meter.
   */
  meter?: {
    /** Where it is measured. Default: []. */
    points?: {
      /** World, metres. */
      position: [number, number, number];
      /** Where it faces, of any length but 0. */
      normal: [number, number, number];
    }[];
    /** The centres of a rectangle's cells, after the points, row by row. */
    plane?: {
      /** Corner of the rectangle, world, metres. */
      origin: [number, number, number];
      /** From there to the next corner; the plane faces along edge_u x edge_v. */
      edge_u: [number, number, number];
      /** From there to the corner before. */
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
     * Stop at this mean number of samples over the pixels of the crop, all replicates together.
     * Rounded up to what the sampler can do. Default: 256.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to see.
     */
    denoised_error?: number | null;
    /**
     * Confidence of relative_error, of denoised_error and of the interval in `error`. Default:
     * 0.95.
     */
    confidence?: number;
    /** Whose error has to be small enough. Default: "image". */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** Denoised images, which are made on demand and are no part of the film. */
  denoise?: {
    /** What makes them. Default: "auto". */
    type?: string;
    /** If false, there are none before the job has ended. Default: true. */
    preview?: boolean;
  };
  /** Webhook to notify. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. Default: ["end"]. */
    events?: string[];
  } | null;
  /** The job and its files are deleted so long after its end; null: kept. */
  retention_seconds?: number | null;
}

/** A merge patch (RFC 7396) of the members that may change. */
export interface JobPatch {
  /** Higher is served first. */
  priority?: number;
  /** Labels to set; null removes one, the others stay. */
  labels?: Record<string, string | null>;
  /** Display name. */
  name?: string;
  /** Rules to raise or lower; null removes one, the others stay. */
  stop?: {
    /**
     * Stop at this mean number of samples over the pixels of the crop, all replicates together.
     * Rounded up to what the sampler can do. Default: 256.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to see.
     */
    denoised_error?: number | null;
    /**
     * Confidence of relative_error, of denoised_error and of the interval in `error`. Default:
     * 0.95.
     */
    confidence?: number;
    /** Whose error has to be small enough. Default: "image". */
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

/** A scene whose files are assets. */
export interface SceneFromAssets {
  /** Asset with the glTF or GLB file. */
  gltf: string;
  /** Asset id of each uri that the glTF names. Default: {}. */
  files?: Record<string, string>;
}

/** What to go on to. */
export interface ExtendRequest {
  /** The new rules; they replace the old ones. */
  stop: {
    /**
     * Stop at this mean number of samples over the pixels of the crop, all replicates together.
     * Rounded up to what the sampler can do.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to see.
     */
    denoised_error?: number | null;
    /**
     * Confidence of relative_error, of denoised_error and of the interval in `error`. Default:
     * 0.95.
     */
    confidence?: number;
    /** Whose error has to be small enough. Default: "image". */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
}

/** Films to add up. */
export interface MergeRequest {
  /** Compatible films without common samples. */
  films: string[];
}

/** What a ticket is for. */
export interface TicketRequest {
  /** Jobs that the ticket lets its bearer watch. */
  jobs: string[];
}

/** An experiment to run; whole runs are limited to `lab_evaluations`. */
export interface LabRequest {
  /** What is tried; see `experiments` of GET /v1/server. */
  experiment: string;
  /** One of the experiment's; its own default when absent. */
  estimator?: string;
  /** Sampler to use, if the experiment supports it; its own default when absent. */
  sampler?: string;
  /**
   * How many evaluations a replicate has, one line of the answer each; rounded as estimator and
   * sampler need it.
   */
  n?: number[];
  /** Independent repetitions, which the errors are measured from. Default: 64. */
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
  /** What was seen and what is allowed. */
  detail: string;
}

/** RFC 9457. */
export interface Problem {
  /** Kind of problem, a URI reference. */
  type: string;
  /** The same for every problem of the type. */
  title: string;
  /** HTTP status. */
  status: number;
  /** About this one. */
  detail: string;
  /** Path of the request. */
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

/** The job request with every member in force. */
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
  /** Null members keep the value of the file's camera, chosen by name or index, else the first. */
  camera: {
    /** Camera of the file by name. */
    name: string | null;
    /** Camera of the file by index; not together with name. */
    index: number | null;
    /**
     * Camera position in world space, metres. Comes with target; together they replace the file's
     * pose.
     */
    position: [number, number, number] | null;
    /** Point that the camera looks at, metres, world. */
    target: [number, number, number] | null;
    /** Upward direction; [0, 1, 0] if position and target are given without it. */
    up: [number, number, number] | null;
    /** Place on a sphere around the target, instead of position and target. */
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
   * How long the shutter is open, seconds, from time_seconds on: what animations move then, the
   * file's camera too, is blurred. 0: nothing is.
   */
  shutter_seconds?: number;
  /**
   * From time_seconds to the second time of the layer motion, whose file camera counts too; below
   * 0: before. In the rest pose nothing moves.
   */
  motion_seconds?: number;
  /** Medium around the solids, within the sphere around the scene: fog, smoke, haze. null: none. */
  medium: {
    /** Kind of medium. */
    type: string;
    /** Coefficient in 1/m, linear RGB. */
    scattering: [number, number, number];
    /** Coefficient in 1/m, linear RGB. */
    absorption: [number, number, number];
    /**
     * Mean cosine of the angle of scattering (Henyey and Greenstein): 0 is even, above 0 forward.
     */
    g: number;
    /** Density falls with exp(-height_falloff y); coefficients are those at y = 0. */
    height_falloff: number;
  } | null;
  /** How it is served. */
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
    /** Studio light made in code, as strong as a white environment; instead of an asset. */
    preset?: string;
    /**
     * Sun and clear sky of a place and time, in W/(m2 sr) of nominal white (683 lm/W): at noon some
     * 100 times as bright as 1. Sky: Preetham, Shirley and Smits 1999, turbidity 3. Position: NOAA.
     * The sun is a disc that is sampled. North is -z, east +x.
     */
    sun?: {
      /** Degrees; north is positive. */
      latitude: number;
      /** Degrees; east is positive. */
      longitude: number;
      /** RFC 3339, by day. */
      time: string;
    } | null;
    /** Linear Rec.709; multiplies the image. */
    color: [number, number, number];
    /** Multiplies colour and image. */
    intensity: number;
    /** Positive turns it counter-clockwise seen from above. */
    rotation_degrees: number;
    /**
     * If false, the environment lights the scene but the background is transparent: short for
     * background type 'transparent'.
     */
    visible: boolean;
  } | null;
  /** What the camera sees where it meets nothing; mirrors and glass show the environment. */
  background?: {
    /**
     * Kind of background. When it is not given: 'transparent' with ground 'catcher', else
     * 'environment'.
     */
    type: string;
    /** Linear Rec.709. */
    color?: [number, number, number];
  };
  /** Level ground that is added to the scene. */
  ground?: {
    /** Kind of ground. */
    type: string;
    /** Its y, metres; null: the model's lowest point. */
    height?: number | null;
    /** Of its surface, linear Rec.709: also of a catcher, which lights the model from below. */
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
    /** Part of the film that is rendered; null: all of it. */
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
     * Particles that leave the lights for each sample of the pixels; 0: as many as the full film
     * has pixels, from 1024 to 262144.
     */
    photons?: number;
    /**
     * Radius within which photons are gathered, metres; sppm: at first. 0: three pixels where the
     * camera looks.
     */
    radius_m?: number;
    /**
     * After N samples of each replicate the disk of photons is about N^(alpha - 1) of the first,
     * and so is the bias; the variance falls as N^-alpha. 2/3 lets both fall alike.
     */
    alpha?: number;
    /**
     * Directions in which each path looks up the map one reflection later; 0: the map itself is
     * shown, direct light included.
     */
    final_gather?: number;
    /**
     * Error of interpolation up to which a record of irradiance is used, as a share; half of it
     * takes about four times as many records.
     */
    tolerance?: number;
    /** Paths over the hemisphere of each record. */
    rays?: number;
    /**
     * Most records of each replicate. Where there are none, other light than direct light is path
     * traced.
     */
    records?: number;
  };
  /** How paths are made and combined. */
  estimator: {
    /** Where directions come from. */
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
      /** What decides about survival. */
      type: string;
      /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. */
      delta?: number;
    };
    /** Several continuations of a path at its first surface. */
    splitting: {
      /** How many there are. */
      type: string;
      /** Continuations of each path. */
      count?: number;
    };
    /** What is subtracted from samples and added in closed form. */
    control_variate: {
      /** Kind of control variate. */
      type: string;
    };
    /** True: absorption and transparency are factors; false: they end paths at random. */
    expected_values: boolean;
  };
  /** Where random numbers come from. */
  sampler: {
    /** Kind of point set. Each has a rule for sample counts; see /v1/server. */
    type: string;
    /** Independent randomisations of a pixel; even. */
    replicates: number;
    /**
     * Number of the first replicate of the seed; even. Jobs that hold different ones can be merged
     * into the film of one job.
     */
    first_replicate?: number;
  };
  /** How a light is selected. */
  light_sampler: {
    /** Kind of choice. */
    type: string;
    /** Light samples of which one is taken. */
    candidates?: number;
    /** Side in pixels of the squares whose pixels share light samples. */
    block?: number;
    /**
     * Passes that share light samples too: samples of a replicate, one after another. At most 64
     * paths share, block x block x history.
     */
    history?: number;
    /** Light samples of each path, of which one is shared. */
    candidates_per_pixel?: number;
  };
  /** Adaptive sampling. */
  adaptive: {
    /**
     * What decides. When it is not given: 'pilot' for jobs with stop.relative_error, 'none' for
     * others.
     */
    type: string;
    /**
     * Samples of every pixel before the first decision, all replicates together; rounded up to
     * where decisions are taken: 20, or 1, 1.25, 1.5 and 1.75 times 2^k of each replicate.
     */
    min_samples?: number;
    /** What gets the same number of samples. */
    granularity?: string;
    /** Radius in pixels, in tiles for granularity 'tile': the neediest neighbour counts. */
    dilation?: number;
  };
  /**
   * Where irradiance is measured beside the image, by path tracing with 16 paths for each sample of
   * a pixel; GET /v1/jobs/{id}/meter.
   */
  meter?: {
    /** Where it is measured. */
    points: {
      /** World, metres. */
      position: [number, number, number];
      /** Where it faces, of any length but 0. */
      normal: [number, number, number];
    }[];
    /** The centres of a rectangle's cells, after the points, row by row. */
    plane: {
      /** Corner of the rectangle, world, metres. */
      origin: [number, number, number];
      /** From there to the next corner; the plane faces along edge_u x edge_v. */
      edge_u: [number, number, number];
      /** From there to the corner before. */
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
     * Stop at this mean number of samples over the pixels of the crop, all replicates together.
     * Rounded up to what the sampler can do.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to see.
     */
    denoised_error?: number | null;
    /** Confidence of relative_error, of denoised_error and of the interval in `error`. */
    confidence?: number;
    /** Whose error has to be small enough. */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** Denoised images, which are made on demand and are no part of the film. */
  denoise?: {
    /** What makes them. */
    type: string;
    /** If false, there are none before the job has ended. */
    preview: boolean;
  };
  /** Webhook to notify. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. */
    events: string[];
  } | null;
  /** The job and its files are deleted so long after its end; null: kept. */
  retention_seconds?: number | null;
}

/** How far it is. */
export interface Progress {
  /** 0 to 1; 1 only at the end. */
  fraction: number;
  /** Samples a pixel has, over the pixels of the crop. */
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
  /** Lower and upper bound of eta_seconds, as long as the pace stays the same; null: unknown. */
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
  /** How the expected image relates to the truth. */
  bias: 'none' | 'consistent' | 'biased';
  /** False: the two halves depend on each other, and there is no interval. */
  valid: boolean;
  /** Few places of the image carry the error: the interval is a guess. */
  unreliable: boolean;
}

/** What it cost. */
export interface Statistics {
  rays: number;
  rays_per_second: number | null;
  /** 1 / (relative error^2 * CPU seconds). */
  efficiency: number | null;
  /** From the interval of `error`. */
  efficiency_low: number | null;
  /** Null also if `error.low` is 0. */
  efficiency_high: number | null;
  /** Non-finite ones, counted as zero. */
  rejected_samples: number;
  /** Memory; null: unknown. */
  peak_bytes: number | null;
  /**
   * Continuations of each path that splitting 'measured' found; null: not yet known, or another
   * type.
   */
  split_count: number | null;
}

/** The newest denoised image that was made; the mixed one's error. */
export interface Denoised {
  /** The denoiser. */
  type: string;
  version: string;
  /** Of the file with its weights; null: it has none. */
  sha256: string | null;
  /** null: it has none to choose. */
  quality: string | null;
  /** Why `auto` did not take the better denoiser. */
  note: string | null;
  /** Albedo, normal, depth and emission were used; false: the scene is gone. */
  features: boolean;
  /**
   * As in `error`, N being an estimate of the squared error, bias included; 0 where it is too small
   * to be seen.
   */
  relative_rmse: number | null;
  /**
   * Of its 95% interval; null: not valid; 0 where an error ended the job: `high` alone is promised
   * then.
   */
  low: number | null;
  high: number | null;
  /** Of the denoiser's own image. */
  full_relative_rmse: number | null;
  /**
   * (plain relative_rmse / this one)^2: samples that the plain image needs for the same error, over
   * those it has.
   */
  gain: number | null;
  /** Of the image it was made from. */
  revision: number;
  /** That it took. */
  seconds: number;
}

/** A job. */
export interface Job {
  /** UUID. */
  id: string;
  state: JobState;
  /**
   * Why it is paused; null: it is not. `storage_full`: it goes on by itself when the disk has room.
   */
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
  /** 0 is next; null: not waiting. */
  queue_position: number | null;
  statistics: Statistics;
  /** Counts the changes of the image. */
  revision: number;
  /** sha256 of the film's exact content, when finished. */
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

/** What a job would be, and what it would cost. */
export interface DryRun {
  spec: JobSpec;
  /** As a job's. */
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
    /** The film alone. */
    memory_bytes_low: number;
    /** What the job is admitted with: the most while it is loaded, or renders. */
    memory_bytes_high: number;
    /** What the pilot took. */
    pilot_cpu_seconds: number;
  };
}

/** A stream ticket. */
export interface Ticket {
  /** Goes into `?ticket=`. */
  ticket: string;
  expires_at: string;
  /** Ids of the jobs that it lets its bearer watch. */
  jobs: string[];
}

/** The state has changed. */
export interface StateEvent {
  state: JobState;
  /**
   * Why it is paused; null: it is not. `storage_full`: it goes on by itself when the disk has room.
   */
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
  /** 0 is next; null: not waiting. */
  queue_position: number | null;
  /** Counts the changes of `spec`. */
  spec_version: number;
}

/** The image has come on. */
export interface ProgressEvent {
  state: JobState;
  progress: Progress;
  error: ErrorEstimate;
  statistics: Statistics;
  /** Counts the changes of the image. */
  revision: number;
  denoised: Denoised | null;
}

/** A tile has changed; only the newest of each tile is kept. */
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
  /** sha256 of the film's exact content, when finished. */
  film_digest: string | null;
  /** Counts the changes of the image. */
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
  /** Where it looks, unit vector. */
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
  /** What a job's `scene` names. */
  id: string;
  name: string;
  /** Memory of geometry, acceleration structure and textures. */
  bytes: number;
  /** Axis-aligned box, metres; null: empty. */
  bounds: {
    min: [number, number, number];
    max: [number, number, number];
  } | null;
  /** As placed: a mesh used twice counts twice. */
  triangles: number;
  instances: number;
  cameras: SceneCamera[];
  /** Punctual lights. */
  lights: SceneLight[];
  /** Names for layers light:NAME. */
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
  /** One for each error check. */
  points: ConvergencePoint[];
  /** Of log error against log samples, least squares, 95% interval. */
  slope: {
    value: number | null;
    low: number | null;
    high: number | null;
  };
}

/** One layer at one pixel, a number for each channel. */
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

/** Light that falls on one side of a point. One lux of a light of the scene is one lux here. */
export interface MeterReading {
  /** World, metres. */
  position: [number, number, number];
  /** Where it faces, unit. */
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

/** What a job's meter has measured so far. */
export interface Meter {
  /** How the expected image relates to the truth. */
  bias: 'none' | 'consistent' | 'biased';
  /** The points, then the plane's cells. */
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
  /** Mean of a - b; its interval is null where a side does not know its error. */
  bias: {
    value: number | null;
    low: number | null;
    high: number | null;
  };
  /** Of (a-b) / standard error. */
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
  /** Of the node or its mesh, made unlike all others; Cryptomatte's. */
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
  /** Pixels of the full film whose centre shows it; null: none, or the job did not record ids. */
  visible: {
    x: number;
    y: number;
    width: number;
    height: number;
    /** That show it. */
    pixels: number;
  } | null;
  /** Of all of it that lies within the film, hidden or not, in pixels; null: nothing. */
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
  /** Pixels of the full film whose centre shows it; null: none, or the job did not record ids. */
  visible: {
    x: number;
    y: number;
    width: number;
    height: number;
    /** That show it. */
    pixels: number;
  } | null;
  /** Of all of it that lies within the film, hidden or not, in pixels; null: nothing. */
  amodal: {
    x: number;
    y: number;
    width: number;
    height: number;
  } | null;
}

/** What an id of the layers material and primitive stands for. */
export interface Label {
  id: number;
  /** Null: glTF's default material. */
  pointer: string | null;
  name: string;
}

/**
 * What the ids of an image's layers are. They follow from the file alone: all views, variants and
 * times of a scene have the same ones.
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

/** What is in force where a job request does not say otherwise. */
export interface JobDefaults {
  /** Display name. */
  name: string;
  /** Free key-value pairs to find jobs by. */
  labels: Record<string, string>;
  /** Higher is served first. */
  priority: number;
  /** Seed for all random numbers in the job. */
  seed: number;
  /** Null members keep the value of the file's camera, chosen by name or index, else the first. */
  camera: {
    /** Camera of the file by name. */
    name: string | null;
    /** Camera of the file by index; not together with name. */
    index: number | null;
    /**
     * Camera position in world space, metres. Comes with target; together they replace the file's
     * pose.
     */
    position: [number, number, number] | null;
    /** Point that the camera looks at, metres, world. */
    target: [number, number, number] | null;
    /** Upward direction; [0, 1, 0] if position and target are given without it. */
    up: [number, number, number] | null;
    /** Place on a sphere around the target, instead of position and target. */
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
   * How long the shutter is open, seconds, from time_seconds on: what animations move then, the
   * file's camera too, is blurred. 0: nothing is.
   */
  shutter_seconds?: number;
  /**
   * From time_seconds to the second time of the layer motion, whose file camera counts too; below
   * 0: before. In the rest pose nothing moves.
   */
  motion_seconds?: number;
  /** Medium around the solids, within the sphere around the scene: fog, smoke, haze. null: none. */
  medium: {
    /** Kind of medium. */
    type: string;
    /** Coefficient in 1/m, linear RGB. */
    scattering: [number, number, number];
    /** Coefficient in 1/m, linear RGB. */
    absorption: [number, number, number];
    /**
     * Mean cosine of the angle of scattering (Henyey and Greenstein): 0 is even, above 0 forward.
     */
    g: number;
    /** Density falls with exp(-height_falloff y); coefficients are those at y = 0. */
    height_falloff: number;
  } | null;
  /** How it is served. */
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
    /** Studio light made in code, as strong as a white environment; instead of an asset. */
    preset?: string;
    /**
     * Sun and clear sky of a place and time, in W/(m2 sr) of nominal white (683 lm/W): at noon some
     * 100 times as bright as 1. Sky: Preetham, Shirley and Smits 1999, turbidity 3. Position: NOAA.
     * The sun is a disc that is sampled. North is -z, east +x.
     */
    sun?: {
      /** Degrees; north is positive. */
      latitude: number;
      /** Degrees; east is positive. */
      longitude: number;
      /** RFC 3339, by day. */
      time: string;
    } | null;
    /** Linear Rec.709; multiplies the image. */
    color: [number, number, number];
    /** Multiplies colour and image. */
    intensity: number;
    /** Positive turns it counter-clockwise seen from above. */
    rotation_degrees: number;
    /**
     * If false, the environment lights the scene but the background is transparent: short for
     * background type 'transparent'.
     */
    visible: boolean;
  } | null;
  /** What the camera sees where it meets nothing; mirrors and glass show the environment. */
  background?: {
    /**
     * Kind of background. When it is not given: 'transparent' with ground 'catcher', else
     * 'environment'.
     */
    type: string;
    /** Linear Rec.709. */
    color?: [number, number, number];
  };
  /** Level ground that is added to the scene. */
  ground?: {
    /** Kind of ground. */
    type: string;
    /** Its y, metres; null: the model's lowest point. */
    height?: number | null;
    /** Of its surface, linear Rec.709: also of a catcher, which lights the model from below. */
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
    /** Part of the film that is rendered; null: all of it. */
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
     * Particles that leave the lights for each sample of the pixels; 0: as many as the full film
     * has pixels, from 1024 to 262144.
     */
    photons?: number;
    /**
     * Radius within which photons are gathered, metres; sppm: at first. 0: three pixels where the
     * camera looks.
     */
    radius_m?: number;
    /**
     * After N samples of each replicate the disk of photons is about N^(alpha - 1) of the first,
     * and so is the bias; the variance falls as N^-alpha. 2/3 lets both fall alike.
     */
    alpha?: number;
    /**
     * Directions in which each path looks up the map one reflection later; 0: the map itself is
     * shown, direct light included.
     */
    final_gather?: number;
    /**
     * Error of interpolation up to which a record of irradiance is used, as a share; half of it
     * takes about four times as many records.
     */
    tolerance?: number;
    /** Paths over the hemisphere of each record. */
    rays?: number;
    /**
     * Most records of each replicate. Where there are none, other light than direct light is path
     * traced.
     */
    records?: number;
  };
  /** How paths are made and combined. */
  estimator: {
    /** Where directions come from. */
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
      /** What decides about survival. */
      type: string;
      /** Radiance [W/(m^2 sr)]; 0 traces every shadow ray. */
      delta?: number;
    };
    /** Several continuations of a path at its first surface. */
    splitting: {
      /** How many there are. */
      type: string;
      /** Continuations of each path. */
      count?: number;
    };
    /** What is subtracted from samples and added in closed form. */
    control_variate: {
      /** Kind of control variate. */
      type: string;
    };
    /** True: absorption and transparency are factors; false: they end paths at random. */
    expected_values: boolean;
  };
  /** Where random numbers come from. */
  sampler: {
    /** Kind of point set. Each has a rule for sample counts; see /v1/server. */
    type: string;
    /** Independent randomisations of a pixel; even. */
    replicates: number;
    /**
     * Number of the first replicate of the seed; even. Jobs that hold different ones can be merged
     * into the film of one job.
     */
    first_replicate?: number;
  };
  /** How a light is selected. */
  light_sampler: {
    /** Kind of choice. */
    type: string;
    /** Light samples of which one is taken. */
    candidates?: number;
    /** Side in pixels of the squares whose pixels share light samples. */
    block?: number;
    /**
     * Passes that share light samples too: samples of a replicate, one after another. At most 64
     * paths share, block x block x history.
     */
    history?: number;
    /** Light samples of each path, of which one is shared. */
    candidates_per_pixel?: number;
  };
  /** Adaptive sampling. */
  adaptive: {
    /**
     * What decides. When it is not given: 'pilot' for jobs with stop.relative_error, 'none' for
     * others.
     */
    type: string;
    /**
     * Samples of every pixel before the first decision, all replicates together; rounded up to
     * where decisions are taken: 20, or 1, 1.25, 1.5 and 1.75 times 2^k of each replicate.
     */
    min_samples?: number;
    /** What gets the same number of samples. */
    granularity?: string;
    /** Radius in pixels, in tiles for granularity 'tile': the neediest neighbour counts. */
    dilation?: number;
  };
  /**
   * Where irradiance is measured beside the image, by path tracing with 16 paths for each sample of
   * a pixel; GET /v1/jobs/{id}/meter.
   */
  meter?: {
    /** Where it is measured. */
    points: {
      /** World, metres. */
      position: [number, number, number];
      /** Where it faces, of any length but 0. */
      normal: [number, number, number];
    }[];
    /** The centres of a rectangle's cells, after the points, row by row. */
    plane: {
      /** Corner of the rectangle, world, metres. */
      origin: [number, number, number];
      /** From there to the next corner; the plane faces along edge_u x edge_v. */
      edge_u: [number, number, number];
      /** From there to the corner before. */
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
     * Stop at this mean number of samples over the pixels of the crop, all replicates together.
     * Rounded up to what the sampler can do.
     */
    samples_per_pixel?: number | null;
    /** Stop when the relative error is at most this, with `confidence`. */
    relative_error?: number | null;
    /**
     * Stop when the relative error of the denoised image (`mixed`) is at most this, with
     * `confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to see.
     */
    denoised_error?: number | null;
    /** Confidence of relative_error, of denoised_error and of the interval in `error`. */
    confidence?: number;
    /** Whose error has to be small enough. */
    scope?: string;
    /** Stop after this many seconds of rendering, without pauses and downtime. */
    seconds?: number | null;
    /** Stop after this many CPU seconds of rendering, summed over all threads. */
    cpu_seconds?: number | null;
    /** Stop at this time (RFC 3339). */
    deadline?: string | null;
  };
  /** Denoised images, which are made on demand and are no part of the film. */
  denoise?: {
    /** What makes them. */
    type: string;
    /** If false, there are none before the job has ended. */
    preview: boolean;
  };
  /** Webhook to notify. */
  webhook?: {
    /** http or https; receives a signed POST (Standard Webhooks) for each event. */
    url: string;
    /** Events to send. */
    events: string[];
  } | null;
  /** The job and its files are deleted so long after its end; null: kept. */
  retention_seconds?: number | null;
}

/** A name that requests may use. */
export interface TypeInfo {
  /** Name in requests. */
  type: string;
  /** How the expected image relates to the truth. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
  /** JSON pointers of the job request that it honours. */
  accepts: string[];
}

/** An algorithm that traces light paths. */
export interface IntegratorInfo {
  /** Name in requests. */
  type: string;
  /** How the expected image relates to the truth. */
  bias: 'none' | 'consistent' | 'biased';
  /** Do the halves of its images tell the error? */
  error: 'valid' | 'from-chains' | 'none';
  summary: string;
  /** JSON pointers of the job request that it honours. */
  accepts: string[];
  /** Merge patch (RFC 7396) of `defaults`, which holds for its jobs. */
  defaults: Record<string, unknown>;
}

/** A switch of the estimation. */
export interface EstimationOption {
  name: string;
  /** How the expected image relates to the truth. */
  bias: 'none' | 'consistent' | 'biased';
  summary: string;
  /** Merge patch (RFC 7396) of the job request that turns it on. */
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
  /** What there is to see. */
  look_for: string;
  estimators: ({
    name: string;
    /** How the expected image relates to the truth. */
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
  /** What the bits of a film depend on besides the job. */
  build: {
    id: string;
    commit: string;
    compiler: string;
    /** Instruction set that rays are traced with. */
    isa: string;
    embree: string;
    /** Paths of default options go eight side by side. */
    waves: boolean;
  };
  /** Every maximum by name. */
  limits: Record<string, number>;
  defaults: JobDefaults;
  integrators: IntegratorInfo[];
  samplers: TypeInfo[];
  light_samplers: TypeInfo[];
  adaptive: TypeInfo[];
  /** Every other switch of the estimation. */
  options: EstimationOption[];
  /** Of a job that does not say which to record. */
  layers: string[];
  /** Those that `film.layers` has to ask for. */
  optional_layers: string[];
  /** Layers of which there is one for each number or name. */
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

/** Whether the server takes new jobs, and what it still has. */
export interface Drain {
  /** New jobs are refused with 503, and those of the queue do not begin. */
  draining: boolean;
  /** Jobs that load, render or end; they go on. */
  running: number;
  /** Jobs that wait. */
  queued: number;
}

/** One n, measured. */
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
  /** Mean work of a replicate; n unless the experiment counts. */
  cost: number;
  /**
   * CPU time of all replicates. Measured, so it differs from run to run; all other members are
   * reproducible.
   */
  seconds: number;
}

/** The outcome, last line of the answer. */
export interface LabOutcome {
  /** Exact value, from a formula. */
  expected: number;
  /** Of log RMSE over log n, least squares; null with fewer than two n, or without an error. */
  slope: number | null;
  /** 95%, low and high; null without a slope. */
  slope_interval: [number, number] | null;
  /** Of theory; null where it gives none. */
  expected_slope: number | null;
  /** log RMSE = intercept + slope log n, natural logarithms. */
  intercept: number | null;
  /**
   * 1 / (relative MSE * CPU seconds of a replicate), at the largest n. Measured: differs from run
   * to run.
   */
  efficiency: number | null;
  /** The same with `cost` for seconds; reproducible. */
  efficiency_by_cost: number | null;
  /**
   * agrees: means and slope are those of theory (a wrong `differs` has a chance of 0.2%); biased:
   * as the estimator says of itself; undecided: nothing to compare, fewer than eight replicates, or
   * a slope whose interval is too wide to tell.
   */
  verdict: 'agrees' | 'differs' | 'biased' | 'undecided';
  /** The verdict in words. */
  explanation: string;
  experiment: string;
  estimator: string;
  /** How the expected image relates to the truth. */
  bias: 'none' | 'consistent' | 'biased';
  sampler: string;
  replicates: number;
  seed: number;
  /** Parameters in force. */
  params: Record<string, number>;
  /** Points of the first replicate, where the experiment shows them; at most 1024. */
  pattern: number[][];
}

/** Last line in place of the outcome: the server stops. */
export interface LabCancelled {
  cancelled: boolean;
}

/** A key that is to be made. */
export interface KeyRequest {
  /** Display name. */
  name: string;
  /**
   * Whose work it sees and makes: letters, digits, `.`, `_`, `-`; null: its own. A key that
   * replaces another names the tenant of that one.
   */
  tenant?: string | null;
  /**
   * What it may do; `admin` goes with `read` and `write`; `worker` is for `tessera worker` alone.
   * Default: ["read","write"].
   */
  scopes?: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests a minute; 0: any number; null: the server's. */
  rate_limit?: number | null;
  /** Highest priority of its jobs. Default: 0. */
  max_priority?: number;
  /** It expires after so many; null: never. */
  days?: number | null;
}

/** A key, without its text. */
export interface Key {
  /** Names the key in lists and logs. */
  id: string;
  /** Display name. */
  name: string;
  /** Whose work it sees and makes. */
  tenant: string;
  /** What it may do. */
  scopes: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests a minute; 0: any number; null: the server's. */
  rate_limit: number | null;
  /** Highest priority of its jobs. */
  max_priority: number;
  created_at: string;
  /** null: never. */
  expires_at: string | null;
}

/** A key that was made. */
export interface NewKey {
  /** Names the key in lists and logs. */
  id: string;
  /** Display name. */
  name: string;
  /** Whose work it sees and makes. */
  tenant: string;
  /** What it may do. */
  scopes: ('read' | 'write' | 'admin' | 'worker')[];
  /** Requests a minute; 0: any number; null: the server's. */
  rate_limit: number | null;
  /** Highest priority of its jobs. */
  max_priority: number;
  created_at: string;
  /** null: never. */
  expires_at: string | null;
  /** Its text. It is not shown again. */
  key: string;
}

/** All keys. */
export interface KeyList {
  /** Oldest first. */
  keys: Key[];
}

/** What tenants use: all for the operator and admins, else one's own. */
export interface Usage {
  /** By name. */
  tenants: {
    /** Empty: the operator. */
    tenant: string;
    /** Stored jobs. */
    jobs: number;
    /** Of these, those that have not ended. */
    unfinished_jobs: number;
    /** Of all jobs but previews, deleted ones included. */
    cpu_seconds: number;
    /** Jobs that were deleted. */
    deleted_jobs: number;
    /** Assets and scenes that it keeps. */
    asset_bytes: number;
    /** Films, and room for those that are being rendered. */
    film_bytes: number;
    /** Open event and tile streams. */
    streams: number;
  }[];
  /** Of each tenant; 0: no limit. */
  quotas: {
    /** Unfinished jobs. */
    jobs: number;
    /** Previews at a time. */
    previews: number;
    /** Open streams. */
    streams: number;
    /** Experiments at a time. */
    lab_runs: number;
    /** Assets and films. */
    stored_bytes: number;
  };
}

/** A webhook call. */
export interface Delivery {
  /** The webhook-id that the receiver gets, each time. */
  id: string;
  /** Or batch that it is about; null: a test. */
  job: string | null;
  /** What it tells: `state`, `end` or `test`. */
  event: string;
  url: string;
  /** `failed`: it was given up. */
  state: 'pending' | 'delivered' | 'failed';
  /** Calls that were made. */
  attempts: number;
  created_at: string;
  /** While it is pending. */
  next_attempt_at: string | null;
  ended_at: string | null;
  /** Of the last answer; null: there was none. */
  status: number | null;
  /** Why the last attempt failed; null: it did not. */
  detail: string | null;
}

/** A page of calls. */
export interface DeliveryList {
  /** Newest first. */
  deliveries: Delivery[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** Where to. */
export interface WebhookTestRequest {
  /** Where to send a call of type `test`. */
  url: string;
}

/** What calls are signed with. */
export interface WebhookSecret {
  /** `whsec_` and base64. */
  secret: string;
}

/** A worker lives, and what it is busy with. */
export interface WorkerReport {
  /** Id of its build. */
  build: string;
  /** Its arithmetic class. */
  arithmetic: string;
  /** Units that it renders at a time. Default: 1. */
  threads?: number;
  /** It takes no more units. Default: false. */
  draining?: boolean;
  /** Units that it holds. */
  units?: Record<string, number>;
}

/** A worker takes a unit, or hands it back. */
export interface UnitRequest {
  /** Who asks. */
  worker: string;
  /**
   * Why a unit that is handed back was not rendered; empty: for no fault of its own. Default: "".
   */
  fault?: string;
}

/** What a worker is to do. */
export interface WorkerOrders {
  /** It gets units. */
  suitable: boolean;
  /** Why it gets none. */
  reason: string | null;
  /** Until its next report. */
  report_seconds: number;
  /** Units whose results are not wanted any more. */
  dropped: string[];
}

/** What the units of a job need. */
export interface WorkInputs {
  /** The job's `spec`. */
  spec: Record<string, unknown>;
  /** Asset ids by uri; "" is the glTF document. Empty: the scene is built in. */
  files: Record<string, string>;
}

/** A process that renders units of this server's jobs. */
export interface Worker {
  /** A new one each time that it is started. */
  id: string;
  /** Its build. */
  build: string;
  /** Its arithmetic class. */
  arithmetic: string;
  /** Units that it renders at a time. */
  threads: number;
  /** Pixel samples a second while it renders. */
  rate: number;
  /** Units that it holds. */
  leases: number;
  /** Results of it that were taken. */
  units: number;
  /** Units that it lost, failed, or brought wrong results of. */
  faults: number;
  state: 'idle' | 'working' | 'draining' | 'unsuitable' | 'left' | 'lost';
  /** Why it is unsuitable. */
  reason: string | null;
  /** Its last report. */
  seen_at: string;
}

/** A tile that a worker renders. Pixels count from the top left of the full film. */
export interface WorkerTile {
  /** Its id. */
  worker: string;
  x: number;
  y: number;
  width: number;
  height: number;
}

/** All workers that were seen lately. */
export interface WorkerList {
  workers: Worker[];
}

/** Tiles of a job that workers render. */
export interface WorkerTiles {
  tiles: WorkerTile[];
}

/** A template and a matrix of values make jobs. */
export interface BatchRequest {
  /** A JobRequest; what the matrix gives may be missing. Class normal only. */
  template: Record<string, unknown>;
  /**
   * Paths of members of the job request, each with its values: {"variant": ["a", "b"]}. Every
   * combination is a job; the last member changes fastest. Values that are objects are merged into
   * the member. At most `batch_jobs` jobs.
   */
  matrix: Record<string, unknown[]>;
  /**
   * Pattern of the jobs' names. {variant} stands for the value of a member, by its path or the last
   * part of it; {index} counts from 1. Empty: all that the matrix changes. Default: "".
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
  /** What the matrix gave it. */
  values: Record<string, unknown>;
}

/** Jobs that were made together. */
export interface Batch {
  id: string;
  /** The pattern of the jobs' names. */
  name: string;
  /**
   * Of a batch whose jobs have ended: failed if one failed, else cancelled if one was cancelled.
   */
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
  /** Paths of what belongs to the batch. */
  links: Record<string, string>;
  /** In the order of the matrix. */
  jobs: BatchJob[];
}

/** A batch without its jobs. */
export interface BatchSummary {
  id: string;
  /** The pattern of the jobs' names. */
  name: string;
  /**
   * Of a batch whose jobs have ended: failed if one failed, else cancelled if one was cancelled.
   */
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
  /** Paths of what belongs to the batch. */
  links: Record<string, string>;
}

/** A page of batches. */
export interface BatchList {
  /** Newest first. */
  batches: BatchSummary[];
  /** Cursor of the next page; null: the last one. */
  next: string | null;
}

/** What a batch would make. */
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
   * Which image of a job. Errors of the pixels of a denoised one are not known singly: bias.low,
   * bias.high and z are null then. Default: "off".
   */
  a_denoise?: 'off' | 'mixed' | 'full';
  /** The same of b. Default: "off". */
  b_denoise?: 'off' | 'mixed' | 'full';
}
