/// JobSpec: a job request with all defaults filled in.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/json/json.h"
#include "api/problem.h"
#include "core/camera/orbit.h"
#include "core/denoise/denoiser_type.h"
#include "core/integrators/registry.h"
#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace api {

enum class JobClass { kNormal, kPreview };

/// The environment of the request. kAutomatic (key absent) remains until the scene is known:
/// resolve_environment() turns it into kGiven (white) or kBlack, or keeps it for a scene that has
/// its own environment.
enum class EnvironmentChoice { kAutomatic, kBlack, kGiven };

/// Receiver of a job's events, besides its stream.
struct Webhook {
  std::string url;
  std::vector<std::string> events = {"end"};  ///< state, warning, end; in this order
  friend bool operator==(const Webhook&, const Webhook&) = default;
};

/// Returns the layers that a job may omit.
std::vector<std::string> recordable_layers();
/// Returns those of them that are recorded by default.
std::vector<std::string> default_layers();

/// Denoising on request; not part of the film.
struct DenoiseSpec {
  core::DenoiserType type = core::DenoiserType::kAuto;
  bool preview = true;  ///< also while the job renders
  friend bool operator==(const DenoiseSpec&, const DenoiseSpec&) = default;
};

struct JobSpec {
  std::string scene;  ///< scene id or name of a built-in scene
  std::string name;
  std::map<std::string, std::string> labels;
  int priority = 0;
  core::CameraSettings camera;
  std::optional<core::CameraOrbit> orbit;  ///< instead of the camera's position and target
  std::optional<std::string> variant;
  std::optional<double> time_seconds = 0;  ///< empty: the rest pose
  /// Time until the second moment of the layer `motion`; by default a frame at 24 per second.
  double motion_seconds = 1.0 / 24;
  JobClass job_class = JobClass::kNormal;
  std::optional<std::string> preview_key;
  EnvironmentChoice environment_choice = EnvironmentChoice::kAutomatic;
  core::EnvironmentSettings environment;         ///< used if kGiven
  std::optional<std::string> environment_asset;  ///< sha256 (hex) of an asset; empty: constant
  /// Recorded layers as requested, in the order of core::layers(); render.film has the switches.
  std::vector<std::string> layers = default_layers();
  /// Position in the request's film.layers of each of render.film.shares.
  std::vector<std::size_t> share_places;
  DenoiseSpec denoise;
  std::optional<Webhook> webhook;
  std::optional<double> retention_seconds;  ///< from the job's end to its deletion; empty: kept
  bool has_image = true;  ///< false: render.film is a single pixel, and only the meter counts
  core::RenderSettings render =
      core::default_settings(core::RenderSettings{}.integrator, core::kJobTerms);
  core::StopRules stop = {.samples_per_pixel = 256};
};

struct ParsedJob {
  JobSpec spec;
  std::vector<std::string> warnings;  ///< values in force that differ from the requested ones
  int samples_by_error = 0;  ///< samples per pixel chosen by the error estimate of the film that is
                             ///< rendered again; 0: fixed count
};

/// Begins the warning about a rounded samples_per_pixel.
inline constexpr std::string_view kSamplesWarning = "stop.samples_per_pixel: ";

/// POST /v1/jobs. Does not check whether the scene, camera, variant and asset exist. Problems: 400,
/// 413 (film too large, body too large), 422 with every invalid member.
Parsed<ParsedJob> parse_job(std::string_view body);

/// Returns the whole spec in the form of the request; parse_job(dump(to_json(spec))) returns spec,
/// without warnings except those of idle_warnings(). Omits `environment` while it is kAutomatic.
Json to_json(const JobSpec& spec);
/// Returns to_json() as text, for the store.
std::string spec_json(const JobSpec& spec);

/// Returns the pointer to one of render.film.shares in the request: "/film/layers/2".
std::string share_pointer(const JobSpec& spec, std::size_t share);

/// Returns whether both are equal, member by member.
bool same_spec(const JobSpec& a, const JobSpec& b);

/// Warnings about adaptive sampling that has no effect on this job.
std::vector<std::string> adaptive_warnings(const JobSpec& spec);

/// Warnings about settings that have no effect; parse_job() adds them.
std::vector<std::string> idle_warnings(const JobSpec& spec);

/// Returns the camera, placed on its orbit if it has one; its positions count from the scene's
/// origin. bounds: of the scene, from its origin, metres.
core::CameraSettings camera_in(const JobSpec& spec, const core::Bounds& bounds, core::Place origin);

/// Returns the second time of the layer `motion`; empty if it is not recorded, or in the rest pose.
std::optional<double> later_seconds(const JobSpec& spec);

/// Returns a key that is equal for jobs whose cameras see the same geometry in films of the same
/// size.
std::string sight_key(const JobSpec& spec);

/// Resolves an absent `environment`: the scene's own; otherwise white, unless the scene has a
/// punctual light or a material with emissive strength above 1. Returns the warning that reports
/// it; empty if it was resolved before.
std::optional<std::string> resolve_environment(JobSpec& spec, const core::SceneSummary& scene);

}  // namespace api
