#include "core/accel/few_triangles.h"

#include <bit>

#include "core/math/lane_math.h"

namespace core {
namespace {

using Lanes = Floats<8>;

/// How far beyond its edges a triangle reaches, as a part of its size: 16 roundings.
constexpr float kSlack = 0x1p-20F;

Lanes inner(Lanes ax, Lanes ay, Lanes az, const float (&b)[3][8]) {
  return ax * load<8>(b[0]) + ay * load<8>(b[1]) + az * load<8>(b[2]);
}

/// Products of floats are exact in double, so that cross(a, b) is -cross(b, a) in every bit.
Vec3 exact_cross(Vec3 a, Vec3 b) {
  const auto minor = [](float p, float q, float r, float s) {
    return static_cast<float>(static_cast<double>(p) * static_cast<double>(q) -
                              static_cast<double>(r) * static_cast<double>(s));
  };
  return {minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}

}  // namespace

/// A ray in all lanes.
struct FewTriangles::RayLanes {
  Vec3s<8> origin;
  Vec3s<8> direction;
  Vec3s<8> moment;

  RayLanes(const Ray& ray, Vec3 center)
      : origin(ray.origin - center),
        direction(ray.direction),
        moment(core::cross(origin, direction)) {}
};

/// Where a ray crosses the planes of eight triangles, and which of them within.
struct FewTriangles::Crossing {
  Mask<8> inside;
  Lanes t;
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
  groups_.resize((count + 7) / 8);  // zeros: triangles that nothing meets
  for (std::uint32_t geometry = 0; geometry < top_level.size(); ++geometry) {
    const AccelGeometry& mesh = top_level[geometry];
    for (std::uint32_t t = 0; 3 * std::size_t{t} < mesh.indices.size(); ++t) {
      const std::size_t k = names_.size() % 8;
      Group& group = groups_[names_.size() / 8];
      names_.push_back({geometry, t});
      Vec3 p[3];
      for (std::size_t c = 0; c < 3; ++c) {
        p[c] = mesh.positions[mesh.indices[3 * std::size_t{t} + c]] - center_;
      }
      const auto put = [k](float(&to)[3][8], Vec3 v) {
        to[0][k] = v.x;
        to[1][k] = v.y;
        to[2][k] = v.z;
      };
      for (std::size_t e = 0; e < 3; ++e) {
        put(group.edge[e], p[(e + 1) % 3] - p[e]);
        put(group.moment[e], exact_cross(p[e], p[(e + 1) % 3]));
      }
      const Vec3 normal = exact_cross(p[1] - p[0], p[2] - p[0]);
      put(group.normal, normal);
      group.offset[k] = dot(normal, p[0]);
    }
  }
}

FewTriangles::Crossing FewTriangles::cross(const Group& group, const RayLanes& ray) noexcept {
  const Vec3s<8>& d = ray.direction;
  const Vec3s<8>& m = ray.moment;
  Lanes side[3];
  for (std::size_t e = 0; e < 3; ++e) {
    side[e] = inner(m.x, m.y, m.z, group.edge[e]) + inner(d.x, d.y, d.z, group.moment[e]);
  }
  const Lanes zero(0);
  const Lanes least = min(side[0], min(side[1], side[2]));
  const Lanes most = max(side[0], max(side[1], side[2]));
  // At a corner rounding may send a ray past all edges that meet there.
  const Lanes slack = Lanes(kSlack) * max(most, -least);
  // A triangle seen edge on divides 0 by 0 or gives an infinite t, and neither is nearer.
  const Lanes t =
      (load<8>(group.offset) - inner(ray.origin.x, ray.origin.y, ray.origin.z, group.normal)) /
      inner(d.x, d.y, d.z, group.normal);
  return {((least >= -slack) | (most <= slack)) & (t > zero), t};
}

bool FewTriangles::intersect(const Ray& ray, RawHit& hit) const noexcept {
  const RayLanes lanes(ray, center_);
  Lanes nearest(ray.t_max);
  Ints<8> group_of(-1);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Crossing at = cross(groups_[g], lanes);
    const Mask<8> nearer = at.inside & (at.t < nearest);
    nearest = select(nearer, at.t, nearest);
    group_of = select(nearer, Ints<8>(static_cast<std::int32_t>(g)), group_of);
  }
  const unsigned met = (~(group_of < Ints<8>(0))).bits();
  if (met == 0) {
    return false;
  }
  std::size_t lane = static_cast<std::size_t>(std::countr_zero(met));
  for (unsigned rest = met & (met - 1); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    lane = nearest.v[k] < nearest.v[lane] ? k : lane;
  }
  const Name name = names_[static_cast<std::size_t>(group_of.v[lane]) * 8 + lane];
  hit = {nearest.v[lane], kNoInstance, name.geometry, name.primitive};
  return true;
}

bool FewTriangles::occluded(const Ray& ray) const noexcept {
  const RayLanes lanes(ray, center_);
  const Lanes end(ray.t_max);
  for (const Group& group : groups_) {
    const Crossing at = cross(group, lanes);
    if ((at.inside & (at.t < end)).any()) {
      return true;
    }
  }
  return false;
}

}  // namespace core
