/// Flags that describe a job, shared by `render` and `submit`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "clients/cli/look_flags.h"
#include "clients/cli/member_flags.h"
#include "core/base/result.h"

namespace cli {

struct JobFlags {
  std::string scene;        ///< built-in name, scene id, or a file; empty: the job file's
  std::string output;       ///< empty: none
  std::string exposure;     ///< for the output: stops or auto; empty: 0
  std::string denoise;      ///< for the output: off, mixed, full; empty: off
  std::string fireflies;    ///< of the output: set_aside, keep; empty: by its format
  LookFlags look;           ///< of the output
  std::string environment;  ///< .hdr or .exr file; empty: none
  std::string job_file;
  MemberValues members;             ///< of the flags of member_flags.h
  std::optional<std::string> size;  ///< "640x360", checked by the parser
  std::optional<std::string> camera;
  std::vector<double> position;  ///< three metres each, or empty
  std::vector<double> target;
  std::vector<double> orbit;     ///< theta and phi in degrees, and the radius in metres; or empty
  std::vector<int> crop;         ///< x, y, width, height in pixels; or empty
  std::vector<std::string> sun;  ///< latitude, longitude, time; or empty
  std::optional<std::string> background;  ///< a type, or a colour as six digits of sRGB
  std::optional<int> split;
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
/// is_of_batch: the job may be a frame of a video.
void add_denoise_option(CLI::App& app, std::string& denoise, bool is_of_batch = false);

}  // namespace cli
