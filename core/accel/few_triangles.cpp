#include "core/accel/few_triangles.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/math/lane_math.h"

namespace core {
namespace {

using Lanes = Floats<8>;

/// How far beyond its edges a triangle reaches, seen along the ray, as a part of what its
/// coordinates measure: 16 roundings.
constexpr float kSlack = 0x1p-20F;

Lanes inner(const Vec3s<8>& a, Vec3 b, Lanes beside) {
  return fused(a.x, Lanes(b.x), fused(a.y, Lanes(b.y), fused(a.z, Lanes(b.z), beside)));
}

}  // namespace

struct FewTriangles::Rays {
  Vec3s<8> origin;
  Vec3s<8> direction;
  Lanes scale;  ///< of coordinates, times the length of the direction

  Rays(const RayPacket& rays, Vec3 center, float radius_m)
      : origin(load<8>(rays.origin_x) - Lanes(center.x), load<8>(rays.origin_y) - Lanes(center.y),
               load<8>(rays.origin_z) - Lanes(center.z)),
        direction(load<8>(rays.direction_x), load<8>(rays.direction_y), load<8>(rays.direction_z)),
        scale((length(origin) + Lanes(radius_m)) * length(direction)) {}
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
  for (std::uint32_t geometry = 0; geometry < top_level.size(); ++geometry) {
    const AccelGeometry& mesh = top_level[geometry];
    for (std::uint32_t t = 0; 3 * std::size_t{t} < mesh.indices.size(); ++t) {
      names_.push_back({geometry, t});
      Vec3 p[3];
      for (std::size_t c = 0; c < 3; ++c) {
        p[c] = mesh.positions[mesh.indices[3 * std::size_t{t} + c]] - center_;
      }
      for (const Vec3 corner : p) {
        radius_m_ = std::max(radius_m_, length(corner));
      }
      triangles_.push_back(triangle_of(p));
    }
  }
}

FewTriangles::Triangle FewTriangles::triangle_of(const Vec3 (&corner)[3]) {
  const Vec3 e1 = corner[1] - corner[0];
  const Vec3 e2 = corner[2] - corner[0];
  const Vec3 n = core::cross(e1, e2);
  const float twice_area = std::hypot(n.x, n.y, n.z);
  Triangle out;  // that nothing meets: no rays cross a plane without a normal
  if (twice_area > 0) {
    const auto affine = [&](Vec3 at) { return Affine{at, -dot(at, corner[0])}; };
    const float scale = kSlack * twice_area;
    const Vec3 unit = n * (1 / twice_area);
    const Vec3 u = core::cross(e2, unit) * (1 / twice_area);
    const Vec3 v = core::cross(unit, e1) * (1 / twice_area);
    out = {affine(n),
           {affine(u), affine(v)},
           {scale * length(u + v), scale * length(u), scale * length(v)}};
  }
  return out;
}

/// Where rays cross the plane of a triangle: within it and in front of them if least > 0.
struct FewTriangles::Crossing {
  Lanes least;
  Lanes t;
};

/// Seen along the ray, rounding moves the point by some 2^-24 of the coordinates. On the plane that
/// is more by the cosine, and in barycentric coordinates by their gradients: within as much of an
/// edge a point belongs to the triangles on both sides of it, so no ray passes between the two.
inline FewTriangles::Crossing FewTriangles::cross(const Triangle& triangle,
                                                  const Rays& rays) noexcept {
  const Lanes cosine = inner(rays.direction, triangle.plane.at, Lanes(0));
  const Lanes over = Lanes(-1) / cosine;
  const Lanes t = inner(rays.origin, triangle.plane.at, Lanes(triangle.plane.beside)) * over;
  const Vec3s<8> point = {fused(rays.direction.x, t, rays.origin.x),
                          fused(rays.direction.y, t, rays.origin.y),
                          fused(rays.direction.z, t, rays.origin.z)};
  const auto barycentric = [&](const Affine& of) { return inner(point, of.at, Lanes(of.beside)); };
  const Lanes b1 = barycentric(triangle.barycentric[0]);
  const Lanes b2 = barycentric(triangle.barycentric[1]);
  const Lanes b0 = Lanes(1) - b1 - b2;
  const Lanes near = rays.scale * abs(over);
  const auto beyond = [&](Lanes b, float slack) { return fused(near, Lanes(slack), b); };
  return {min(min(beyond(b0, triangle.slack[0]), beyond(b1, triangle.slack[1])),
              min(beyond(b2, triangle.slack[2]), t)),
          t};
}

unsigned FewTriangles::intersect8(const RayPacket& packet, unsigned active,
                                  HitPacket& hits) const noexcept {
  const Rays rays(packet, center_, radius_m_);
  Lanes nearest = load<8>(packet.t_max);
  Ints<8> triangle(-1);
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Crossing at = cross(triangles_[i], rays);
    const Mask<8> nearer = (at.least > Lanes(0)) & (at.t < nearest);
    nearest = select(nearer, at.t, nearest);
    triangle = select(nearer, Ints<8>(static_cast<std::int32_t>(i)), triangle);
  }
  const unsigned met = active & (~(triangle < Ints<8>(0))).bits();
  for (unsigned rest = met; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const Name name = names_[static_cast<std::size_t>(triangle.v[k])];
    hits.instance[k] = kNoInstance;
    hits.geometry[k] = name.geometry;
    hits.primitive[k] = name.primitive;
  }
  return met;
}

unsigned FewTriangles::occluded8(const RayPacket& packet, unsigned active) const noexcept {
  const Rays rays(packet, center_, radius_m_);
  const Lanes end = load<8>(packet.t_max);
  unsigned open = active;
  for (std::size_t i = 0; i < triangles_.size() && open != 0; ++i) {
    const Crossing at = cross(triangles_[i], rays);
    open &= ~((at.least > Lanes(0)) & (at.t < end)).bits();
  }
  return active & ~open;
}

}  // namespace core
