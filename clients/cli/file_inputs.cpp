#include "clients/cli/file_inputs.h"

#include <utility>

#include "core/lights/made_environment.h"
#include "core/scene/drawn.h"
#include "core/scene/ground.h"

namespace cli {

FileInputs::FileInputs(const api::JobSpec& spec, Sources sources, Options options)
    : spec_(spec), sources_(std::move(sources)), options_(std::move(options)) {}

core::Result<core::SceneDescription> FileInputs::read(const core::SceneMoment& moment) const {
  core::GltfOptions options{moment};
  options.limits.admit = core::until_stopped(options_.stop);
  return sources_.scene(options);
}

core::Result<FileInputs::Model> FileInputs::model() {
  auto description = read(api::model_moment(spec_));
  if (!description) {
    return description.error();
  }
  Model model{core::bounds_of(*description), description->origin, description->cameras};
  if (spec_.render.shutter_seconds == 0) {
    read_ = *std::move(description);
  }
  return model;
}

core::Result<std::shared_ptr<const core::Scene>> FileInputs::scene(core::Vec3 view_direction) {
  auto description = read_ ? core::Result<core::SceneDescription>(*std::move(read_))
                           : read(api::scene_moment(spec_));
  read_.reset();
  if (!description) {
    return description.error();
  }
  core::add_ground(*description, spec_.render.ground, view_direction);
  return core::Scene::build(*std::move(description), options_.threads, options_.isa, options_.stop);
}

core::Result<std::shared_ptr<const core::MotionTarget>> FileInputs::later(double time_seconds,
                                                                          core::Place origin) {
  auto later = read(api::later_moment(spec_, time_seconds, origin));
  if (!later) {
    return later.error();
  }
  return std::make_shared<const core::MotionTarget>(*std::move(later));
}

core::Result<std::shared_ptr<const core::Environment>> FileInputs::environment(
    const std::optional<std::string>& asset, const core::EnvironmentSettings& settings) {
  if (!asset) {
    return core::make_environment(settings);
  }
  const auto image = sources_.environment(*asset);
  if (!image) {
    return image.error();
  }
  return core::Environment::create(&*image, settings);
}

}  // namespace cli
