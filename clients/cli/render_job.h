/// From a job request to something that can be rendered here, without a server.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "api/job_spec.h"
#include "clients/cli/job_flags.h"
#include "core/base/result.h"
#include "core/render/render_task.h"

namespace cli {

struct LocalJob {
  api::JobSpec spec;  ///< what is in force
  std::vector<std::string> warnings;
  std::shared_ptr<const core::Renderer> renderer;
};

/// Adds the ground that the job asks for, as its camera sees it. Errors: those of the camera.
core::Status add_ground_of(const api::JobSpec& spec, core::SceneDescription& description);

/// The request that the flags and the job file stand for, checked.
core::Result<api::ParsedJob> parse_local_job(const JobFlags& flags);

/// Reads the scene (a built-in name, or a .glb or .gltf file whose side files lie in its folder)
/// and the environment, and prepares the view. Errors name the file, or the place in the request or
/// the scene.
core::Result<LocalJob> prepare_local_job(const JobFlags& flags, api::ParsedJob parsed, int threads);

}  // namespace cli
