#include "core/scene/set_apart.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/math/offset_ray.h"

namespace core {
namespace {

/// Triangles of a mesh that are looked at, evenly spread: decals and emitters lie on something as a
/// whole, and the time for meshes of leaves is bounded.
constexpr std::size_t kLookedAt = 1024;
/// Two planes are parallel within a degree.
constexpr float kCosParallel = 0.9998477F;
/// A vertex moves at most so many times the distance, where its triangles differ in direction.
constexpr float kStretchMost = 4;

bool lets_pass(const Material& m) { return m.has_alpha || (m.transmits && !m.is_volume); }

/// A triangle in the world. n: of its front.
struct Face {
  Corners<Vec3> p;
  Vec3 n;
  Vec3 middle;
  float error_m = 0;

  Face(const SceneData& scene, const RawHit& hit) : p(scene.corners(hit)) {
    const PlacedInstance* instance =
        hit.instance == kNoInstance ? nullptr : &scene.instances[hit.instance];
    const Vec3 across = cross(p[1] - p[0], p[2] - p[0]);
    const float twice_area = length(across);
    const bool is_mirrored = instance != nullptr && instance->to_world.determinant() < 0;
    n = normalize_or(is_mirrored ? -across : across, {});
    middle = (p[0] + p[1] + p[2]) * (1.0F / 3);
    for (const Vec3 corner : p) {
      error_m =
          std::max(error_m, plane_error_m(corner, p[1] - p[0], p[2] - p[0], twice_area,
                                          instance == nullptr ? InstanceError{} : instance->error));
    }
  }

  bool is_flat() const { return dot(n, n) > 0; }
  /// Returns whether the middle of this triangle is a point of the other.
  bool lies_on(const Face& other) const {
    const float apart_m = error_m + other.error_m;
    if (std::fabs(dot(n, other.n)) < kCosParallel ||
        std::fabs(dot(other.n, middle - other.p[0])) > apart_m) {
      return false;
    }
    float least = 0;
    float most = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 edge = other.p[k == 2 ? 0 : k + 1] - other.p[k];
      const float inside = dot(normalize_or(cross(other.n, edge), {}), middle - other.p[k]);
      least = k == 0 ? inside : std::min(least, inside);
      most = k == 0 ? inside : std::max(most, inside);
    }
    return least >= -apart_m || most <= apart_m;
  }
};

/// How far to move a mesh, to the front of its triangles or, if negative, to the back.
using Move = std::optional<float>;

class Apart {
 public:
  Apart(SceneData& scene, float radius_m)
      : scene_(scene), radius_m_(radius_m), moved_m_(scene.meshes.size()) {}

  bool run() {
    bool some = false;
    std::vector<bool> is_done(scene_.meshes.size());
    std::size_t begun = 0;  // instances whose meshes begin at or before `placed`
    for (std::uint32_t placed = 0; placed < scene_.placed.size(); ++placed) {
      while (begun < scene_.instances.size() && scene_.instances[begun].first_placed <= placed) {
        ++begun;
      }
      const std::uint32_t mesh = scene_.placed[placed].mesh;
      if (is_done[mesh] || placed == scene_.ground) {
        continue;
      }
      is_done[mesh] = true;
      const auto instance = begun == 0 ? kNoInstance : static_cast<std::uint32_t>(begun - 1);
      if (const Move move = move_of(placed, instance)) {
        moves_.push_back({mesh, instance, *move});
        moved_m_[mesh] = std::fabs(*move);
        some = true;
      }
    }
    for (const auto& [mesh, instance, move_m] : moves_) {
      const float scale = instance == kNoInstance ? 1 : least_scale(scene_.instances[instance]);
      shift(scene_.meshes[mesh], move_m / scale);
    }
    return some;
  }

 private:
  struct Moved {
    std::uint32_t mesh;
    std::uint32_t instance;
    float move_m;
  };

  static float least_scale(const PlacedInstance& instance) {
    const Transform& m = instance.to_world;
    return std::min({length(m.x), length(m.y), length(m.z)});
  }

  /// Returns whether a mesh is to be in front of another that it lies on.
  bool is_before(std::uint32_t placed, std::uint32_t other) const {
    const auto material = [this](std::uint32_t of) -> const Material& {
      return scene_.materials[scene_.meshes[scene_.placed[of].mesh].material];
    };
    const Material& here = material(placed);
    const Material& there = material(other);
    if (lets_pass(here)) {
      return !lets_pass(there) || other < placed;
    }
    return !lets_pass(there) && (!there.is_emissive || other < placed);
  }

  Move move_of(std::uint32_t placed, std::uint32_t instance) const {
    const MeshData& mesh = scene_.meshes[scene_.placed[placed].mesh];
    const Material& material = scene_.materials[mesh.material];
    if (!(lets_pass(material) || material.is_emissive) || !mesh.later.empty()) {
      return {};
    }
    const std::uint32_t geometry =
        instance == kNoInstance ? placed : placed - scene_.instances[instance].first_placed;
    float move_m = 0;
    float side = 0;
    const std::size_t count = mesh.triangle_count();
    const std::size_t looked_at = std::min(count, kLookedAt);
    for (std::size_t i = 0; i < looked_at; ++i) {
      const auto triangle = static_cast<std::uint32_t>(i * count / looked_at);
      const Face face(scene_, {0, instance, geometry, triangle});
      if (!face.is_flat()) {
        continue;
      }
      const float reach_m = face.error_m + kPlaneError * (taxicab(face.middle) + 4 * radius_m_);
      scene_.accel->visit_near(face.middle, reach_m, [&](const RawHit& at) {
        const auto number =
            static_cast<std::uint32_t>(&scene_.placed_mesh(at) - scene_.placed.data());
        const Face other(scene_, at);
        if (number != placed && is_before(placed, number) && other.is_flat() &&
            face.lies_on(other)) {
          move_m = std::max(
              move_m, moved_m_[scene_.placed[number].mesh] + 2 * (face.error_m + other.error_m));
          side += dot(face.n, other.n);
        }
        return true;
      });
    }
    if (move_m == 0) {
      return {};
    }
    // What emits on one side is seen from there; other meshes are seen where the front is of what
    // they lie on.
    const bool is_by_own =
        !lets_pass(material) && !material.factors.double_sided && !material.factors.unlit;
    return is_by_own || side >= 0 ? move_m : -move_m;
  }

  /// Moves the triangles of a mesh along their normals.
  static void shift(MeshData& mesh, float by) {
    const std::size_t count = mesh.positions.size() - 1;
    const auto normal = [&mesh](std::size_t triangle) {
      const auto at = [&](std::size_t k) { return mesh.positions[mesh.indices[3 * triangle + k]]; };
      return cross(at(1) - at(0), at(2) - at(0));
    };
    std::vector<Vec3> direction(count);
    std::vector<Vec3> of_triangle(mesh.triangle_count());
    for (std::size_t t = 0; t < of_triangle.size(); ++t) {
      of_triangle[t] = normalize_or(normal(t), {});
      for (std::size_t k = 0; k < 3; ++k) {
        direction[mesh.indices[3 * t + k]] += normal(t);
      }
    }
    std::vector<float> stretch(count, 1);
    for (Vec3& d : direction) {
      d = normalize_or(d, {});
    }
    for (std::size_t t = 0; t < of_triangle.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh.indices[3 * t + k];
        const float cosine = dot(direction[v], of_triangle[t]);
        stretch[v] = std::max(stretch[v], 1 / std::max(cosine, 1 / kStretchMost));
      }
    }
    for (std::size_t v = 0; v < count; ++v) {
      mesh.positions[v] = mesh.positions[v] + direction[v] * (by * stretch[v]);
    }
  }

  SceneData& scene_;
  float radius_m_;
  std::vector<float> moved_m_;  ///< by mesh
  std::vector<Moved> moves_;
};

}  // namespace

bool set_apart(SceneData& scene, float radius_m) { return Apart(scene, radius_m).run(); }

}  // namespace core
