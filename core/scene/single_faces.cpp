#include "core/scene/single_faces.h"

#include <algorithm>
#include <cmath>

#include "core/math/offset_ray.h"

namespace core {
namespace {

constexpr float kCosTilt = 0.8660254F;  // 30 degrees

/// A face near more triangles than these, as each of many long strips is, is not known to be
/// single: the time for all faces is bounded. A vertex of a regular mesh has six.
constexpr int kNearMost = 64;

/// Faces of one step: a multiple of the bits of a word, so that steps write words of their own.
constexpr std::size_t kPart = 4096;

/// A triangle of a solid, and how far faces_at() looks from its points for other faces.
class Face {
 public:
  Face(const SceneData& scene, const RawHit& hit) : p_(scene.corners(hit)) {
    const Vec3 n = cross(p_[1] - p_[0], p_[2] - p_[0]);
    const float twice_area = length(n);
    is_flat_ = twice_area > 0;
    n_ = n * (1 / twice_area);
    const InstanceError error =
        hit.instance == kNoInstance ? InstanceError{} : scene.instances[hit.instance].error;
    middle_ = (p_[0] + p_[1] + p_[2]) * (1.0F / 3);
    for (const Vec3 corner : p_) {
      const float step_m = plane_error_m(corner, p_[1] - p_[0], p_[2] - p_[0], twice_area, error);
      reach_m_ = std::max(reach_m_, step_m + kPlaneError * (taxicab(corner) + 4 * scene.radius_m));
      radius_m_ = std::max(radius_m_, length(corner - middle_));
    }
  }

  bool is_flat() const { return is_flat_; }
  float reach_m() const { return reach_m_; }
  Vec3 middle() const { return middle_; }
  /// Of a ball with everything that is_off() could refuse.
  float radius_m() const { return radius_m_ + 4 * reach_m_; }

  /// Returns whether a triangle is off the plane, or a plane that is at 30 degrees or more to it
  /// separates both. The disc around a point of the face up to its nearest edge is then on one side
  /// of that plane, so the point is at least half as far from the triangle as from the edge.
  bool is_off(const Corners<Vec3>& other) const {
    const auto heights = [&](Vec3 axis, const Corners<Vec3>& of) {
      return std::minmax(
          {dot(of[0] - p_[0], axis), dot(of[1] - p_[0], axis), dot(of[2] - p_[0], axis)});
    };
    const auto [low, high] = heights(n_, other);
    if (low > 2 * reach_m_ || high < -2 * reach_m_) {
      return true;
    }
    const auto separates = [&](Vec3 across) {
      const Vec3 axis = normalize_or(across, n_);
      const auto here = heights(axis, p_);
      const auto there = heights(axis, other);
      return std::fabs(dot(axis, n_)) <= kCosTilt &&
             (here.first >= there.second - reach_m_ || there.first >= here.second - reach_m_);
    };
    const Vec3 its_n = cross(other[1] - other[0], other[2] - other[0]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = k == 2 ? 0 : k + 1;
      if (separates(cross(n_, p_[next] - p_[k])) ||
          separates(cross(its_n, other[next] - other[k]))) {
        return true;
      }
    }
    return separates(its_n);
  }

 private:
  Corners<Vec3> p_;
  Vec3 n_;
  Vec3 middle_;
  bool is_flat_ = false;
  float reach_m_ = 0;
  float radius_m_ = 0;
};

bool is_single(const SceneData& scene, const RawHit& hit, const Face& face) {
  bool out = face.is_flat();
  int near = 0;
  if (out) {
    scene.accel->visit_near(face.middle(), face.radius_m(), [&](const RawHit& at) {
      const bool is_own = at.instance == hit.instance && at.geometry == hit.geometry &&
                          at.primitive == hit.primitive;
      out = out && ++near <= kNearMost && (is_own || face.is_off(scene.corners(at)));
      return out;
    });
  }
  return out;
}

}  // namespace

void find_single_faces(SceneData& scene, const ParallelFor& parallel, const std::stop_token& stop) {
  if (std::any_of(scene.meshes.begin(), scene.meshes.end(),
                  [](const MeshData& mesh) { return !mesh.later.empty(); })) {
    return;
  }
  scene.single_faces.resize(scene.solids.empty() ? 0 : scene.placed.size());
  const auto fill = [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t geometry) {
    if (scene.placed[placed].solid == kNoSolid) {
      return;
    }
    const std::size_t count = scene.meshes[scene.placed[placed].mesh].triangle_count();
    std::vector<bool>& single = scene.single_faces[placed];
    single.resize(count);
    const std::size_t parts = (count + kPart - 1) / kPart;
    std::vector<float> reach_m(parts);
    parallel(static_cast<int>(parts), [&](int part) {
      const std::size_t first = static_cast<std::size_t>(part) * kPart;
      for (std::size_t i = first; i < std::min(first + kPart, count) && !stop.stop_requested();
           ++i) {
        const RawHit hit = {0, instance, geometry, static_cast<std::uint32_t>(i)};
        const Face face(scene, hit);
        single[i] = is_single(scene, hit, face);
        float& most_m = reach_m[static_cast<std::size_t>(part)];
        most_m = std::max(most_m, face.reach_m());
      }
    });
    for (const float most_m : reach_m) {
      scene.edge_margin_m = std::max(scene.edge_margin_m, 6 * most_m);
    }
  };
  std::size_t begun = 0;  // instances whose meshes begin at or before `placed`
  for (std::uint32_t placed = 0; placed < scene.placed.size() && !stop.stop_requested(); ++placed) {
    while (begun < scene.instances.size() && scene.instances[begun].first_placed <= placed) {
      ++begun;
    }
    if (begun == 0) {
      fill(placed, kNoInstance, placed);
    } else {
      fill(placed, static_cast<std::uint32_t>(begun - 1),
           placed - scene.instances[begun - 1].first_placed);
    }
  }
  if (stop.stop_requested()) {
    scene.single_faces.clear();
  }
}

}  // namespace core
