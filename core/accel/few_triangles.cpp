#include "core/accel/few_triangles.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/math/lane_math.h"
#include "core/math/offset_ray.h"

namespace core {
namespace {

using Lanes = Floats<8>;

/// Tolerance beyond the edges of a triangle, seen along the ray, relative to the coordinates: 16
/// roundings.
constexpr float kSlack = 0x1p-20F;

/// The slack makes no shape larger than by this fraction of its height on each side: a ray that
/// starts farther off is left to the tree, which has no slack.
constexpr float kGrowthMost = 0x1p-13F;

Lanes inner(const Vec3s<8>& a, Vec3 b) {
  return fused(a.x, Lanes(b.x), fused(a.y, Lanes(b.y), a.z * Lanes(b.z)));
}

/// Twice the area's vector, rounded once: the products of a sliver's edges nearly cancel.
Vec3 normal_of(Vec3 e1, Vec3 e2) {
  const auto minor = [](float a, float b, float c, float d) {
    return static_cast<float>(static_cast<double>(a) * static_cast<double>(b) -
                              static_cast<double>(c) * static_cast<double>(d));
  };
  return {minor(e1.y, e2.z, e1.z, e2.y), minor(e1.z, e2.x, e1.x, e2.z),
          minor(e1.x, e2.y, e1.y, e2.x)};
}

}  // namespace

struct FewTriangles::Corners {
  Name name;
  Vec3 at[3];
};

struct FewTriangles::Rays {
  Vec3s<8> origin;
  Vec3s<8> direction;
  Lanes reach;  ///< of coordinates, metres
  Lanes scale;  ///< the same times the length of the direction

  Rays(const RayPacket& rays, Vec3 center, float radius_m)
      : origin(load<8>(rays.origin_x), load<8>(rays.origin_y), load<8>(rays.origin_z)),
        direction(load<8>(rays.direction_x), load<8>(rays.direction_y), load<8>(rays.direction_z)),
        reach(length(origin - Vec3s<8>(center)) + Lanes(radius_m)),
        scale(reach * length(direction)) {}
};

FewTriangles::FewTriangles(std::span<const AccelGeometry> top_level) {
  std::size_t count = 0;
  Bounds box;
  for (const AccelGeometry& mesh : top_level) {
    count += mesh.indices.size() / 3;
    for (const std::uint32_t i : mesh.indices) {
      if (count <= kMost) {
        box.add(mesh.positions[i]);
      }
    }
  }
  if (count > kMost || count == 0) {
    return;
  }
  center_ = box.center();
  std::vector<Corners> triangles;
  for (std::uint32_t geometry = 0; geometry < top_level.size(); ++geometry) {
    const AccelGeometry& mesh = top_level[geometry];
    for (std::uint32_t t = 0; 3 * std::size_t{t} < mesh.indices.size(); ++t) {
      Corners& corners = triangles.emplace_back(Corners{{geometry, t}, {}});
      for (std::size_t c = 0; c < 3; ++c) {
        corners.at[c] = mesh.positions[mesh.indices[3 * std::size_t{t} + c]];
        radius_m_ = std::max(radius_m_, length(corners.at[c] - center_));
      }
    }
  }
  while (pair_up(triangles)) {
    ++parallelograms_;
  }
  for (const Corners& alone : triangles) {
    shapes_.push_back(shape_of(alone.at));
    names_.push_back({alone.name, alone.name});
  }
  for (const Shape& shape : shapes_) {
    const float slack = std::max({shape.slack[0], shape.slack[1], shape.slack[2]});
    const float growth = slack / length(shape.normal);  // a metre of reach, in heights
    reach_most_m_ = growth > 0 ? std::min(reach_most_m_, kGrowthMost / growth) : reach_most_m_;
  }
  if (reach_most_m_ < 2 * radius_m_) {  // rays between its own surfaces
    shapes_.clear();
  }
}

/// Moves two triangles that form a parallelogram to the shapes. Returns false if there are none.
bool FewTriangles::pair_up(std::vector<Corners>& triangles) {
  const auto is_at = [](Vec3 a, Vec3 b, float apart) { return length(a - b) <= apart; };
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t turn = 0; turn < 3; ++turn) {
      const Vec3(&p)[3] = triangles[i].at;
      const Vec3 corner[3] = {p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]};
      const Vec3 edge = corner[2] - corner[0];
      const Vec3 opposite = corner[1] + edge;
      // Half of what the opposite triangle may be off the plane of this one.
      const float apart = 0.5F * kPlaneError * (taxicab(opposite) + taxicab(edge));
      for (std::size_t j = i + 1; j < triangles.size(); ++j) {
        const Vec3(&q)[3] = triangles[j].at;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 a = q[(k + 1) % 3];
          const Vec3 b = q[(k + 2) % 3];
          const bool shares =
              (a == corner[1] && b == corner[2]) || (a == corner[2] && b == corner[1]);
          if (shares && is_at(q[k], opposite, apart)) {
            shapes_.push_back(shape_of(corner));
            names_.push_back({triangles[i].name, triangles[j].name});
            triangles.erase(triangles.begin() + static_cast<std::ptrdiff_t>(j));
            triangles.erase(triangles.begin() + static_cast<std::ptrdiff_t>(i));
            return true;
          }
        }
      }
    }
  }
  return false;
}

FewTriangles::Shape FewTriangles::shape_of(const Vec3 (&corner)[3]) {
  const Vec3 e1 = corner[1] - corner[0];
  const Vec3 e2 = corner[2] - corner[0];
  const Vec3 n = normal_of(e1, e2);
  const float twice_area = std::hypot(n.x, n.y, n.z);
  Shape out;  // never hit: no ray crosses a plane without a normal
  if (twice_area > 0) {
    const float scale = kSlack * twice_area;
    const Vec3 unit = n * (1 / twice_area);
    const Vec3 u = core::cross(e2, unit) * (1 / twice_area);
    const Vec3 v = core::cross(unit, e1) * (1 / twice_area);
    out = {corner[0], n, {u, v}, {scale * length(u), scale * length(v), scale * length(u + v)}};
  }
  return out;
}

/// The intersection of rays with the plane of a shape: inside it and in front of the origin if
/// least > 0.
struct FewTriangles::Crossing {
  Lanes least;
  Lanes t;
  Lanes sum;  ///< of the barycentric coordinates: above 1 in the opposite half
};

/// Seen along the ray, rounding moves the point by about 2^-24 of the coordinates; on the plane by
/// that over the cosine, and in barycentric coordinates by that times their gradients. A point
/// within this distance of an edge belongs to the shapes on both sides, so no ray passes between
/// them. kIsWhole: tests the parallelogram, else the triangle.
template <bool kIsWhole>
inline FewTriangles::Crossing FewTriangles::cross(const Shape& shape, const Rays& rays) noexcept {
  const Vec3s<8> origin = rays.origin - Vec3s<8>(shape.corner);
  const Lanes over = Lanes(-1) / inner(rays.direction, shape.normal);
  const Lanes t = inner(origin, shape.normal) * over;
  const Vec3s<8> point = {fused(rays.direction.x, t, origin.x),
                          fused(rays.direction.y, t, origin.y),
                          fused(rays.direction.z, t, origin.z)};
  const Lanes b1 = inner(point, shape.barycentric[0]);
  const Lanes b2 = inner(point, shape.barycentric[1]);
  const Lanes sum = b1 + b2;
  const Lanes near = rays.scale * abs(over);
  const auto beyond = [&](Lanes b, float slack) { return fused(near, Lanes(slack), b); };
  if constexpr (kIsWhole) {
    const auto inside = [](Lanes b) { return min(b, Lanes(1) - b); };
    return {min(min(beyond(inside(b1), shape.slack[0]), beyond(inside(b2), shape.slack[1])), t), t,
            sum};
  } else {
    return {min(min(beyond(b1, shape.slack[0]), beyond(b2, shape.slack[1])),
                min(beyond(Lanes(1) - sum, shape.slack[2]), t)),
            t, sum};
  }
}

std::optional<unsigned> FewTriangles::intersect8(const RayPacket& packet, unsigned active,
                                                 HitPacket& hits) const noexcept {
  const Rays rays(packet, center_, radius_m_);
  if ((active & (rays.reach > Lanes(reach_most_m_)).bits()) != 0) {
    return {};
  }
  Lanes nearest = load<8>(packet.t_max);
  Lanes sum(0);
  Ints<8> shape(-1);
  const auto take = [&](const Crossing& at, std::size_t i) {
    const Mask<8> nearer = (at.least > Lanes(0)) & (at.t < nearest);
    nearest = select(nearer, at.t, nearest);
    sum = select(nearer, at.sum, sum);
    shape = select(nearer, Ints<8>(static_cast<std::int32_t>(i)), shape);
  };
  for (std::size_t i = 0; i < parallelograms_; ++i) {
    take(cross<true>(shapes_[i], rays), i);
  }
  for (std::size_t i = parallelograms_; i < shapes_.size(); ++i) {
    take(cross<false>(shapes_[i], rays), i);
  }
  const unsigned met = active & (~(shape < Ints<8>(0))).bits();
  const unsigned opposite = (sum > Lanes(1)).bits();
  for (unsigned rest = met; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const Name name = names_[static_cast<std::size_t>(shape.v[k])][opposite >> k & 1U];
    hits.instance[k] = kNoInstance;
    hits.geometry[k] = name.geometry;
    hits.primitive[k] = name.primitive;
  }
  return met;
}

std::optional<unsigned> FewTriangles::occluded8(const RayPacket& packet,
                                                unsigned active) const noexcept {
  const Rays rays(packet, center_, radius_m_);
  if ((active & (rays.reach > Lanes(reach_most_m_)).bits()) != 0) {
    return {};
  }
  const Lanes end = load<8>(packet.t_max);
  unsigned open = active;
  const auto take = [&](const Crossing& at) {
    open &= ~((at.least > Lanes(0)) & (at.t < end)).bits();
  };
  for (std::size_t i = 0; i < parallelograms_ && open != 0; ++i) {
    take(cross<true>(shapes_[i], rays));
  }
  for (std::size_t i = parallelograms_; i < shapes_.size() && open != 0; ++i) {
    take(cross<false>(shapes_[i], rays));
  }
  return active & ~open;
}

}  // namespace core
