#include "core/settings/choices.h"

#include <array>

namespace core {
namespace {

constexpr Options kReplicateOptions = {"/sampler/replicates", "/sampler/first_replicate"};

constexpr std::array kSamplers = {
    NamedValue<SamplerType>{"independent", SamplerType::kIndependent,
                            "Independent uniform numbers; error falls as N^-1/2.",
                            kReplicateOptions},
    NamedValue<SamplerType>{"antithetic", SamplerType::kAntithetic,
                            "Pairs of mirrored points on film, lens and emitters; sample counts "
                            "are rounded up to multiples of 2 times the replicates.",
                            kReplicateOptions},
    NamedValue<SamplerType>{
        "stratified", SamplerType::kStratified,
        "Independent sets of 16 points, jittered in 4 x 4 cells of film, lens, emitter and "
        "direction; sample counts are rounded up to multiples of 16 times the replicates.",
        kReplicateOptions},
    NamedValue<SamplerType>{
        "latin-hypercube", SamplerType::kLatinHypercube,
        "Independent sets of 16 points, one in each of 16 intervals of every dimension; sample "
        "counts are rounded up to multiples of 16 times the replicates.",
        kReplicateOptions},
    NamedValue<SamplerType>{
        "orthogonal-array", SamplerType::kOrthogonalArray,
        "Independent sets of 25 points, one in each of 5 x 5 cells of every pair within four "
        "dimensions; sample counts are rounded up to multiples of 25 times the replicates.",
        kReplicateOptions},
    NamedValue<SamplerType>{
        "halton", SamplerType::kHalton,
        "Halton points with scrambled digits in bases 2 to 311, one sequence over ten bounces; "
        "sample counts must be even (odd ones above 1 are rounded up).",
        kReplicateOptions},
    NamedValue<SamplerType>{"sobol", SamplerType::kSobol,
                            "Owen-scrambled Sobol points in groups of four dimensions; sample "
                            "counts must be even (odd ones above 1 are rounded up).",
                            kReplicateOptions},
    NamedValue<SamplerType>{
        "zsobol", SamplerType::kZsobol,
        "Sobol points in blue-noise order, for previews: errors of neighbouring pixels cancel, so "
        "variances do not add up over a block. Independent sets of 8 points per pixel; sample "
        "counts are rounded up to multiples of 8 times the replicates.",
        kReplicateOptions},
};

constexpr std::array kLightSamplers = {
    NamedValue<LightSamplerType>{"uniform", LightSamplerType::kUniform,
                                 "Every light with the same probability."},
    NamedValue<LightSamplerType>{"power", LightSamplerType::kPower,
                                 "In proportion to emitted power."},
    NamedValue<LightSamplerType>{
        "tree", LightSamplerType::kTree,
        "A light tree, by the estimated contribution of each light at the shaded point."},
    NamedValue<LightSamplerType>{"ris",
                                 LightSamplerType::kRis,
                                 "One of `candidates` from the tree, chosen by its unshadowed "
                                 "contribution (resampled importance "
                                 "sampling).",
                                 {"/light_sampler/candidates"}},
    NamedValue<LightSamplerType>{
        "restir",
        LightSamplerType::kRestir,
        "At the first surface, shares light samples between the pixels of a square of `block` by "
        "`block` and between `history` passes, resampled by unshadowed contribution with weights "
        "that keep the result unbiased (reservoir resampling). Errors of neighbouring pixels are "
        "correlated. Sample counts are rounded up to multiples of `history` times the replicates.",
        {"/light_sampler/block", "/light_sampler/history", "/light_sampler/candidates_per_pixel"}},
    NamedValue<LightSamplerType>{
        "measured", LightSamplerType::kMeasured,
        "The more efficient of tree and ris, which small images of both tell beforehand; the job's "
        "spec then names it."},
};

constexpr std::array kStrategies = {
    NamedValue<Strategy>{"mis", Strategy::kMis, "Light and BSDF sampling combined."},
    NamedValue<Strategy>{"light", Strategy::kLight, "Next-event estimation alone."},
    NamedValue<Strategy>{"bsdf", Strategy::kBsdf, "BSDF sampling alone."},
    NamedValue<Strategy>{"cosine", Strategy::kCosine,
                         "Cosine-weighted directions, independent of the BSDF."},
    NamedValue<Strategy>{"uniform", Strategy::kUniform, "Uniform directions over the hemisphere."},
};

constexpr std::array kMisTypes = {
    NamedValue<MisType>{"balance", MisType::kBalance, "Balance heuristic."},
    NamedValue<MisType>{
        "power", MisType::kPower, "Power heuristic with `exponent`.", {"/estimator/mis/exponent"}},
    NamedValue<MisType>{"maximum", MisType::kMaximum,
                        "Maximum heuristic: all weight to the technique with the larger density."},
    NamedValue<MisType>{"optimal", MisType::kOptimal,
                        "At the first surface, weights with the least variance for each pixel, "
                        "which may be negative; each half solves the 2x2 system for the other. "
                        "Power heuristic at later bounces."},
};

constexpr std::array kRouletteTypes = {
    NamedValue<RouletteType>{"none", RouletteType::kNone, "Paths end only at max_depth."},
    NamedValue<RouletteType>{"throughput", RouletteType::kThroughput,
                             "Paths with low throughput are terminated at random: the lower the "
                             "throughput, the more often, and more often after glossy surfaces."},
    NamedValue<RouletteType>{
        "threshold",
        RouletteType::kThreshold,
        "As `throughput`; also traces shadow rays at random for light samples whose unshadowed "
        "contribution to the pixel is below `delta`, in proportion to it.",
        {"/estimator/roulette/delta"}},
};

constexpr std::array kSplittingTypes = {
    NamedValue<SplittingType>{"none", SplittingType::kNone, "One path per camera ray."},
    NamedValue<SplittingType>{
        "fixed",
        SplittingType::kFixed,
        "`count` continuations at the first surface that a camera ray hits, averaged.",
        {"/estimator/splitting/count"}},
    NamedValue<SplittingType>{
        "measured", SplittingType::kMeasured,
        "As `fixed`, with the most efficient count from 1 to 8 for the variances and ray counts "
        "that a pilot of 4096 paths measures before rendering."},
};

constexpr std::array kCausticsTypes = {
    NamedValue<CausticsType>{"off", CausticsType::kOff,
                             "Paths from the camera alone; they find caustics by chance."},
    NamedValue<CausticsType>{"on",
                             CausticsType::kOn,
                             "Photons of caustics too: integrator `path-caustics`.",
                             {},
                             "consistent"},
    NamedValue<CausticsType>{"auto",
                             CausticsType::kAuto,
                             "`on` if the camera sees caustics, and small pilot images with them "
                             "are more efficient; the job reports the choice.",
                             {},
                             "consistent"},
};

constexpr std::array kControlVariateTypes = {
    NamedValue<ControlVariateType>{"none", ControlVariateType::kNone, "Plain light samples."},
    NamedValue<ControlVariateType>{
        "analytic", ControlVariateType::kAnalytic,
        "On diffuse surfaces, computes the unshadowed light of uniform emitters in closed form and "
        "samples only shadows and gloss. Less noise where there are few shadows, more deep in "
        "shadow. Strategies 'mis' and 'light'."},
    NamedValue<ControlVariateType>{
        "regression", ControlVariateType::kRegression,
        "As `analytic`, at the first surface, with a factor for each pixel that one half fits for "
        "the other by least squares; it is small in shadow. BSDF samples are unchanged. Strategies "
        "'mis' and 'light'."},
};

constexpr std::array kExpectedValues = {
    NamedValue<bool>{"true", true,
                     "Absorption and transparency attenuate the throughput of a path."},
    NamedValue<bool>{"false", false,
                     "Absorption by surfaces and media, and transparency along shadow rays, "
                     "terminate paths at random: the same mean, more noise."},
};

constexpr std::array kSpectral = {
    NamedValue<bool>{"false", false, "Paths carry red, green and blue."},
    NamedValue<bool>{"true", true,
                     "Each path carries three wavelengths: reproduces dispersion, and colours that "
                     "deepen over several bounces."},
};
constexpr std::array kAdaptiveTypes = {
    NamedValue<AdaptiveType>{"none", AdaptiveType::kNone,
                             "Every pixel gets the same number of samples."},
    NamedValue<AdaptiveType>{
        "pilot",
        AdaptiveType::kPilot,
        "More samples where a pilot finds noise. Pilot samples are never part "
        "of the image and take at most a tenth extra; errors are valid.",
        {"/adaptive/min_samples", "/adaptive/granularity", "/adaptive/dilation"}},
};

constexpr std::array kLaboratoryRules = {
    LaboratoryRule{"crosshalf", "stopping-bias", "cross-half"},
    LaboratoryRule{"sequential", "stopping-bias", "standard-error"},
};

constexpr std::array kGranularities = {
    NamedValue<Granularity>{"pixel", Granularity::kPixel, "Each pixel from its own neighbourhood."},
    NamedValue<Granularity>{"tile", Granularity::kTile, "The same count for all pixels of a tile."},
};

constexpr std::array kFilters = {
    NamedValue<FilterType>{"box", FilterType::kBox, "Constant."},
    NamedValue<FilterType>{"tent", FilterType::kTent, "Linear."},
    NamedValue<FilterType>{"gaussian", FilterType::kGaussian,
                           "Gaussian, sigma = radius / 3, truncated."},
    NamedValue<FilterType>{"mitchell", FilterType::kMitchell,
                           "Mitchell-Netravali with B = C = 1/3; has negative lobes."},
    NamedValue<FilterType>{"blackman-harris", FilterType::kBlackmanHarris,
                           "Blackman-Harris window."},
};

constexpr std::array kFogTypes = {
    NamedValue<FogType>{"homogeneous", FogType::kHomogeneous,
                        "The same coefficients everywhere; the density may decrease with height."},
};

constexpr std::array kBackgrounds = {
    NamedValue<BackgroundType>{"environment", BackgroundType::kEnvironment,
                               "The environment that lights the scene; black without one."},
    NamedValue<BackgroundType>{"transparent", BackgroundType::kTransparent,
                               "Transparent: alpha is 0 where nothing is hit."},
    NamedValue<BackgroundType>{"color", BackgroundType::kColor, "One colour."},
    NamedValue<BackgroundType>{"blurred", BackgroundType::kBlurred,
                               "The environment, out of focus."},
};
constexpr std::array kGrounds = {
    NamedValue<GroundType>{"none", GroundType::kNone, "No ground plane."},
    NamedValue<GroundType>{"catcher", GroundType::kCatcher,
                           "A shadow catcher: a plane that shows only the shadows and the light "
                           "that the model casts on it."},
    NamedValue<GroundType>{"sweep", GroundType::kSweep,
                           "A studio sweep: a floor that curves up into a wall behind the model, "
                           "as seen from the camera."},
};
constexpr std::array kShadowColors = {
    NamedValue<ShadowColor>{"neutral", ShadowColor::kNeutral,
                            "Without colour: alpha is the luminance that the model takes from the "
                            "ground. Fades to 0 at the border of the image."},
    NamedValue<ShadowColor>{"physical", ShadowColor::kPhysical,
                            "In the colours of the light that is left, and of the light that the "
                            "model reflects onto the ground."},
};
constexpr std::array kUnits = {
    NamedValue<Units>{"photometric", Units::kPhotometric,
                      "A radiance of 1 is 1 cd/m2: candelas, lux and nits of the file count as "
                      "they are, the watts of sun and sky 683 lm/W, and 1 in an image, colour or "
                      "preset is 1 cd/m2."},
};
constexpr std::array kPresets = {
    NamedValue<EnvironmentPreset>{"studio", EnvironmentPreset::kStudio,
                                  "Soft boxes against grey: key, fill, one above and one behind."},
    NamedValue<EnvironmentPreset>{"tent", EnvironmentPreset::kTent,
                                  "A product tent: bright cloth all around, open to the front."},
    NamedValue<EnvironmentPreset>{
        "rim", EnvironmentPreset::kRim,
        "Two strip lights behind the model and little light from the front."},
};
constexpr std::array kCameraTypes = {
    NamedValue<CameraType>{"perspective", CameraType::kPerspective, "All rays through one point."},
    NamedValue<CameraType>{"orthographic", CameraType::kOrthographic, "Parallel rays."},
    NamedValue<CameraType>{
        "panorama", CameraType::kPanorama,
        "All directions, equirectangular: the centre is forward, the top is up."},
    NamedValue<CameraType>{"pinhole", CameraType::kPinhole,
                           "A calibrated camera: focal lengths and principal point in pixels, with "
                           "or without a lens's distortion."},
};
constexpr std::array kDistortionModels = {
    NamedValue<DistortionModel>{"none", DistortionModel::kNone, "Straight lines stay straight."},
    NamedValue<DistortionModel>{
        "opencv", DistortionModel::kOpencv,
        "Radial, tangential and thin-prism: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]]."},
    NamedValue<DistortionModel>{
        "fisheye", DistortionModel::kFisheye,
        "Equidistant, as in cv::fisheye: theta (1 + k1 theta^2 + ... + k4 theta^8)."},
};
constexpr std::array kPoseConventions = {
    NamedValue<PoseConvention>{"opencv", PoseConvention::kOpencv, "x right, y down, z ahead."},
    NamedValue<PoseConvention>{"opengl", PoseConvention::kOpengl, "x right, y up, z back."},
    NamedValue<PoseConvention>{"ros", PoseConvention::kRos, "x ahead, y left, z up (REP 103)."},
};

}  // namespace

std::span<const NamedValue<SamplerType>> samplers() { return kSamplers; }
std::span<const NamedValue<LightSamplerType>> light_samplers() { return kLightSamplers; }
std::span<const NamedValue<Strategy>> strategies() { return kStrategies; }
std::span<const NamedValue<MisType>> mis_types() { return kMisTypes; }
std::span<const NamedValue<RouletteType>> roulette_types() { return kRouletteTypes; }
std::span<const NamedValue<SplittingType>> splitting_types() { return kSplittingTypes; }
std::span<const NamedValue<CausticsType>> caustics_types() { return kCausticsTypes; }
std::span<const NamedValue<ControlVariateType>> control_variate_types() {
  return kControlVariateTypes;
}
std::span<const NamedValue<bool>> expected_value_types() { return kExpectedValues; }
std::span<const NamedValue<bool>> spectral_types() { return kSpectral; }
std::span<const NamedValue<AdaptiveType>> adaptive_types() { return kAdaptiveTypes; }
std::span<const LaboratoryRule> laboratory_rules() { return kLaboratoryRules; }
std::span<const NamedValue<Granularity>> granularities() { return kGranularities; }
std::span<const NamedValue<FilterType>> filters() { return kFilters; }
std::span<const NamedValue<FogType>> fog_types() { return kFogTypes; }
std::span<const NamedValue<BackgroundType>> backgrounds() { return kBackgrounds; }
std::span<const NamedValue<GroundType>> grounds() { return kGrounds; }
std::span<const NamedValue<ShadowColor>> shadow_colors() { return kShadowColors; }
std::span<const NamedValue<Units>> units() { return kUnits; }
std::span<const NamedValue<EnvironmentPreset>> environment_presets() { return kPresets; }
std::span<const NamedValue<CameraType>> camera_types() { return kCameraTypes; }
std::span<const NamedValue<DistortionModel>> distortion_models() { return kDistortionModels; }
std::span<const NamedValue<PoseConvention>> pose_conventions() { return kPoseConventions; }

}  // namespace core
