#include "core/scene/check_geometry.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace core {

Status check_geometry(const SceneDescription& scene) {
  std::vector<int> uses(scene.meshes.size(), 0);
  for (const InstanceDescription& instance : scene.instances) {
    if (instance.mesh >= 0 && instance.mesh < static_cast<int>(uses.size())) {
      ++uses[static_cast<std::size_t>(instance.mesh)];
    }
  }
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    for (std::size_t k = 0; k < scene.meshes[i].primitives.size(); ++k) {
      const PrimitiveDescription& p = scene.meshes[i].primitives[k];
      const std::string where = "/meshes/" + std::to_string(i) + "/primitives/" + std::to_string(k);
      const std::size_t n = p.positions.size();
      const auto fits = [n](std::size_t count) { return count == 0 || count == n; };
      if (!fits(p.normals.size()) || !fits(p.tangents.size()) || !fits(p.uv[0].size()) ||
          !fits(p.uv[1].size()) || !fits(p.colors.size())) {
        return Error{ErrorCode::kInvalidArgument, "the attributes have different lengths", where};
      }
      if (uses[i] != 1 && !p.later.empty()) {
        return Error{ErrorCode::kInvalidArgument, "a moving mesh must have exactly one instance",
                     where};
      }
      for (const MovedVertices& moved : p.later) {
        if (moved.positions.size() != n || moved.normals.size() != p.normals.size() ||
            !std::all_of(moved.positions.begin(), moved.positions.end(),
                         [](Vec3 v) { return is_finite(v); })) {
          return Error{ErrorCode::kInvalidArgument,
                       "a position while the shutter is open is missing or not finite", where};
        }
      }
      if (p.indices.size() % 3 != 0 || std::any_of(p.indices.begin(), p.indices.end(),
                                                   [n](std::uint32_t v) { return v >= n; })) {
        return Error{ErrorCode::kInvalidArgument, "an index is not below the number of vertices",
                     where + "/indices"};
      }
      if (std::any_of(p.positions.begin(), p.positions.end(),
                      [](Vec3 v) { return !is_finite(v); })) {
        return Error{ErrorCode::kInvalidArgument, "a position is not a finite number",
                     where + "/attributes/POSITION"};
      }
    }
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const InstanceDescription& instance = scene.instances[i];
    if (instance.mesh < 0 || instance.mesh >= static_cast<int>(scene.meshes.size())) {
      return Error{ErrorCode::kInvalidArgument, "an instance refers to a mesh that does not exist",
                   ""};
    }
    const Transform& m = instance.to_world;
    if (!is_finite(m.x) || !is_finite(m.y) || !is_finite(m.z) || !is_finite(m.t)) {
      return Error{ErrorCode::kInvalidArgument, "a transform is not finite", ""};
    }
  }
  return ok_status();
}

}  // namespace core
