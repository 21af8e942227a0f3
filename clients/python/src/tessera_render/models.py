"""The bodies of the HTTP interface, as they are in JSON.

Made by clients/generate.py from /openapi.json; not edited by hand.

A part of a request is also that part of a job's spec, where the server fills in
all defaults. Type checkers therefore do not know that its members are present
there: mypy allows a subscript, pyright reports it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict

if TYPE_CHECKING:
    from typing_extensions import NotRequired


class JobRequestCameraOrbit(TypedDict):
    """Position on a sphere around the target, instead of position and target."""

    theta_degrees: NotRequired[float]
    phi_degrees: NotRequired[float]
    radius: NotRequired[str | float]
    target: NotRequired[str | list[float]]


class JobRequestCameraPose(TypedDict):
    """Position and rotation as a matrix, instead of position, target and up."""

    convention: NotRequired[str]
    matrix: list[float]


class JobRequestCameraDistortion(TypedDict):
    """Lens distortion of a pinhole camera."""

    model: NotRequired[str]
    k: NotRequired[list[float]]


class JobRequestCamera(TypedDict):
    """Null members keep the value of the file's camera, selected by name or index, otherwise the
    first.
    """

    name: NotRequired[str | None]
    index: NotRequired[int | None]
    position: NotRequired[list[float] | None]
    target: NotRequired[list[float] | None]
    up: NotRequired[list[float] | None]
    orbit: NotRequired[JobRequestCameraOrbit | None]
    pose: NotRequired[JobRequestCameraPose | None]
    type: NotRequired[str]
    orthographic_height: NotRequired[float | None]
    vertical_fov_degrees: NotRequired[float | None]
    shift: NotRequired[list[float] | None]
    fx: NotRequired[float | None]
    fy: NotRequired[float | None]
    cx: NotRequired[float | None]
    cy: NotRequired[float | None]
    distortion: NotRequired[JobRequestCameraDistortion | None]
    aperture_radius: NotRequired[float | None]
    focus_distance: NotRequired[float | None]


class JobRequestMedium(TypedDict):
    """Participating medium (fog, smoke, haze) in the bounding sphere of the scene, outside
    solids. null: none.
    """

    type: NotRequired[str]
    scattering: NotRequired[list[float]]
    absorption: NotRequired[list[float]]
    g: NotRequired[float]
    height_falloff: NotRequired[float]


class JobRequestEnvironmentSun(TypedDict):
    """Sun and clear sky for a location and time, in cd/m2 (683 lm/W): at noon they light level
    ground with about 100,000 lux, so show images with exposure auto. Sky: Preetham, Shirley and
    Smits 1999, turbidity 3. Position: NOAA. The sun is sampled as a disc. North is -z, east is
    +x.
    """

    latitude: float
    longitude: float
    time: str


class JobRequestEnvironment(TypedDict):
    """Distant environment lighting, added to the scene's lights. Null: black. Absent: the
    scene's own, if it has one; otherwise white, unless the scene has a punctual light or an
    emissive strength above 1.
    """

    asset: NotRequired[str | None]
    preset: NotRequired[str]
    sun: NotRequired[JobRequestEnvironmentSun | None]
    color: NotRequired[list[float]]
    intensity: NotRequired[float]
    rotation_degrees: NotRequired[float]
    visible: NotRequired[bool]


class JobRequestBackground(TypedDict):
    """What the camera sees behind the scene; mirrors, and glass unless through_glass is true,
    show the environment.
    """

    type: NotRequired[str]
    color: NotRequired[list[float]]
    through_glass: NotRequired[bool]


class JobRequestGroundShadow(TypedDict):
    """The shadow on a catcher."""

    color: NotRequired[str]
    strength: NotRequired[float]
    softness: NotRequired[float]


class JobRequestGround(TypedDict):
    """Horizontal ground added to the scene."""

    type: NotRequired[str]
    height: NotRequired[float | None]
    color: NotRequired[list[float]]
    reflection: NotRequired[float]
    shadow: NotRequired[JobRequestGroundShadow]


class JobRequestFilmCrop(TypedDict):
    """Part of the film to render; null: all of it."""

    x: int
    y: int
    width: int
    height: int


class JobRequestFilmFilter(TypedDict):
    """Reconstruction filter."""

    type: NotRequired[str]
    radius: NotRequired[float]


class JobRequestFilm(TypedDict):
    """Size, filter and recorded layers; null: no image, only a meter."""

    width: NotRequired[int]
    height: NotRequired[int]
    crop: NotRequired[JobRequestFilmCrop | None]
    filter: NotRequired[JobRequestFilmFilter]
    layers: NotRequired[list[str]]


class JobRequestIntegrator(TypedDict):
    """How light paths are traced."""

    type: NotRequired[str]
    max_depth: NotRequired[int]
    caustics: NotRequired[str]
    photons: NotRequired[int]
    radius_m: NotRequired[float]
    alpha: NotRequired[float]
    final_gather: NotRequired[int]
    tolerance: NotRequired[float]
    rays: NotRequired[int]
    records: NotRequired[int]


class JobRequestEstimatorMis(TypedDict):
    """Weights of multiple importance sampling."""

    type: NotRequired[str]
    exponent: NotRequired[float]


class JobRequestEstimatorRoulette(TypedDict):
    """Russian roulette."""

    type: NotRequired[str]
    delta: NotRequired[float]


class JobRequestEstimatorSplitting(TypedDict):
    """Splitting of a path into several at its first surface."""

    type: NotRequired[str]
    count: NotRequired[int]


class JobRequestEstimatorControlVariate(TypedDict):
    """Quantity that is subtracted from samples and added in closed form."""

    type: NotRequired[str]


class JobRequestEstimator(TypedDict):
    """How paths are sampled and combined."""

    strategy: NotRequired[str]
    mis: NotRequired[JobRequestEstimatorMis]
    roulette: NotRequired[JobRequestEstimatorRoulette]
    splitting: NotRequired[JobRequestEstimatorSplitting]
    control_variate: NotRequired[JobRequestEstimatorControlVariate]
    expected_values: NotRequired[bool]


class JobRequestSampler(TypedDict):
    """Sequence of sample points."""

    type: NotRequired[str]
    replicates: NotRequired[int]
    first_replicate: NotRequired[int]


class JobRequestLightSampler(TypedDict):
    """How a light is selected."""

    type: NotRequired[str]
    candidates: NotRequired[int]
    block: NotRequired[int]
    history: NotRequired[int]
    candidates_per_pixel: NotRequired[int]


class JobRequestAdaptive(TypedDict):
    """Adaptive sampling."""

    type: NotRequired[str]
    min_samples: NotRequired[int]
    granularity: NotRequired[str]
    dilation: NotRequired[int]


class JobRequestMeterPoints(TypedDict):
    """A point with its normal."""

    position: list[float]
    normal: list[float]


class JobRequestMeterPlane(TypedDict):
    """Points at the centres of the cells of a rectangle, row by row; they follow the single
    points.
    """

    origin: list[float]
    edge_u: list[float]
    edge_v: list[float]
    columns: int
    rows: int


class JobRequestMeter(TypedDict):
    """Points at which irradiance is measured in addition to the image, by path tracing with 16
    paths for each sample of a pixel; see GET /v1/jobs/{id}/meter.
    """

    points: NotRequired[list[JobRequestMeterPoints]]
    plane: NotRequired[JobRequestMeterPlane | None]


class JobRequestStop(TypedDict):
    """When to stop: the first rule met ends the job. If given, only the rules in it apply.
    Default: {"samples_per_pixel":256}.
    """

    samples_per_pixel: NotRequired[int | None]
    relative_error: NotRequired[float | None]
    denoised_error: NotRequired[float | None]
    confidence: NotRequired[float]
    scope: NotRequired[str]
    seconds: NotRequired[float | None]
    cpu_seconds: NotRequired[float | None]
    meter_error: NotRequired[float | None]
    light_not_found: NotRequired[float | None]
    deadline: NotRequired[str | None]


class JobRequestDenoise(TypedDict):
    """Denoised images, which are made on demand and are not part of the film."""

    type: NotRequired[str]
    preview: NotRequired[bool]


class JobRequestWebhook(TypedDict):
    """Webhook to notify."""

    url: str
    events: NotRequired[list[str]]


_JobRequest = TypedDict("_JobRequest", {"class": "NotRequired[str]"})


class JobRequest(_JobRequest):
    """A job: what to render, how, and when to stop."""

    scene: str
    name: NotRequired[str]
    labels: NotRequired[dict[str, str]]
    priority: NotRequired[int]
    seed: NotRequired[int]
    camera: NotRequired[JobRequestCamera]
    variant: NotRequired[str | None]
    time_seconds: NotRequired[float | None]
    shutter_seconds: NotRequired[float]
    motion_seconds: NotRequired[float]
    medium: NotRequired[JobRequestMedium | None]
    preview_key: NotRequired[str | None]
    environment: NotRequired[JobRequestEnvironment | None]
    background: NotRequired[JobRequestBackground]
    ground: NotRequired[JobRequestGround]
    film: NotRequired[JobRequestFilm | None]
    integrator: NotRequired[JobRequestIntegrator]
    estimator: NotRequired[JobRequestEstimator]
    sampler: NotRequired[JobRequestSampler]
    light_sampler: NotRequired[JobRequestLightSampler]
    adaptive: NotRequired[JobRequestAdaptive]
    meter: NotRequired[JobRequestMeter | None]
    units: NotRequired[str]
    spectral: NotRequired[bool]
    stop: NotRequired[JobRequestStop]
    denoise: NotRequired[JobRequestDenoise]
    webhook: NotRequired[JobRequestWebhook | None]
    retention_seconds: NotRequired[float | None]


class JobPatchStop(JobRequestStop):
    """Rules to change; null removes one, others are kept."""


class JobPatch(TypedDict):
    """A merge patch (RFC 7396) of the changeable members."""

    priority: NotRequired[int]
    labels: NotRequired[dict[str, str | None]]
    name: NotRequired[str]
    stop: NotRequired[JobPatchStop]
    paused: NotRequired[bool]


class SceneFromAssets(TypedDict):
    """A scene from uploaded assets."""

    gltf: str
    files: NotRequired[dict[str, str]]


class ExtendRequestStop(JobRequestStop):
    """The new rules; they replace the old ones."""


class ExtendRequest(TypedDict):
    """New stop rules for a finished job."""

    stop: ExtendRequestStop


class MergeRequest(TypedDict):
    """Films to merge."""

    films: list[str]


class PresetRequest(TypedDict):
    """A job template for many images."""

    job: dict[str, Any]
    public: NotRequired[bool]
    sizes: NotRequired[list[list[int]]]
    deadline_seconds: NotRequired[float]
    turntable: NotRequired[bool]


class Preset(TypedDict):
    """A preset."""

    job: dict[str, Any]
    public: bool
    sizes: list[list[int]]
    deadline_seconds: float
    turntable: bool
    name: str


class PresetList(TypedDict):
    """All presets."""

    presets: list[Preset]


class SigningKey(TypedDict):
    """A new signing key."""

    id: str
    key: str


class SigningKeyRow(TypedDict):
    """A signing key, without its text."""

    id: str
    tenant: str
    created_at: str


class SigningKeyList(TypedDict):
    """All signing keys."""

    keys: list[SigningKeyRow]


class TicketRequest(TypedDict):
    """Jobs for which to create a ticket."""

    jobs: list[str]


class LabRequest(TypedDict):
    """An experiment to run; whole runs are limited to `lab_evaluations`."""

    experiment: str
    estimator: NotRequired[str]
    sampler: NotRequired[str]
    n: NotRequired[list[int]]
    replicates: NotRequired[int]
    seed: NotRequired[int]
    params: NotRequired[dict[str, float]]


class FieldError(TypedDict):
    """One error of the input."""

    pointer: str
    detail: str


class Problem(TypedDict):
    """RFC 9457."""

    type: str
    title: str
    status: int
    detail: str
    instance: NotRequired[str]
    errors: NotRequired[list[FieldError]]


JobState: TypeAlias = Literal[
    "queued", "loading", "rendering", "paused", "finished", "failed", "cancelled"
]


class JobSpecStop(JobRequestStop):
    """When to stop: the first rule met ends the job. If given, only the rules in it apply."""


_JobSpec = TypedDict("_JobSpec", {"class": "str"})


class JobSpec(_JobSpec):
    """The job request with all defaults filled in."""

    scene: str
    name: str
    labels: dict[str, str]
    priority: int
    seed: int
    camera: JobRequestCamera
    variant: str | None
    time_seconds: float | None
    shutter_seconds: NotRequired[float]
    motion_seconds: NotRequired[float]
    medium: JobRequestMedium | None
    preview_key: str | None
    environment: NotRequired[JobRequestEnvironment | None]
    background: NotRequired[JobRequestBackground]
    ground: NotRequired[JobRequestGround]
    film: JobRequestFilm | None
    integrator: JobRequestIntegrator
    estimator: JobRequestEstimator
    sampler: JobRequestSampler
    light_sampler: JobRequestLightSampler
    adaptive: JobRequestAdaptive
    meter: NotRequired[JobRequestMeter | None]
    units: str
    spectral: bool
    stop: JobSpecStop
    denoise: NotRequired[JobRequestDenoise]
    webhook: NotRequired[JobRequestWebhook | None]
    retention_seconds: NotRequired[float | None]


class ProgressSamplesPerPixel(TypedDict):
    """Samples per pixel, over the pixels of the crop."""

    min: int
    mean: float
    max: int


class Progress(TypedDict):
    """Progress of the job."""

    fraction: float
    samples_per_pixel: ProgressSamplesPerPixel
    elapsed_seconds: float
    cpu_seconds: float
    eta_seconds: float | None
    eta_interval_seconds: list[float] | None


class ErrorEstimate(TypedDict):
    """Error estimate of the current image I against the truth mu: the mean over pixels of (sum
    over channels of |I - mu|) / (sum of max(I, mu) + F), F = 0.05 (mean root of the
    luminance)^2.
    """

    relative: float | None
    low: float | None
    high: float | None
    grain: float | None
    doubt: float | None
    confidence: float
    bias: Literal["none", "consistent", "biased"]
    valid: bool
    unreliable: bool
    relative_rmse: float | None


class LightNotFound(TypedDict):
    """How much light may be missing from the image, from particles that are counted beside it."""

    at_most: float
    detected: float
    confidence: float
    particles: int
    tiles: int
    lacking: list[int]
    reason: str | None
    integrators: list[str]


class Statistics(TypedDict):
    """Cost of the job."""

    rays: int
    rays_per_second: float | None
    efficiency: float | None
    efficiency_low: float | None
    efficiency_high: float | None
    rejected_samples: int
    peak_bytes: int | None
    split_count: int | None
    radius_ratio: float | None


class Flicker(TypedDict):
    """By how much the error of images of a video changes from one frame to the next, relative to
    their light, along the motion of the surfaces.
    """

    relative: float
    low: float
    high: float


class Denoised(TypedDict):
    """The newest denoised image, with the error of `mixed`."""

    type: str
    version: str
    sha256: str | None
    quality: str | None
    note: str | None
    features: bool
    relative: float | None
    low: float | None
    high: float | None
    grain: float | None
    doubt: float | None
    unreliable: bool
    full_relative: float | None
    relative_rmse: float | None
    full_relative_rmse: float | None
    gain: float | None
    revision: int
    seconds: float
    frames: int
    flicker: Flicker | None


class Job(TypedDict):
    """A job."""

    id: str
    state: JobState
    pause_reason: Literal["requested", "storage_full", None]
    stop_reason: Literal[
        "samples_per_pixel",
        "relative_error",
        "denoised_error",
        "seconds",
        "cpu_seconds",
        "deadline",
        "meter_error",
        "light_not_found",
        "limit",
        "cancelled",
        "failed",
        None,
    ]
    created_at: str
    started_at: str | None
    finished_at: str | None
    spec: JobSpec
    progress: Progress
    error: ErrorEstimate
    light_not_found: LightNotFound | None
    failure: Problem | None
    queue_position: int | None
    statistics: Statistics
    revision: int
    available: list[Literal["image", "denoised", "meter"]]
    film_digest: str | None
    denoised: Denoised | None
    denoising: bool
    doubted: bool
    merged: bool
    warnings: list[str]
    warning_details: list[Warning]
    links: dict[str, str]


class JobList(TypedDict):
    """A page of jobs."""

    jobs: list[Job]
    damaged: list[str]
    next: str | None


class DryRunEstimate(TypedDict):
    """Estimate from a pilot of at most half a second."""

    seconds: float
    seconds_low: float
    seconds_high: float
    confidence: float
    cpu_seconds: float
    samples_per_pixel: float
    memory_bytes: float
    memory_bytes_low: float
    memory_bytes_high: float
    pilot_cpu_seconds: float


class DryRun(TypedDict):
    """A job's effective request and its estimated cost."""

    spec: JobSpec
    warnings: list[str]
    estimate: DryRunEstimate


class Ticket(TypedDict):
    """A stream ticket."""

    ticket: str
    expires_at: str
    jobs: list[str]


class StateEvent(TypedDict):
    """The state has changed."""

    state: JobState
    pause_reason: Literal["requested", "storage_full", None]
    stop_reason: Literal[
        "samples_per_pixel",
        "relative_error",
        "denoised_error",
        "seconds",
        "cpu_seconds",
        "deadline",
        "meter_error",
        "light_not_found",
        "limit",
        "cancelled",
        "failed",
        None,
    ]
    queue_position: int | None
    spec_version: int


class ProgressEvent(TypedDict):
    """The image has progressed."""

    state: JobState
    progress: Progress
    error: ErrorEstimate
    light_not_found: LightNotFound | None
    statistics: Statistics
    revision: int
    available: list[Literal["image", "denoised", "meter"]]
    denoised: Denoised | None


class TileEvent(TypedDict):
    """A tile has changed; only the newest event of each tile is kept."""

    x: int
    y: int
    width: int
    height: int
    revision: int
    samples: float
    error: float | None
    url: str


class WarningEvent(TypedDict):
    """A new entry of the job's `warnings`."""

    message: str


class EndEvent(TypedDict):
    """The job has ended."""

    state: JobState
    stop_reason: Literal[
        "samples_per_pixel",
        "relative_error",
        "denoised_error",
        "seconds",
        "cpu_seconds",
        "deadline",
        "meter_error",
        "light_not_found",
        "limit",
        "cancelled",
        "failed",
        None,
    ]
    film_digest: str | None
    revision: int
    available: list[Literal["image", "denoised", "meter"]]
    error: ErrorEstimate
    light_not_found: LightNotFound | None
    failure: Problem | None


class ResetEvent(TypedDict):
    """Events were lost; a snapshot follows."""

    reason: str


class OverloadedEvent(TypedDict):
    """The stream is refused: the server's limit of streams is reached."""

    detail: str
    retry_after_seconds: int


class Webhook(TypedDict):
    """The body of a webhook, signed as defined by Standard Webhooks."""

    type: str
    timestamp: str
    data: Job


class Asset(TypedDict):
    """A stored file."""

    id: str
    bytes: int


class Warning(TypedDict):
    """What was read otherwise than the file says, or not at all. Its text in `warnings` is
    `pointer: detail`.
    """

    code: str
    pointer: str
    detail: str


class SceneCamera(TypedDict):
    """A camera of the file."""

    index: int
    name: str
    type: Literal["perspective", "orthographic"]
    vertical_fov_degrees: float | None
    position: list[float]
    direction: list[float]
    up: list[float]


class SceneLight(TypedDict):
    """A punctual light of the file."""

    name: str
    type: Literal["directional", "point", "spot", "profile"]
    intensity: list[float]


class SceneBounds(TypedDict):
    """Axis-aligned box, metres; null: empty."""

    min: list[float]
    max: list[float]


class Scene(TypedDict):
    """A loaded scene."""

    id: str
    name: str
    bytes: int
    bounds: SceneBounds | None
    triangles: int
    instances: int
    cameras: list[SceneCamera]
    lights: list[SceneLight]
    light_groups: list[str]
    materials: list[str]
    variants: list[str]
    animations: list[str]
    extensions: list[str]
    warnings: list[str]
    warning_details: list[Warning]


class SceneList(TypedDict):
    """A page of scenes."""

    scenes: list[Scene]
    next: str | None


class ConvergencePoint(TypedDict):
    """The state of a job at one error check."""

    samples_per_pixel: int
    elapsed_seconds: float
    cpu_seconds: float
    rays: int
    relative: float | None
    low: float | None
    high: float | None
    grain: float | None
    doubt: float | None
    relative_rmse: float | None


class ConvergenceSlope(TypedDict):
    """Slope of log error against log samples, by least squares, with its 95% interval."""

    value: float | None
    low: float | None
    high: float | None


class Convergence(TypedDict):
    """Get the error over samples and time."""

    points: list[ConvergencePoint]
    slope: ConvergenceSlope


class PixelLayer(TypedDict):
    """One layer at one pixel, with one number per channel."""

    mean: list[float | None]
    standard_error: list[float | None]
    low: list[float | None]
    high: list[float | None]
    halves: list[list[float | None]] | None


class Pixel(TypedDict):
    """One pixel."""

    x: int
    y: int
    samples: int
    layers: dict[str, PixelLayer]


class MeterReading(TypedDict):
    """Light that arrives at one side of a point, in lux for all sources alike."""

    position: list[float]
    normal: list[float]
    irradiance_w_m2: float
    illuminance_lux: float
    low: float
    high: float
    unreliable: bool
    irradiance_rgb: list[float]
    samples: int


class Meter(TypedDict):
    """Current readings of a job's meter."""

    bias: Literal["none", "consistent", "biased"]
    confidence: float
    mean_lux: float | None
    uniformity: float | None
    outdoor_lux: float | None
    daylight_factor: float | None
    points: list[MeterReading]


class MeterFigures(TypedDict):
    """Figures of a job's meter; see Meter."""

    job: str
    mean_lux: float
    uniformity: float | None
    daylight_factor: float | None


class MeterPair(TypedDict):
    """A point of two meters."""

    position: list[float]
    a_lux: float
    b_lux: float
    difference_lux: float
    low: float
    high: float


class MeterComparison(TypedDict):
    """The meters of two jobs compared point by point; b is the reference."""

    a: MeterFigures
    b: MeterFigures
    difference_lux: float
    points: list[MeterPair]


class ComparisonZ(TypedDict):
    """Statistics of (a-b) / standard error."""

    mean: float | None
    variance: float | None
    share_above_3: float | None


class ComparisonLinks(TypedDict):
    """Paths."""

    self: str
    difference: str
    z: str
    flip: str
    a: str
    b: str


class Comparison(TypedDict):
    """Two images compared; b is the reference."""

    id: str
    mse: float | None
    relmse: float | None
    flip: float | None
    bias: ConvergenceSlope
    z: ComparisonZ
    links: ComparisonLinks


class SceneObjectVisible(TypedDict):
    """Bounding box of the pixels whose centre shows it, on the full film; null: none, or the job
    did not record ids.
    """

    x: float
    y: float
    width: float
    height: float
    pixels: int


class SceneObjectAmodal(TypedDict):
    """Bounding box of its part within the film, hidden or not, in pixels; null: nothing."""

    x: float
    y: float
    width: float
    height: float


class SceneObject(TypedDict):
    """A node of the file that shows a mesh."""

    id: int
    pointer: str
    name: str
    first_instance: int
    instances: int
    bounds: SceneBounds | None
    visible: SceneObjectVisible | None
    amodal: SceneObjectAmodal | None


class ObjectInstance(TypedDict):
    """An instance of an object that the image shows."""

    id: int
    object: int
    bounds: SceneBounds | None
    visible: SceneObjectVisible | None
    amodal: SceneObjectAmodal | None


class Label(TypedDict):
    """Meaning of an id in the layers material and primitive."""

    id: int
    pointer: str | None
    name: str


class SceneObjectsCameraDistortion(TypedDict):
    """Lens distortion of a pinhole camera."""

    model: NotRequired[Literal["none", "opencv", "fisheye"]]
    k: NotRequired[list[float]]


class SceneObjectsCamera(TypedDict):
    """The camera without its lens. With (x, y, z) = world_to_camera (X, Y, Z, 1) the point is
    seen at the pixel (cx + fx x / z, cy + fy y / z) of a perspective or pinhole image, where z >
    0, after the lens's distortion has moved (x / z, y / z); at (cx + fx x, cy + fy y) of an
    orthographic one; and at (cx + fx atan2(x, z), cy + fy atan2(y, hypot(x, z))) of a panorama.
    Pixel i goes from i to i + 1; for tools that count from its centre, subtract 0.5.
    """

    type: Literal["perspective", "orthographic", "panorama", "pinhole"]
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: SceneObjectsCameraDistortion
    world_to_camera: list[float | None]
    to_world: list[float | None]


class SceneObjects(TypedDict):
    """Meaning of the ids in an image's layers. They follow from the file alone: all views,
    variants and times of a scene have the same ids.
    """

    camera: SceneObjectsCamera
    has_ids: bool
    objects: list[SceneObject]
    instances: list[ObjectInstance]
    materials: list[Label]
    primitives: list[Label]


_JobDefaults = TypedDict("_JobDefaults", {"class": "str"})


class JobDefaults(_JobDefaults):
    """Default values of a job request."""

    name: str
    labels: dict[str, str]
    priority: int
    seed: int
    camera: JobRequestCamera
    variant: str | None
    time_seconds: float | None
    shutter_seconds: NotRequired[float]
    motion_seconds: NotRequired[float]
    medium: JobRequestMedium | None
    preview_key: str | None
    environment: NotRequired[JobRequestEnvironment | None]
    background: NotRequired[JobRequestBackground]
    ground: NotRequired[JobRequestGround]
    film: JobRequestFilm | None
    integrator: JobRequestIntegrator
    estimator: JobRequestEstimator
    sampler: JobRequestSampler
    light_sampler: JobRequestLightSampler
    adaptive: JobRequestAdaptive
    meter: NotRequired[JobRequestMeter | None]
    units: str
    spectral: bool
    stop: JobSpecStop
    denoise: NotRequired[JobRequestDenoise]
    webhook: NotRequired[JobRequestWebhook | None]
    retention_seconds: NotRequired[float | None]


class TypeInfo(TypedDict):
    """A name that requests can use."""

    type: str
    bias: Literal["none", "consistent", "biased"]
    summary: str
    accepts: list[str]


class IntegratorInfo(TypedDict):
    """An algorithm that traces light paths."""

    type: str
    bias: Literal["none", "consistent", "biased"]
    error: Literal["valid", "from-chains", "by-comparison"]
    summary: str
    accepts: list[str]
    defaults: dict[str, Any]


class EstimationOption(TypedDict):
    """An estimator setting."""

    name: str
    bias: Literal["none", "consistent", "biased"]
    summary: str
    patch: dict[str, Any]


class ExperimentEstimators(TypedDict):
    name: str
    bias: Literal["none", "consistent", "biased"]
    summary: str


class ExperimentParams(TypedDict):
    name: str
    min: float
    max: float
    default: float
    integer: bool
    summary: str


class Experiment(TypedDict):
    """An experiment of the laboratory."""

    name: str
    title: str
    summary: str
    estimates: str
    formula: str
    look_for: str
    estimators: list[ExperimentEstimators]
    estimator: str
    samplers: list[str]
    sampler: str
    n: list[int]
    unit: str
    replicates: int
    params: list[ExperimentParams]
    expected: float
    pattern_dimensions: int


class ServerBuild(TypedDict):
    """Build and machine properties on which the bits of a film depend besides the job."""

    id: str
    commit: str
    compiler: str
    isa: str
    embree: str
    waves: bool


class ServerScenes(TypedDict):
    name: str
    summary: str


class Server(TypedDict):
    """Server capabilities."""

    version: str
    build: ServerBuild
    limits: dict[str, int]
    defaults: JobDefaults
    integrators: list[IntegratorInfo]
    samplers: list[TypeInfo]
    light_samplers: list[TypeInfo]
    adaptive: list[TypeInfo]
    options: list[EstimationOption]
    layers: list[str]
    optional_layers: list[str]
    layer_patterns: list[str]
    image_formats: list[str]
    tone_maps: list[str]
    filters: list[str]
    scenes: list[ServerScenes]
    experiments: list[Experiment]
    extensions: list[str]


class Drain(TypedDict):
    """Whether the server accepts new jobs, and its remaining work."""

    draining: bool
    running: int
    queued: int


class LabPoint(TypedDict):
    """Results for one n."""

    n: int
    n_asked: int
    mean: float
    rmse: float
    standard_error: float
    cost: float
    seconds: float


class LabOutcome(TypedDict):
    """The outcome; last line of the response."""

    expected: float
    slope: float | None
    slope_interval: list[float] | None
    expected_slope: float | None
    intercept: float | None
    efficiency: float | None
    efficiency_by_cost: float | None
    verdict: Literal["agrees", "differs", "biased", "undecided"]
    explanation: str
    experiment: str
    estimator: str
    bias: Literal["none", "consistent", "biased"]
    sampler: str
    replicates: int
    seed: int
    params: dict[str, float]
    pattern: list[list[float]]


class LabCancelled(TypedDict):
    """Last line instead of the outcome if the server shuts down."""

    cancelled: bool


class KeyRequest(TypedDict):
    """A key to create."""

    name: str
    tenant: NotRequired[str | None]
    scopes: NotRequired[list[Literal["read", "write", "admin", "worker"]]]
    rate_limit: NotRequired[int | None]
    max_priority: NotRequired[int]
    days: NotRequired[int | None]


class Key(TypedDict):
    """A key, without its text."""

    id: str
    name: str
    tenant: str
    scopes: list[Literal["read", "write", "admin", "worker"]]
    rate_limit: int | None
    max_priority: int
    created_at: str
    expires_at: str | None


class IssuedKey(TypedDict):
    """A new key."""

    id: str
    name: str
    tenant: str
    scopes: list[Literal["read", "write", "admin", "worker"]]
    rate_limit: int | None
    max_priority: int
    created_at: str
    expires_at: str | None
    key: str


class KeyList(TypedDict):
    """All keys."""

    keys: list[Key]


class UsageTenants(TypedDict):
    tenant: str
    jobs: int
    unfinished_jobs: int
    cpu_seconds: float
    deleted_jobs: int
    asset_bytes: int
    film_bytes: int
    streams: int


class UsageQuotas(TypedDict):
    """Quotas of each tenant; 0: no limit."""

    jobs: int
    previews: int
    streams: int
    lab_runs: int
    stored_bytes: int


class Usage(TypedDict):
    """Usage of tenants: all for the operator and admins, otherwise only the key's own."""

    tenants: list[UsageTenants]
    quotas: UsageQuotas


class Delivery(TypedDict):
    """A webhook call."""

    id: str
    job: str | None
    event: str
    url: str
    state: Literal["pending", "delivered", "failed"]
    attempts: int
    created_at: str
    next_attempt_at: str | None
    ended_at: str | None
    status: int | None
    detail: str | None


class DeliveryList(TypedDict):
    """A page of calls."""

    deliveries: list[Delivery]
    next: str | None


class WebhookTestRequest(TypedDict):
    """Receiver of a test call."""

    url: str


class WebhookSecret(TypedDict):
    """The secret that signs calls."""

    secret: str


class WorkerReport(TypedDict):
    """State of a worker and its units."""

    build: str
    arithmetic: str
    threads: NotRequired[int]
    draining: NotRequired[bool]
    units: NotRequired[dict[str, float]]


class UnitRequest(TypedDict):
    """Lease or return of a unit."""

    worker: str
    fault: NotRequired[str]


class WorkerOrders(TypedDict):
    """Orders for a worker."""

    suitable: bool
    reason: str | None
    report_seconds: float
    dropped: list[str]


class WorkInputs(TypedDict):
    """Inputs of a job's units."""

    spec: dict[str, Any]
    files: dict[str, str]


class Worker(TypedDict):
    """A process that renders units of this server's jobs."""

    id: str
    build: str
    arithmetic: str
    threads: int
    rate: float
    leases: int
    held: list[str]
    units: int
    faults: int
    state: Literal["idle", "working", "draining", "suspended", "unsuitable", "left", "lost"]
    reason: str | None
    seen_at: str


class WorkerTile(TypedDict):
    """A tile that a worker is rendering. Pixels count from the top left of the full film."""

    worker: str
    x: int
    y: int
    width: int
    height: int


class WorkerList(TypedDict):
    """All workers seen recently."""

    workers: list[Worker]


class WorkerTiles(TypedDict):
    """Tiles of a job that workers are rendering."""

    tiles: list[WorkerTile]


class BatchRequest(TypedDict):
    """A template and a matrix of values that define jobs."""

    template: dict[str, Any]
    matrix: dict[str, list[Any]]
    name: NotRequired[str]
    webhook: NotRequired[JobRequestWebhook | None]


class BatchJob(TypedDict):
    """A job of a batch."""

    id: str
    name: str
    state: str
    fraction: float
    revision: int
    values: dict[str, Any]


class BatchProgress(TypedDict):
    """Progress of all jobs together."""

    fraction: float
    cpu_seconds: float


class BatchCounts(TypedDict):
    """Jobs in each state."""

    queued: int
    loading: int
    rendering: int
    paused: int
    failed: int
    cancelled: int
    finished: int


class Batch(TypedDict):
    """Jobs that were submitted together."""

    id: str
    name: str
    state: Literal["queued", "rendering", "paused", "failed", "cancelled", "finished"]
    created_at: str
    progress: BatchProgress
    counts: BatchCounts
    flicker: Flicker | None
    damaged: list[str]
    links: dict[str, str]
    jobs: list[BatchJob]


class BatchSummary(TypedDict):
    """A batch without its jobs."""

    id: str
    name: str
    state: Literal["queued", "rendering", "paused", "failed", "cancelled", "finished"]
    created_at: str
    progress: BatchProgress
    counts: BatchCounts
    flicker: Flicker | None
    damaged: list[str]
    links: dict[str, str]


class BatchList(TypedDict):
    """A page of batches."""

    batches: list[BatchSummary]
    next: str | None


class BatchDryRun(TypedDict):
    """The jobs that a batch would create."""

    names: list[str]


class ComparisonRequest(TypedDict):
    """Two images; b is the reference."""

    a: str
    b: str
    a_denoise: NotRequired[Literal["off", "mixed", "full", "video"]]
    b_denoise: NotRequired[Literal["off", "mixed", "full", "video"]]
