/// From a job to its view: the same for the server, its workers and the command line, so that all
/// render the same bits.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/job/job_spec.h"
#include "core/aovs/motion.h"
#include "core/base/result.h"
#include "core/lights/environment.h"
#include "core/render/picture/view.h"
#include "core/scene/scene.h"
#include "core/scene/scene_moment.h"

namespace api {

/// What is read of the file of a job's scene.
core::SceneMoment scene_moment(const JobSpec& spec);
/// The same for ViewInputs::model(), which is of one moment: the one at which the shutter opens.
core::SceneMoment model_moment(const JobSpec& spec);
/// The same for the second time of motion vectors. origin: of the scene at the first.
core::SceneMoment later_moment(const JobSpec& spec, double time_seconds, core::Place origin);

/// Where the inputs of one job come from.
class ViewInputs {
 public:
  virtual ~ViewInputs() = default;
  /// The scene without the job's ground: what its camera is placed by.
  struct Model {
    core::Bounds bounds;
    core::Place origin;
    std::vector<core::CameraDescription> cameras;
  };
  virtual core::Result<Model> model() = 0;
  /// Returns the scene at the job's time, with its ground. view_direction: as for
  /// core::add_ground().
  virtual core::Result<std::shared_ptr<const core::Scene>> scene(core::Vec3 view_direction) = 0;
  /// Returns the scene at the second time of motion vectors.
  virtual core::Result<std::shared_ptr<const core::MotionTarget>> later(double time_seconds,
                                                                        core::Place origin) = 0;
  /// asset: an image; empty: made from the settings alone.
  virtual core::Result<std::shared_ptr<const core::Environment>> environment(
      const std::optional<std::string>& asset, const core::EnvironmentSettings& settings) = 0;
};

/// Returns the job's view, which is not settled yet (core/render/task/settle.h). An automatic
/// environment is resolved as by resolve_environment(). Errors: of the inputs, of the camera.
core::Result<core::View> view_of(const JobSpec& spec, ViewInputs& inputs);

}  // namespace api
