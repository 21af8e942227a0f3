#include "clients/cli/file_inputs.h"

#include <utility>

#include "core/lights/made_environment.h"
#include "core/scene/drawn.h"
#include "core/scene/ground.h"

namespace cli {

FileInputs::FileInputs(const api::JobSpec& spec, Sources sources, Options options)
    : spec_(spec), sources_(std::move(sources)), options_(std::move(options)) {
  gltf_.time_seconds = spec.time_seconds;
  gltf_.shutter_seconds = spec.render.shutter_seconds;
  gltf_.variant = spec.variant;
  gltf_.limits.admit = core::until_stopped(options_.stop);
}

core::Status FileInputs::read() {
  if (!description_) {
    auto description = sources_.scene(gltf_);
    if (!description) {
      return description.error();
    }
    description_ = *std::move(description);
  }
  return core::ok_status();
}

core::Result<FileInputs::Model> FileInputs::model() {
  if (const core::Status is_read = read(); !is_read) {
    return is_read.error();
  }
  return Model{core::bounds_of(*description_), description_->origin, description_->cameras};
}

core::Result<std::shared_ptr<const core::Scene>> FileInputs::scene(core::Vec3 view_direction) {
  if (const core::Status is_read = read(); !is_read) {
    return is_read.error();
  }
  core::add_ground(*description_, spec_.render.ground, view_direction);
  auto scene =
      core::Scene::build(*std::move(description_), options_.threads, options_.isa, options_.stop);
  description_.reset();
  return scene;
}

core::Result<std::shared_ptr<const core::MotionTarget>> FileInputs::later(double time_seconds,
                                                                          core::Place origin) {
  core::GltfOptions options = gltf_;
  options.time_seconds = time_seconds;
  options.shutter_seconds = 0;
  options.geometry_only = true;
  options.origin = origin;
  auto later = sources_.scene(options);
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
