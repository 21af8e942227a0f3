/// Turns a job request into a renderer, without a server.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "api/job/job_spec.h"
#include "clients/cli/job_flags.h"
#include "core/base/result.h"
#include "core/render/picture/renderer.h"

namespace cli {

struct LocalJob {
  api::JobSpec spec;  ///< the effective spec
  std::vector<std::string> warnings;
  std::vector<core::Warning> warning_details;  ///< as in api::JobView
  std::shared_ptr<const core::Renderer> renderer;
};

/// Parses and checks the request given by the flags and the job file.
core::Result<api::ParsedJob> parse_local_job(const JobFlags& flags);

/// Reads the scene (a built-in name, or a .glb or .gltf file with its side files in the same
/// folder) and the environment, and prepares the view. Errors name the file, or the location in the
/// request or the scene.
core::Result<LocalJob> prepare_local_job(const JobFlags& flags, api::ParsedJob parsed, int threads);

}  // namespace cli
