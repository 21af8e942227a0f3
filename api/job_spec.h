/// JobSpec: a job request with every member in force.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/json.h"
#include "api/problem.h"
#include "core/camera/orbit.h"
#include "core/denoise/denoiser_type.h"
#include "core/scene/scene.h"
#include "core/settings/registry.h"
#include "core/settings/settings.h"

namespace api {

enum class JobClass { kNormal, kPreview };

/// The environment of the request. kAutomatic (key absent) lasts until the scene is
/// known: settle_environment() turns it into kGiven (white) or kBlack, or leaves it for a scene
/// that has an environment of its own.
enum class EnvironmentChoice { kAutomatic, kBlack, kGiven };

/// Where a job's events are sent, besides its stream.
struct Webhook {
  std::string url;
  std::vector<std::string> events = {"end"};  ///< of state, warning, end; in this order
  friend bool operator==(const Webhook&, const Webhook&) = default;
};

/// Layers that a job may leave out.
std::vector<std::string> recordable_layers();
/// Of these, what a job records that does not say.
std::vector<std::string> default_layers();

/// What is made of the picture on demand; no part of the film.
struct DenoiseSpec {
  core::DenoiserType type = core::DenoiserType::kAuto;
  bool preview = true;  ///< while the job renders, too
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
  /// To the second time of the layer `motion`; by default a frame of film.
  double motion_seconds = 1.0 / 24;
  JobClass job_class = JobClass::kNormal;
  std::optional<std::string> preview_key;
  EnvironmentChoice environment_choice = EnvironmentChoice::kAutomatic;
  core::EnvironmentSettings environment;         ///< counts when kGiven
  std::optional<std::string> environment_asset;  ///< sha256 (hex) of an asset; empty: constant
  /// Recorded layers as asked for, in the order of core::layers(); render.film has the switches.
  std::vector<std::string> layers = default_layers();
  DenoiseSpec denoise;
  std::optional<Webhook> webhook;
  std::optional<double> retention_seconds;  ///< deleted so long after its end; empty: kept
  core::RenderSettings render = core::default_settings(core::RenderSettings{}.integrator);
  core::StopRules stop = {.samples_per_pixel = 256,
                          .relative_error = {},
                          .confidence = 0.95,
                          .worst_tile = false,
                          .denoised_error = {},
                          .seconds = {},
                          .cpu_seconds = {},
                          .deadline_unix_seconds = {}};
};

struct ParsedJob {
  JobSpec spec;
  std::vector<std::string> warnings;  ///< values that are in force instead of what was asked
  int samples_by_error =
      0;  ///< an error ended the film that is made again, at so many samples per pixel; 0: none did
};

/// Begins the warning about a rounded samples_per_pixel.
inline constexpr std::string_view kSamplesWarning = "stop.samples_per_pixel: ";

/// POST /v1/jobs. Whether the scene, camera, variant and asset exist is not checked here.
/// Problems: 400, 413 (film too large, body too large), 422 with every wrong member.
Parsed<ParsedJob> parse_job(std::string_view body);

/// The whole spec in the shape of the request; parse_job(dump(to_json(spec))) gives spec back,
/// without warnings but those of idle_warnings(). `environment` is left out while it is kAutomatic.
Json to_json(const JobSpec& spec);
/// The same as text; what a store keeps.
std::string spec_json(const JobSpec& spec);

/// True when both say the same, member by member.
bool same_spec(const JobSpec& a, const JobSpec& b);

/// Warnings about adaptive sampling that has no effect on this job.
std::vector<std::string> adaptive_warnings(const JobSpec& spec);

/// Warnings about settings that have no effect; parse_job() adds them.
std::vector<std::string> idle_warnings(const JobSpec& spec);

/// The camera with its place on the orbit, if it has one. bounds: of the scene, world, metres.
core::CameraSettings camera_in(const JobSpec& spec, const core::Bounds& bounds);

/// The second time of the layer `motion`; empty: it is not recorded, or in the rest pose.
std::optional<double> later_seconds(const JobSpec& spec);

/// Equal for jobs whose cameras see the same geometry in films of the same size.
std::string sight_key(const JobSpec& spec);

/// The rule for an absent `environment`: the scene's own; else white, unless the scene has a
/// punctual light or a material with emissive strength above 1. Returns the warning that says so;
/// empty if it was settled before.
std::optional<std::string> settle_environment(JobSpec& spec, const core::SceneSummary& scene);

}  // namespace api
