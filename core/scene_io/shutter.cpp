#include "core/scene_io/shutter.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace core {
namespace {

/// Maximum error of vertices relative to their displacement: a blur of 1000 pixels is accurate to
/// one.
constexpr float kOff = 1e-3F;

Error refused(std::string message) {
  return Error{ErrorCode::kInvalidArgument, std::move(message), "/shutter_seconds"};
}

bool is_same(const Transform& a, const Transform& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z && a.t == b.t;
}

/// Returns whether every `stride`th time after the first suffices: the others are nearly linear
/// between them. first: the positions at the first time.
bool serves(const std::vector<Vec3>& first, const std::vector<MovedVertices>& all,
            std::size_t stride) {
  for (std::size_t v = 0; v < first.size(); ++v) {
    const auto at = [&](std::size_t moment) {
      return moment == 0 ? first[v] : all[moment - 1].positions[v];
    };
    float way = 0;
    float off = 0;
    for (std::size_t moment = 1; moment <= all.size(); ++moment) {
      const std::size_t from = moment / stride * stride;
      const float part = static_cast<float>(moment - from) / static_cast<float>(stride);
      const Vec3 straight =
          part > 0 ? at(from) * (1 - part) + at(from + stride) * part : at(moment);
      way += length(at(moment) - at(moment - 1));
      off = std::max(off, length(at(moment) - straight));
    }
    if (off > kOff * way) {
      return false;
    }
  }
  return true;
}

std::vector<MovedVertices> fewest(const std::vector<Vec3>& first, std::vector<MovedVertices> all) {
  for (std::size_t stride = all.size(); stride > 1; stride /= 2) {
    if (serves(first, all, stride)) {
      std::vector<MovedVertices> some;
      for (std::size_t moment = stride; moment <= all.size(); moment += stride) {
        some.push_back(std::move(all[moment - 1]));
      }
      return some;
    }
  }
  return all;
}

/// An instance at one of the later times.
struct LaterInstance {
  const MeshDescription* mesh = nullptr;
  const Transform* to_world = nullptr;
};

/// Returns the vertices of a primitive in `then`, in the order of those now.
Result<MovedVertices> moved(const PrimitiveDescription& now, const PrimitiveDescription& then,
                            const Transform& to_world) {
  MovedVertices out;
  out.positions.reserve(now.positions.size());
  out.normals.reserve(now.normals.size());
  for (std::size_t v = 0; v < now.positions.size(); ++v) {
    const std::size_t file = now.file_vertices.empty() ? v : now.file_vertices[v];
    if (file >= then.positions.size() || (!now.normals.empty() && file >= then.normals.size())) {
      return refused("a mesh changes its vertices while the shutter is open");
    }
    out.positions.push_back(exact_point(to_world, then.positions[file]));
    if (!now.normals.empty()) {
      out.normals.push_back(normalize_or(to_world.normal(then.normals[file]), {0, 0, 1}));
    }
  }
  return out;
}

class Shutter {
 public:
  Shutter(SceneDescription& scene, std::span<const SceneDescription> later, std::size_t bytes_max)
      : scene_(scene), later_(later), bytes_left_(bytes_max), uses_(scene.meshes.size(), 0) {
    for (const InstanceDescription& instance : scene.instances) {
      ++uses_[static_cast<std::size_t>(instance.mesh)];
    }
    for (const SceneDescription& then : later) {
      auto& by_number = seen_.emplace_back();
      for (const InstanceDescription& instance : then.instances) {
        by_number[instance.instance] = {&then.meshes[static_cast<std::size_t>(instance.mesh)],
                                        &instance.to_world};
      }
    }
  }

  Status open() {
    for (const auto& by_number : seen_) {
      if (by_number.size() > scene_.instances.size()) {
        return appears();
      }
    }
    for (InstanceDescription& instance : scene_.instances) {
      if (Status status = open(instance); !status) {
        return status;
      }
    }
    for (const SceneDescription& then : later_) {
      if (Status status = check_lights(then); !status) {
        return status;
      }
      for (std::size_t i = 0; i < scene_.cameras.size(); ++i) {
        scene_.cameras[i].later.push_back(then.cameras[i].to_world);
      }
    }
    for (CameraDescription& camera : scene_.cameras) {
      if (std::all_of(camera.later.begin(), camera.later.end(),
                      [&](const Transform& t) { return is_same(t, camera.to_world); })) {
        camera.later.clear();
      }
    }
    return ok_status();
  }

 private:
  static Status appears() {
    return refused(
        "a mesh appears or disappears while the shutter is open (its scale or visibility is "
        "animated); choose a time at which it stays, or a shutter_seconds of 0");
  }

  Status open(InstanceDescription& instance) {
    const auto number = static_cast<std::size_t>(instance.mesh);
    MeshDescription& now = scene_.meshes[number];
    std::vector<std::vector<MovedVertices>> steps(now.primitives.size());
    bool moves = false;
    for (const auto& by_number : seen_) {
      const auto found = by_number.find(instance.instance);
      if (found == by_number.end() ||
          found->second.mesh->primitives.size() != now.primitives.size()) {
        return appears();
      }
      const LaterInstance& then = found->second;
      if ((then.to_world->determinant() < 0) != (instance.to_world.determinant() < 0)) {
        return refused("a mesh is turned inside out while the shutter is open");
      }
      for (std::size_t k = 0; k < steps.size(); ++k) {
        auto vertices = moved(now.primitives[k], then.mesh->primitives[k], *then.to_world);
        if (!vertices) {
          return vertices.error();
        }
        moves = moves || !is_at_rest(now.primitives[k], instance.to_world, *vertices);
        steps[k].push_back(*std::move(vertices));
      }
    }
    if (!moves) {
      return ok_status();
    }
    std::size_t bytes = 0;
    for (const PrimitiveDescription& p : now.primitives) {
      bytes += (p.positions.size() + p.normals.size()) * sizeof(Vec3) * kShutterSteps +
               p.indices.size() * sizeof(std::uint32_t);
    }
    if (bytes > bytes_left_) {
      return Error{ErrorCode::kTooLarge,
                   "geometry that moves while the shutter is open takes too much memory",
                   "/shutter_seconds"};
    }
    bytes_left_ -= bytes;
    MeshDescription own = uses_[number] > 1 ? now : std::move(now);
    for (std::size_t k = 0; k < steps.size(); ++k) {
      std::vector<Vec3> first = own.primitives[k].positions;
      for (Vec3& p : first) {
        p = exact_point(instance.to_world, p);
      }
      own.primitives[k].later = fewest(first, std::move(steps[k]));
    }
    if (uses_[number] == 1) {
      now = std::move(own);
      return ok_status();
    }
    --uses_[number];
    uses_.push_back(1);
    instance.mesh = static_cast<int>(scene_.meshes.size());
    scene_.meshes.push_back(std::move(own));
    return ok_status();
  }

  static bool is_at_rest(const PrimitiveDescription& now, const Transform& to_world,
                         const MovedVertices& then) {
    for (std::size_t v = 0; v < now.positions.size(); ++v) {
      if (!(exact_point(to_world, now.positions[v]) == then.positions[v])) {
        return false;
      }
    }
    return true;
  }

  Status check_lights(const SceneDescription& then) const {
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      if (i >= then.lights.size() || !is_same(scene_.lights[i].to_world, then.lights[i].to_world)) {
        return refused(
            "the light '" + scene_.lights[i].name +
            "' moves while the shutter is open; let an emissive mesh take its place, or " +
            "close the shutter with 0 seconds");
      }
    }
    return ok_status();
  }

  SceneDescription& scene_;
  std::span<const SceneDescription> later_;
  std::size_t bytes_left_;
  std::vector<int> uses_;                                               ///< instances of each mesh
  std::vector<std::unordered_map<std::uint32_t, LaterInstance>> seen_;  ///< by time and instance
};

}  // namespace

Status open_shutter(SceneDescription& scene, std::span<const SceneDescription> later,
                    std::size_t bytes_max) {
  return Shutter(scene, later, bytes_max).open();
}

}  // namespace core
