/// FileInputs: the inputs of a job from files, for programs that render without a server's caches.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "api/job/view_of.h"
#include "core/image_io/image.h"
#include "core/scene_io/gltf_load.h"

namespace cli {

class FileInputs final : public api::ViewInputs {
 public:
  struct Sources {
    std::function<core::Result<core::SceneDescription>(const core::GltfOptions& options)> scene;
    std::function<core::Result<core::Image>(const std::string& asset)> environment;
  };
  struct Options {
    int threads = 1;            ///< for the acceleration structure
    std::string isa = {};       ///< as for core::Scene::build()
    std::stop_token stop = {};  ///< ends the loading
  };
  /// spec must outlive this.
  FileInputs(const api::JobSpec& spec, Sources sources, Options options);

  core::Result<Model> model() override;
  core::Result<std::shared_ptr<const core::Scene>> scene(core::Vec3 view_direction) override;
  core::Result<std::shared_ptr<const core::MotionTarget>> later(double time_seconds,
                                                                core::Place origin) override;
  core::Result<std::shared_ptr<const core::Environment>> environment(
      const std::optional<std::string>& asset, const core::EnvironmentSettings& settings) override;

 private:
  core::Result<core::SceneDescription> read(const core::SceneMoment& moment) const;

  const api::JobSpec& spec_;
  const Sources sources_;
  const Options options_;
  std::optional<core::SceneDescription> read_;  ///< by model(), if scene() needs the same
};

}  // namespace cli
