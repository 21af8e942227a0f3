/// Scene: geometry, materials, textures and lights, ready to be traced. Immutable once built;
/// shared by jobs. The camera belongs to the job (core::View), and so does the environment: that of
/// the scene is used when the job has none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/math/bounds.h"

namespace core {

class Environment;
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
  std::vector<ObjectDescription> objects;      ///< by id
  std::vector<std::uint32_t> mesh_primitives;  ///< of each mesh of the file
  std::vector<std::string> light_groups;
  std::vector<std::string> variants;
  std::vector<std::string> animations;
  std::vector<std::string> extensions;
  std::vector<std::string> warnings;
  bool has_emissive_strength = false;
  bool has_environment = false;  ///< of its own
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
  /// The scene's own environment, for jobs that give none; null when it has none.
  const std::shared_ptr<const Environment>& environment() const noexcept { return environment_; }

 private:
  Scene();
  SceneSummary summary_;
  std::unique_ptr<SceneData> data_;
  std::shared_ptr<const Environment> environment_;
};

}  // namespace core
