#include "core/scene/set_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "core/math/offset_ray.h"
#include "core/scene/placed_meshes.h"

namespace core {
namespace {

/// Triangles of a mesh, in all instances, that are looked at, evenly spread: decals and emitters
/// lie on something as a whole, and the time for meshes of leaves is bounded.
constexpr std::size_t kLookedAt = 256;
/// Of a mesh that is not moved: it may be small, and lie on the back of a large one that is.
constexpr std::size_t kLookedAtBehind = 16;
/// Two planes are parallel within a degree.
constexpr float kCosParallel = 0.9998477F;
/// A vertex moves at most so many times the distance, where its triangles differ in direction.
constexpr float kStretchMost = 4;

/// Meshes are in front of those of lower ranks. Solids that touch have rules of their own
/// (faces_at()).
enum class Rank { kOther, kEmits, kLetsPass };

Rank rank_of(const Material& m) {
  return m.is_volume                  ? Rank::kOther
         : m.has_alpha || m.transmits ? Rank::kLetsPass
         : m.is_emissive              ? Rank::kEmits
                                      : Rank::kOther;
}

/// A triangle in the world. n: of its front.
struct Face {
  Corners<Vec3> p;
  Vec3 n;
  float error_m = 0;

  Face(const SceneData& scene, const RawHit& hit) : p(scene.corners(hit)) {
    const PlacedInstance* instance =
        hit.instance == kNoInstance ? nullptr : &scene.instances[hit.instance];
    const Vec3 across = cross(p[1] - p[0], p[2] - p[0]);
    const float twice_area = length(across);
    const bool is_mirrored = instance != nullptr && instance->to_world.determinant() < 0;
    n = normalize_or(is_mirrored ? -across : across, {});
    error_m = face_error_m(p, twice_area, instance == nullptr ? InstanceError{} : instance->error);
  }

  bool is_flat() const { return dot(n, n) > 0; }
  /// The middle, and half of the way to each corner.
  std::array<Vec3, 4> points() const {
    const Vec3 middle = (p[0] + p[1] + p[2]) * (1.0F / 3);
    return {middle, (middle + p[0]) * 0.5F, (middle + p[1]) * 0.5F, (middle + p[2]) * 0.5F};
  }
  /// Returns whether a point of another triangle is a point of this one, in a
  /// parallel plane.
  bool has(Vec3 point, const Face& of) const {
    const float apart_m = error_m + of.error_m;
    if (std::fabs(dot(n, of.n)) < kCosParallel || std::fabs(dot(n, point - p[0])) > apart_m) {
      return false;
    }
    float least = 0;
    float most = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 edge = p[k == 2 ? 0 : k + 1] - p[k];
      const float inside = dot(normalize_or(cross(n, edge), {}), point - p[k]);
      least = k == 0 ? inside : std::min(least, inside);
      most = k == 0 ? inside : std::max(most, inside);
    }
    return least >= -apart_m || most <= apart_m;
  }
};

class Apart {
 public:
  Apart(SceneData& scene, float radius_m) : scene_(scene), radius_m_(radius_m) {}

  bool run() {
    const bool some_may_move =
        std::any_of(scene_.meshes.begin(), scene_.meshes.end(),
                    [this](const MeshData& mesh) { return rank(mesh) != Rank::kOther; });
    if (!some_may_move) {
      return false;
    }
    std::vector<std::size_t> left;
    for (const MeshData& mesh : scene_.meshes) {
      left.push_back(rank(mesh) == Rank::kOther ? kLookedAtBehind : kLookedAt);
    }
    for_each_placed(
        scene_, [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t geometry) {
          const std::uint32_t mesh = scene_.placed[placed].mesh;
          const std::size_t looked_at = std::min(scene_.meshes[mesh].triangle_count(), left[mesh]);
          left[mesh] -= looked_at;
          look_at(placed, instance, geometry, looked_at);
        });
    return move();
  }

 private:
  /// Of two meshes: how far apart they must be, on which side of the other's front the first is,
  /// and the scale of its instance.
  struct Contact {
    float apart_m = 0;
    float side = 0;
    float scale = std::numeric_limits<float>::max();
  };
  using Pair = std::pair<std::uint32_t, std::uint32_t>;

  Rank rank(const MeshData& mesh) const { return rank_of(scene_.materials[mesh.material]); }

  /// Returns whether a mesh is to be in front of another that it lies on. are_alike: their fronts
  /// are on one side. Two sheets back to back, as exporters write two-sided surfaces, remain one.
  bool is_before(std::uint32_t placed, std::uint32_t other, bool are_alike) const {
    const Rank here = rank(scene_.meshes[scene_.placed[placed].mesh]);
    const Rank there = rank(scene_.meshes[scene_.placed[other].mesh]);
    if (here != there || here == Rank::kOther) {
      return here > there;
    }
    return other < placed && (are_alike || here == Rank::kEmits);
  }

  float scale_of(std::uint32_t instance) const {
    if (instance == kNoInstance) {
      return 1;
    }
    const Transform& m = scene_.instances[instance].to_world;
    return std::min({length(m.x), length(m.y), length(m.z)});
  }

  /// Notes what the mesh lies on, and what lies on it.
  void look_at(std::uint32_t placed, std::uint32_t instance, std::uint32_t geometry,
               std::size_t looked_at) {
    const MeshData& mesh = scene_.meshes[scene_.placed[placed].mesh];
    const std::size_t count = mesh.triangle_count();
    for (std::size_t i = 0; i < looked_at; ++i) {
      const auto triangle = static_cast<std::uint32_t>(i * count / looked_at);
      const Face face(scene_, {0, instance, geometry, triangle});
      if (!face.is_flat()) {
        continue;
      }
      for (const Vec3 point : face.points()) {
        const float reach_m = face.error_m + kPlaneError * (taxicab(point) + 4 * radius_m_);
        scene_.accel->visit_near(point, reach_m, [&](const RawHit& at) {
          const PlacedMesh& near = scene_.placed_mesh(at);
          const auto other = static_cast<std::uint32_t>(&near - scene_.placed.data());
          const bool may_move =
              rank(mesh) != Rank::kOther || rank(scene_.meshes[near.mesh]) != Rank::kOther;
          if (other == placed || !may_move) {
            return true;
          }
          const Face there(scene_, at);
          if (!there.is_flat() || !there.has(point, face)) {
            return true;
          }
          const float side = dot(face.n, there.n);
          if (is_before(placed, other, side > 0)) {
            add(placed, other, face.error_m + there.error_m, side, scale_of(instance));
          } else if (is_before(other, placed, side > 0)) {
            add(other, placed, face.error_m + there.error_m, side, scale_of(at.instance));
          }
          return true;
        });
      }
    }
  }

  void add(std::uint32_t front, std::uint32_t behind, float error_m, float side, float scale) {
    if (front != scene_.ground && scene_.meshes[scene_.placed[front].mesh].later.empty()) {
      Contact& contact = contacts_[{scene_.placed[front].mesh, scene_.placed[behind].mesh}];
      contact.apart_m = std::max(contact.apart_m, 2 * error_m);
      contact.side += side;
      contact.scale = std::min(contact.scale, scale);
    }
  }

  /// Moves the meshes, those of lower ranks first, so that each knows where what it lies on is.
  bool move() {
    std::vector<float> moved_m(scene_.meshes.size());
    bool some = false;
    for (const Rank now : {Rank::kEmits, Rank::kLetsPass}) {
      for (std::uint32_t mesh = 0; mesh < scene_.meshes.size(); ++mesh) {
        if (rank(scene_.meshes[mesh]) != now) {
          continue;
        }
        float side = 0;
        float scale = std::numeric_limits<float>::max();
        for (auto at = contacts_.lower_bound({mesh, 0});
             at != contacts_.end() && at->first.first == mesh; ++at) {
          const Contact& contact = at->second;
          moved_m[mesh] = std::max(moved_m[mesh], moved_m[at->first.second] + contact.apart_m);
          side += contact.side;
          scale = std::min(scale, contact.scale);
        }
        if (moved_m[mesh] > 0) {
          some = true;
          // What emits on one side is seen from there; other meshes are seen where the front is of
          // what they lie on.
          const MaterialDescription& m = scene_.materials[scene_.meshes[mesh].material].factors;
          const bool is_by_own = now == Rank::kEmits && !m.emits_from_both_sides();
          shift(scene_.meshes[mesh],
                (is_by_own || side >= 0 ? moved_m[mesh] : -moved_m[mesh]) / scale);
        }
      }
    }
    return some;
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
  std::map<Pair, Contact> contacts_;
};

}  // namespace

bool set_apart(SceneData& scene, float radius_m) { return Apart(scene, radius_m).run(); }

}  // namespace core
