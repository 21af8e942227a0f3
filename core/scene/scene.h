/// Scene: geometry, materials, textures and lights, ready for rendering. Immutable once built and
/// shared by jobs. Camera and environment belong to the job (core::View); the scene's own
/// environment is used if the job has none.
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
class SceneData;  // the parts for integrators: core/scene/scene_data.h

/// The properties of a scene that GET /v1/scenes/{id} returns.
struct SceneSummary {
  std::string name;
  Place origin;                ///< SceneDescription::origin
  Bounds bounds;               ///< from the origin, metres; over the whole animation
  std::vector<Vec3> extremes;  ///< Extreme points of the model, likewise; framing reads them.
  std::size_t triangles = 0;   ///< counted per instance: a mesh used twice counts twice
  std::size_t instances = 0;
  std::size_t bytes = 0;  ///< geometry, acceleration structure and textures
  std::size_t emissive_triangles = 0;
  std::vector<CameraDescription> cameras;
  std::vector<PunctualLightDescription> lights;
  std::vector<std::string> materials;
  std::vector<ObjectDescription> objects;      ///< by id
  std::vector<std::uint32_t> mesh_primitives;  ///< of each mesh in the file
  std::vector<std::string> light_groups;
  std::vector<std::string> variants;
  std::vector<std::string> animations;
  std::vector<std::string> extensions;
  std::vector<Warning> warnings;
  bool has_emissive_strength = false;
  bool has_environment = false;  ///< the file has an environment
  bool has_scattering = false;   ///< of the interior of a solid
  bool has_dispersion = false;
};

class Scene {
 public:
  /// Builds a scene and consumes the description. threads: for the acceleration structure. isa: see
  /// Accel::build(). Errors: kInvalidArgument (indices out of range), kTooLarge, kCancelled (stop
  /// was requested).
  static Result<std::shared_ptr<const Scene>> build(SceneDescription description, int threads,
                                                    std::string_view isa = {},
                                                    const std::stop_token& stop = {});
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const SceneSummary& summary() const noexcept { return summary_; }
  const SceneData& data() const noexcept { return *data_; }
  /// Returns the scene's own environment, for jobs without one; null if it has none.
  const std::shared_ptr<const Environment>& environment() const noexcept { return environment_; }

 private:
  Scene();
  SceneSummary summary_;
  std::unique_ptr<SceneData> data_;
  std::shared_ptr<const Environment> environment_;
};

}  // namespace core
