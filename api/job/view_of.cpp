#include "api/job/view_of.h"

#include <utility>

#include "core/camera/camera.h"

namespace api {
namespace {

/// The wall of a sweep is behind the model as the camera sees it, and the camera may depend on the
/// model. Other grounds are the same from all directions.
core::Result<core::Vec3> view_direction_of(const JobSpec& spec, ViewInputs& inputs) {
  if (spec.render.ground.type != core::GroundType::kSweep) {
    return core::Vec3{0, 0, -1};
  }
  const auto model = inputs.model();
  if (!model) {
    return model.error();
  }
  const auto camera =
      core::Camera::create(camera_in(spec, model->bounds, model->origin), model->cameras,
                           model->bounds, spec.render.film.width, spec.render.film.height);
  if (!camera) {
    return camera.error();
  }
  return camera->forward();
}

}  // namespace

core::SceneMoment model_moment(const JobSpec& spec) {
  core::SceneMoment moment;
  moment.time_seconds = spec.time_seconds;
  moment.variant = spec.variant;
  return moment;
}

core::SceneMoment scene_moment(const JobSpec& spec) {
  core::SceneMoment moment = model_moment(spec);
  moment.shutter_seconds = spec.render.shutter_seconds;
  return moment;
}

core::SceneMoment later_moment(const JobSpec& spec, double time_seconds, core::Place origin) {
  core::SceneMoment moment = model_moment(spec);
  moment.time_seconds = time_seconds;
  moment.geometry_only = true;
  moment.origin = origin;
  return moment;
}

core::Result<core::View> view_of(const JobSpec& spec, ViewInputs& inputs) {
  const auto view_direction = view_direction_of(spec, inputs);
  if (!view_direction) {
    return view_direction.error();
  }
  auto scene = inputs.scene(*view_direction);
  if (!scene) {
    return scene.error();
  }
  const core::SceneSummary& summary = (*scene)->summary();
  core::View view;
  view.camera = camera_in(spec, summary.bounds, summary.origin);
  view.settings = spec.render;
  if (const auto seconds = later_seconds(spec)) {
    auto later = inputs.later(*seconds, summary.origin);
    if (!later) {
      return later.error();
    }
    view.later = *std::move(later);
  }
  JobSpec settled = spec;
  resolve_environment(settled, summary);
  if (settled.environment_choice == EnvironmentChoice::kAutomatic) {
    view.environment = (*scene)->environment();
  } else if (settled.environment_choice == EnvironmentChoice::kGiven) {
    auto environment = inputs.environment(settled.environment_asset, settled.environment);
    if (!environment) {
      return environment.error();
    }
    view.environment = *std::move(environment);
  }
  view.scene = *std::move(scene);
  return view;
}

}  // namespace api
