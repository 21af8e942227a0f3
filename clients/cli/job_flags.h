/// Flags that describe a job, shared by `render` and `submit`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "clients/cli/look_flags.h"
#include "core/base/result.h"

namespace cli {

using Json = nlohmann::ordered_json;

struct JobFlags {
  std::string scene;        ///< built-in name, scene id, or a file; empty: the job file's
  std::string output;       ///< empty: none
  std::string exposure;     ///< for the output: stops or auto; empty: 0
  std::string denoise;      ///< for the output: off, mixed, full; empty: off
  std::string fireflies;    ///< of the output: set_aside, keep; empty: by its format
  LookFlags look;           ///< of the output
  std::string environment;  ///< .hdr or .exr file; empty: none
  std::string job_file;
  std::optional<int> samples_per_pixel;
  std::optional<double> relative_error;
  std::optional<double> denoised_error;
  std::optional<double> meter_error;
  std::optional<double> light_not_found;
  std::optional<double> seconds;
  std::optional<double> cpu_seconds;
  std::optional<std::string> size;  ///< "640x360", checked by the parser
  std::optional<std::string> camera;
  std::vector<double> position;  ///< three metres each, or empty
  std::vector<double> target;
  std::vector<double> orbit;  ///< theta and phi in degrees, and the radius in metres; or empty
  std::optional<double> fov_degrees;
  std::optional<double> aperture_radius_m;
  std::optional<double> focus_distance_m;
  std::optional<std::string> variant;
  std::optional<double> shutter_seconds;
  std::vector<int> crop;  ///< x, y, width, height in pixels; or empty
  std::optional<double> environment_rotation_degrees;
  std::optional<double> environment_intensity;
  bool is_transparent = false;
  bool has_opaque_glass = false;
  std::optional<std::string> preset;      ///< of the environment
  std::vector<std::string> sun;           ///< latitude, longitude, time; or empty
  std::optional<std::string> background;  ///< a type, or a colour as six digits of sRGB
  std::optional<std::string> ground;
  std::optional<double> ground_height;
  std::optional<double> ground_reflection;
  std::optional<std::string> shadow;
  std::optional<double> shadow_strength;
  std::optional<double> shadow_softness;
  std::optional<std::string> integrator;
  std::optional<std::string> sampler;
  std::optional<std::string> light_sampler;
  std::optional<std::string> mis;
  std::optional<std::string> roulette;
  std::optional<int> split;
  std::optional<std::string> control_variate;
  std::optional<std::string> adaptive;
  bool is_spectral = false;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  bool strict = false;  ///< refuse files that would be mended
  bool json = false;
};

/// scene_help: permitted values of SCENE.
void add_job_flags(CLI::App& app, JobFlags& flags, const std::string& scene_help);

/// Returns the job request: the job file's members, overridden by the flags. `scene` is flags.scene
/// (or the file's); the caller sets `environment.asset`. Values are checked when the request is
/// parsed.
core::Result<Json> make_request(const JobFlags& flags);

/// Returns the exit code for an error of make_request(): kFailed for a fault in a file, which
/// `where` names; otherwise wrong usage.
int request_fault_code(const core::Error& error, const JobFlags& flags);

/// --fireflies: set_aside or keep.
void add_fireflies_option(CLI::App& app, std::string& fireflies);
/// --exposure: a number of stops, or auto.
CLI::Option* add_exposure_option(CLI::App& app, std::string& exposure);
/// --denoise: off, mixed or full.
void add_denoise_option(CLI::App& app, std::string& denoise);

}  // namespace cli
