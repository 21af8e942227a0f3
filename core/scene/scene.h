/// Scene: geometry, materials, textures and lights, ready to be traced. Immutable once built;
/// shared by jobs. Camera and environment belong to the job (core::View).
#pragma once

#include <cstddef>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/math/bounds.h"

namespace core {

class SceneData;  // the parts the integrators use: core/scene/scene_data.h

/// The facts of a scene that GET /v1/scenes/{id} shows.
struct SceneSummary {
  std::string name;
  Bounds bounds;              ///< world, metres
  std::size_t triangles = 0;  ///< as placed: a mesh used twice counts twice
  std::size_t instances = 0;
  std::size_t bytes = 0;  ///< memory of geometry, acceleration structure and textures
  std::size_t emissive_triangles = 0;
  std::vector<CameraDescription> cameras;
  std::vector<PunctualLightDescription> lights;
  std::vector<std::string> materials;
  std::vector<std::string> variants;
  std::vector<std::string> animations;
  std::vector<std::string> extensions;
  std::vector<std::string> warnings;
  bool has_emissive_strength = false;
};

class Scene {
 public:
  /// Takes the description apart. threads: for the acceleration structure. isa: see Accel::build().
  /// Errors: kInvalidArgument (indices that do not fit), kTooLarge, kCancelled.
  static Result<std::shared_ptr<const Scene>> build(SceneDescription description, int threads,
                                                    std::string_view isa = {});
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const SceneSummary& summary() const noexcept { return summary_; }
  const SceneData& data() const noexcept { return *data_; }

 private:
  Scene();
  SceneSummary summary_;
  std::unique_ptr<SceneData> data_;
};

}  // namespace core
