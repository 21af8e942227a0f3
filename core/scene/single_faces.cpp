#include "core/scene/single_faces.h"

#include <algorithm>
#include <cmath>

#include "core/math/offset_ray.h"
#include "core/scene/placed_meshes.h"

namespace core {
namespace {

constexpr float kCosTilt = 0.8660254F;  // 30 degrees

/// Mean number of triangles near a face that are looked at: the time for all faces is bounded. What
/// is beyond counts as unknown. A vertex of a regular mesh has six, the strips at the pole of a
/// ball a hundred or two, and strips along all of a bottle as many as it has.
constexpr std::size_t kNearMean = 256;

/// Faces of one step.
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

  /// Returns whether a gap is between both, or a plane that is at 30 degrees or more to the face
  /// separates them. The disc around a point of the face up to its nearest edge is then on one side
  /// of that plane, so the point is at least half as far from the triangle as from the edge.
  bool is_off(const Corners<Vec3>& other) const {
    const auto heights = [&](Vec3 axis, const Corners<Vec3>& of) {
      return std::minmax(
          {dot(of[0] - p_[0], axis), dot(of[1] - p_[0], axis), dot(of[2] - p_[0], axis)});
    };
    const auto separates = [&](Vec3 across) {
      const Vec3 axis = normalize_or(across, n_);
      const auto here = heights(axis, p_);
      const auto there = heights(axis, other);
      const float gap_m = std::max(here.first - there.second, there.first - here.second);
      return gap_m > 2 * reach_m_ || (std::fabs(dot(axis, n_)) <= kCosTilt && gap_m >= -reach_m_);
    };
    if (separates(n_)) {
      return true;
    }
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

/// In double precision, so that it is within a rounding of the triangle. Zero if that is
/// degenerate.
NearPlanes::Plane plane_of(const Corners<Vec3>& p) {
  double edge[2][3];
  for (int i = 0; i < 3; ++i) {
    edge[0][i] = static_cast<double>(p[1][i]) - static_cast<double>(p[0][i]);
    edge[1][i] = static_cast<double>(p[2][i]) - static_cast<double>(p[0][i]);
  }
  double n[3];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    n[i] = edge[0][j] * edge[1][k] - edge[0][k] * edge[1][j];
  }
  const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (!(size > 0)) {
    return {};
  }
  double offset_m = 0;
  for (int i = 0; i < 3; ++i) {
    n[i] /= size;
    offset_m -= n[i] * static_cast<double>(p[0][i]);
  }
  return {{static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])},
          static_cast<float>(offset_m)};
}

/// Adds the planes that are near a face. left: how many triangles may be looked at.
void add_planes(const SceneData& scene, const RawHit& hit, const Face& face, std::size_t& left,
                std::vector<NearPlanes::Plane>& to) {
  const std::size_t first = to.size();
  if (face.is_flat() && left > 0) {
    scene.accel->visit_near(face.middle(), face.radius_m(), [&](const RawHit& at) {
      const bool is_own = at.instance == hit.instance && at.geometry == hit.geometry &&
                          at.primitive == hit.primitive;
      const Corners<Vec3> p = scene.corners(at);
      if (!is_own && !face.is_off(p)) {
        to.push_back(plane_of(p));
      }
      left -= left > 0 ? 1 : 0;
      return left > 0;
    });
  }
  if (!face.is_flat() || left == 0) {
    to.resize(first);
    to.emplace_back();
  }
}

}  // namespace

void find_single_faces(SceneData& scene, const ParallelFor& parallel, const std::stop_token& stop) {
  if (std::any_of(scene.meshes.begin(), scene.meshes.end(),
                  [](const MeshData& mesh) { return !mesh.later.empty(); })) {
    return;
  }
  scene.near_planes.resize(scene.solids.empty() ? 0 : scene.placed.size());
  const auto fill = [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t geometry) {
    if (scene.placed[placed].solid == kNoSolid || stop.stop_requested()) {
      return;
    }
    const std::size_t count = scene.meshes[scene.placed[placed].mesh].triangle_count();
    struct Part {
      NearPlanes near;
      float reach_m = 0;
    };
    std::vector<Part> parts((count + kPart - 1) / kPart);
    parallel(static_cast<int>(parts.size()), [&](int number) {
      const std::size_t first = static_cast<std::size_t>(number) * kPart;
      Part& part = parts[static_cast<std::size_t>(number)];
      const std::size_t end = std::min(first + kPart, count);
      std::size_t left = kNearMean * (end - first);
      for (std::size_t i = first; i < end && !stop.stop_requested(); ++i) {
        const RawHit hit = {0, instance, geometry, static_cast<std::uint32_t>(i)};
        const Face face(scene, hit);
        part.near.first.push_back(static_cast<std::uint32_t>(part.near.planes.size()));
        add_planes(scene, hit, face, left, part.near.planes);
        part.reach_m = std::max(part.reach_m, face.reach_m());
      }
    });
    NearPlanes& near = scene.near_planes[placed];
    for (const Part& part : parts) {
      const auto before = static_cast<std::uint32_t>(near.planes.size());
      for (const std::uint32_t first : part.near.first) {
        near.first.push_back(before + first);
      }
      near.planes.insert(near.planes.end(), part.near.planes.begin(), part.near.planes.end());
      scene.edge_margin_m = std::max(scene.edge_margin_m, 6 * part.reach_m);
    }
    near.first.push_back(static_cast<std::uint32_t>(near.planes.size()));
  };
  for_each_placed(scene, fill);
  if (stop.stop_requested()) {
    scene.near_planes.clear();
  }
}

}  // namespace core
