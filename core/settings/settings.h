/// Render settings: plain values; core/integrators/rules.h says what goes together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/color/rgb.h"
#include "core/math/place.h"
#include "core/math/vec.h"
#include "core/settings/camera_settings.h"

namespace core {

/// A rectangle of pixels of the full film; half-open.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend constexpr bool operator==(const PixelRect&, const PixelRect&) = default;
};

enum class FilterType { kBox, kTent, kGaussian, kMitchell, kBlackmanHarris };

struct FilterSettings {
  FilterType type = FilterType::kBlackmanHarris;
  float radius_px = 1.5F;
};

/// Vertex counts of a path's subpaths: s from the light, t from the camera, including the end
/// points.
struct SubpathLengths {
  int light = 0;
  int camera = 0;
  friend bool operator==(const SubpathLengths&, const SubpathLengths&) = default;
};

/// A plane of light that a film records besides the image. A layer `bounce:N`, `light:NAME` or
/// `st:S,T` is a part of the image; `irradiance` is the irradiance of the first surfaces.
struct LightShare {
  std::string layer;
  int first_bounce = 0;  ///< range of scattering counts of the paths, inclusive
  int last_bounce = std::numeric_limits<int>::max();
  std::optional<std::string> group;        ///< group of the lights; empty: all
  std::optional<SubpathLengths> strategy;  ///< strategy that makes the paths; empty: any
  bool is_weighted = true;                 ///< false: as if that strategy were the only one
  bool is_irradiance = false;
  bool is_part() const noexcept { return is_weighted && !is_irradiance; }
  friend bool operator==(const LightShare&, const LightShare&) = default;
};

struct FilmSettings {
  int width = 960;
  int height = 540;
  std::optional<PixelRect> crop;
  FilterSettings filter;
  /// Recorded auxiliary layers: albedo, normal, depth. Other layers cost nothing.
  bool albedo = true;
  bool normal = true;
  bool depth = true;
  std::vector<LightShare> shares;
  /// From the ray through the pixel's centre.
  bool object = false;
  bool instance = false;
  bool material = false;
  bool primitive = false;
  bool position = false;
  bool uv = false;
  bool motion = false;
  bool z_depth = false;
  bool object_mattes = false;  ///< Cryptomatte
  bool material_mattes = false;
  /// Errors are those of the image over white (radiance 1), for images with noise in alpha.
  bool errors_over_white = false;

  /// Returns the pixels that are rendered: the crop, or all.
  PixelRect area() const noexcept { return crop.value_or(PixelRect{0, 0, width, height}); }
  bool has_aux() const noexcept { return albedo || normal || depth; }
  bool has_first_hits() const noexcept {
    return object || instance || material || primitive || position || uv || motion;
  }
};

enum class Strategy { kMis, kLight, kBsdf, kCosine, kUniform };
enum class MisType { kBalance, kPower, kMaximum, kOptimal };
enum class RouletteType { kNone, kThroughput, kThreshold };
enum class SplittingType { kNone, kFixed, kMeasured };
enum class SamplerType {
  kIndependent,
  kAntithetic,
  kStratified,
  kLatinHypercube,
  kOrthogonalArray,
  kHalton,
  kSobol,
  kZsobol
};
/// Whether the errors of neighbouring pixels are independent. If not, variances do not add up over
/// a block.
enum class PixelErrors { kIndependent, kCorrelated };
/// kMeasured: settle() replaces it by kTree or kRis.
enum class LightSamplerType { kUniform, kPower, kTree, kRis, kRestir, kMeasured };
/// How a light sample depends on others. How each of them is picked: light_pick() of
/// core/light_samplers/light_sampler.h.
enum class LightReuse {
  kNone,
  kResample,  ///< one of several candidates of the path
  kShare      ///< at the first surface one of the samples of several paths
};
constexpr LightReuse light_reuse(LightSamplerType type) noexcept {
  return type == LightSamplerType::kRis      ? LightReuse::kResample
         : type == LightSamplerType::kRestir ? LightReuse::kShare
                                             : LightReuse::kNone;
}

enum class ControlVariateType { kNone, kAnalytic, kRegression };

struct EstimatorSettings {
  Strategy strategy = Strategy::kMis;
  MisType mis = MisType::kPower;
  float mis_exponent = 2;
  RouletteType roulette = RouletteType::kThroughput;
  float roulette_delta =
      0.02F;  ///< threshold: smallest light whose shadow ray is always traced [W/(m^2 sr)]
  SplittingType splitting = SplittingType::kNone;
  int split_count = 2;  ///< fixed: continuations of a path at its first surface
  bool expected_values = true;
  ControlVariateType control_variate = ControlVariateType::kNone;
};

enum class AdaptiveType { kNone, kPilot };
enum class Granularity { kPixel, kTile };

/// Adaptive sampling. Counts are uniform, or follow a pilot stream that never enters the image.
struct AdaptiveSettings {
  AdaptiveType type = AdaptiveType::kNone;
  int min_samples = 32;  ///< per pixel before the first decision, summed over replicates
  Granularity granularity = Granularity::kPixel;
  int dilation = 1;  ///< radius in pixels (tiles with kTile) over which the maximum need is taken
};

/// Whether `path` traces photons of caustics, which makes it the integrator `path-caustics`.
enum class CausticsType { kOff, kOn, kAuto };

/// Photon mapping: integrators `sppm` and `photon-map`.
struct PhotonSettings {
  int paths = 0;           ///< particles per sample of the pixels; 0: photon_paths()
  float radius_m = 0;      ///< initial radius of the gather disks; 0: three pixels wide
  float alpha = 2.0F / 3;  ///< sppm: disk areas fall as N^(alpha - 1)
  int final_gather = 1;    ///< photon-map: directions of final gathering; 0: looks up the map
                           ///< directly
};

/// Integrator `irradiance-cache`.
struct CacheSettings {
  float tolerance = 0.25F;  ///< allowed relative error of interpolation
  int rays = 256;           ///< paths over the hemisphere per record
  int records = 1 << 15;    ///< maximum per replicate
};

enum class FogType { kHomogeneous };

/// A medium that fills the bounding sphere of the scene. Coefficients at height 0 [1/m].
struct FogSettings {
  FogType type = FogType::kHomogeneous;
  Rgb scattering;
  Rgb absorption;
  float g = 0;               ///< mean cosine of the scattering angle
  float height_falloff = 0;  ///< density falls with exp(-height_falloff * y) [1/m]
};

/// A point at which irradiance is measured, on the side that `normal` faces.
struct MeterPoint {
  Place position;  ///< world [m]
  Vec3 normal;     ///< of any nonzero length
  friend bool operator==(const MeterPoint&, const MeterPoint&) = default;
};

/// Meter points at the centres of a rectangle's cells, facing along edge_u x edge_v. World [m].
struct MeterPlane {
  Place origin;
  Vec3 edge_u;
  Vec3 edge_v;
  int columns = 0;  ///< along edge_u
  int rows = 0;
};

struct MeterSettings {
  std::vector<MeterPoint> points;
  std::optional<MeterPlane> plane;

  bool empty() const noexcept { return points.empty() && !plane; }
  std::size_t count() const noexcept {
    return points.size() +
           (plane ? static_cast<std::size_t>(plane->columns) * static_cast<std::size_t>(plane->rows)
                  : 0);
  }
};

enum class BackgroundType { kEnvironment, kTransparent, kColor, kBlurred };

/// The background of camera rays that leave the scene. Mirrors still show the environment.
struct BackgroundSettings {
  BackgroundType type = BackgroundType::kEnvironment;
  Rgb color = {1, 1, 1};  ///< radiance, for kColor
  /// Clear surfaces (core/lights/backdrop.h) show the background, not the environment.
  bool through_glass = false;
};

enum class GroundType { kNone, kCatcher, kSweep };

enum class ShadowColor { kNeutral, kPhysical };

/// The shadow on a catcher (core/integrators/path/catcher.h).
struct ShadowSettings {
  ShadowColor color = ShadowColor::kNeutral;
  float strength = 1;  ///< factor of the blocked light, in [0,1]
  float softness = 0;  ///< sine of the angle by which every light is widened, in [0,1]
};

/// Something for the model to stand on, horizontal and diffuse, with or without a polished coat.
struct GroundSettings {
  GroundType type = GroundType::kNone;
  std::optional<float> height_m;  ///< y; empty: the lowest point of the model
  Rgb color = {0.8F, 0.8F, 0.8F};
  float reflection = 0;        ///< weight of a smooth clear coat, in [0,1]
  ShadowSettings shadow = {};  ///< for kCatcher
};

/// The unit of radiance (core/color/photometry.h).
enum class Units { kPhotometric };

struct RenderSettings {
  FilmSettings film;
  std::string integrator = "path";
  int max_depth = 16;
  CausticsType caustics = CausticsType::kOff;
  EstimatorSettings estimator;
  SamplerType sampler = SamplerType::kSobol;
  int replicates = 2;       ///< even, at least 2
  int first_replicate = 0;  ///< index within the seed; even. Jobs with other replicates share no
                            ///< samples
  LightSamplerType light_sampler = LightSamplerType::kTree;
  int light_candidates = 2;  ///< ris: light samples, one of which is chosen
  int light_block = 3;       ///< restir: side of the squares of pixels that share light samples
  int light_history =
      1;  ///< restir: consecutive samples of a replicate that also share light samples
  int block_candidates = 1;  ///< restir: light samples per path, one of which is shared
  AdaptiveSettings adaptive;
  PhotonSettings photons;
  CacheSettings cache;
  std::optional<FogSettings> fog;
  MeterSettings meter;
  BackgroundSettings background;
  GroundSettings ground;
  bool spectral = false;       ///< paths carry wavelengths instead of RGB
  double shutter_seconds = 0;  ///< exposure time; motion during it is blurred
  Units units = Units::kPhotometric;
  std::uint64_t seed = 0;
};

/// Stop rules; the first one met ends the job. Error targets are met only where light_not_found,
/// if given, is met too.
struct StopRules {
  std::optional<int> samples_per_pixel = {};
  std::optional<double> relative_error = {};
  double confidence = 0.95;
  bool worst_tile = false;
  std::optional<double> denoised_error = {};  ///< of the mixed denoised image
  std::optional<double> seconds = {};         ///< rendering time, without pauses and downtime
  std::optional<double> cpu_seconds = {};     ///< summed over all threads
  std::optional<double> deadline_unix_seconds = {};
  std::optional<double> meter_error = {};      ///< of the meter's worst point: meter_error()
  std::optional<double> light_not_found = {};  ///< LightNotFound::at_most
  bool has_error_target() const noexcept {
    return relative_error.has_value() || denoised_error.has_value();
  }
};

enum class StopReason {
  kNone,
  kSamples,
  kRelativeError,
  kDenoisedError,
  kSeconds,
  kCpuSeconds,
  kDeadline,
  kMeterError,
  kLightNotFound,
  kLimit,
  kCancelled,
  kFailed
};

constexpr bool is_by_error(StopReason reason) {
  return reason == StopReason::kRelativeError || reason == StopReason::kDenoisedError ||
         reason == StopReason::kMeterError || reason == StopReason::kLightNotFound;
}

enum class EnvironmentPreset { kStudio, kTent, kRim };

/// Place and time for the position of the sun.
struct SunSettings {
  double latitude_degrees = 0;   ///< north is positive
  double longitude_degrees = 0;  ///< east is positive
  double unix_seconds = 0;
};

/// The environment of a job: a decoded image, a preset, the sky model or a constant.
struct EnvironmentSettings {
  Rgb color = {1, 1, 1};
  float intensity = 1;
  float rotation_degrees = 0;
  std::optional<EnvironmentPreset> preset;
  std::optional<SunSettings> sun;  ///< with its sky
};

}  // namespace core
