/// LightSampler::sample() in lanes.
///
/// Evaluated in SIMD: triangles of uniform emission in small light trees without distant lights,
/// and with any tree a sky without a sun. Everything else is sampled lane by lane.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>

#include "core/light_samplers/light_sampler.h"
#include "core/light_samplers/triangle_sample.h"
#include "core/math/lane_math.h"
#include "core/scene/scene_data.h"
#include "core/wave/lane_environment.h"

namespace core {

/// LightSample
template <std::size_t N>
struct LightLanes {
  Vec3s<N> wi_world;
  Vec3s<N> target;
  Vec3s<N> radiance;
  Floats<N> pdf_solid_angle;
  Mask<N> is_far;
  Mask<N> is_delta;
  Ints<N> light;  ///< as in LightSample
};

class LaneLights {
 public:
  LaneLights(const SceneData& scene, const MisLightSampler& lights)
      : scene_(scene), lights_(lights), sky_(lights.sky_beside_tree(), lights.sky_density()) {
    has_few_ = lights.has_tree_alone() && scene.light_tree.is_few() &&
               std::none_of(scene.triangle_lights.begin(), scene.triangle_lights.end(),
                            [](const TriangleLight& t) { return t.varies; }) &&
               scene.light_tree.size() == scene.triangle_lights.size();
    const Environment* sky = lights.sky_beside_tree();
    has_sky_ = sky != nullptr && !sky->has_sun();
  }

  /// Samples for the lanes in `asked`; the results of the others are unspecified.
  template <std::size_t N>
  [[gnu::always_inline]] LightLanes<N> sample(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal,
                                              Floats<N> u_pick, Vec2s<N> u) const {
    if (has_few_) {
      return from_few(point, normal, u_pick, u);
    }
    LightLanes<N> out{};
    unsigned alone = asked.bits();
    if (has_sky_) {
      const Floats<N> by_tree = lights_.prob_tree(point, normal);
      alone &= (u_pick < by_tree).bits();
      const SkyLanes<N> seen = sky_.sample(normal, u);
      out.wi_world = seen.wi_world;
      out.radiance = seen.radiance;
      out.pdf_solid_angle = (Floats<N>(1) - by_tree) * seen.pdf_solid_angle;
      out.is_far = Mask<N>::of((1U << N) - 1);
      out.light = Ints<N>(
          static_cast<std::int32_t>(scene_.triangle_lights.size() + scene_.punctual_lights.size()));
    }
    for (; alone != 0; alone &= alone - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(alone));
      set(out, k, lights_.sample(point.lane(k), normal.lane(k), u_pick.v[k], {u.x.v[k], u.y.v[k]}));
    }
    return out;
  }

  /// LightSampler::pdf_environment() for the lanes in `asked`; at: map coordinates of the
  /// directions d.
  template <std::size_t N>
  Floats<N> pdf_environment(Mask<N> asked, Vec3s<N> d, const MapPoints<N>& at, Vec3s<N> point,
                            Vec3s<N> normal) const {
    if (has_sky_) {
      return (Floats<N>(1) - lights_.prob_tree(point, normal)) *
             sky_.pdf_solid_angle(normal, d, at);
    }
    Floats<N> out(0);
    for (unsigned rest = asked.bits(); rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      out.v[k] = lights_.pdf_environment(d.lane(k), {at.u.v[k], at.v.v[k]}, at.sin_theta.v[k],
                                         point.lane(k), normal.lane(k));
    }
    return out;
  }

 private:
  template <std::size_t N>
  static void set(LightLanes<N>& out, std::size_t k, const LightSample& s) {
    out.wi_world.set(k, s.wi_world);
    out.target.set(k, s.target);
    out.radiance.set(k, {s.radiance.r, s.radiance.g, s.radiance.b});
    out.pdf_solid_angle.v[k] = s.pdf_solid_angle;
    out.is_far.v[k] = s.is_far ? -1 : 0;
    out.is_delta.v[k] = s.is_delta ? -1 : 0;
    out.light.v[k] = static_cast<std::int32_t>(s.light);
  }

  /// LightSampler::from_triangle() for the triangles that the tree selects.
  template <std::size_t N>
  [[gnu::always_inline]] LightLanes<N> from_few(Vec3s<N> point, Vec3s<N> normal, Floats<N> u_pick,
                                                Vec2s<N> u) const {
    const auto pick = scene_.light_tree.pick_few(point, normal, u_pick);
    const TriangleRows<N> t = rows(pick.light);
    const TrianglePoint<Floats<N>> at = sample_triangle(t, point, u);
    LightLanes<N> out;
    out.wi_world = at.wi_world;
    out.target = at.target;
    out.pdf_solid_angle = pick.prob_light * at.pdf_solid_angle;
    out.radiance = t.radiance;
    out.is_far = Mask<N>::of(0);
    out.is_delta = Mask<N>::of(0);
    out.light = pick.light;
    return out;
  }

  template <std::size_t N>
  struct TriangleRows {
    Vec3s<N> p0, edge1, edge2, normal, radiance;
    Floats<N> area_m2, error_m;
    Mask<N> two_sided;
  };
  template <std::size_t N>
  TriangleRows<N> rows(Ints<N> light) const {
    static_assert(offsetof(TriangleLight, area_m2) == 48 && sizeof(Rgb) == 12);
    alignas(32) std::int32_t index[N];
    store(index, light);
    const float* row[4][N];
    TriangleRows<N> out;
    for (std::size_t k = 0; k < N; ++k) {
      const TriangleLight& t = scene_.triangle_lights[static_cast<std::size_t>(index[k])];
      for (std::size_t part = 0; part < 4; ++part) {
        row[part][k] = &t.p0.x + 4 * part;
      }
      out.two_sided.v[k] = t.two_sided ? -1 : 0;
      out.error_m.v[k] = t.error_m;
    }
    Floats<N> c[4][4];
    for (std::size_t part = 0; part < 4; ++part) {
      transpose(row[part], c[part]);
    }
    out.p0 = {c[0][0], c[0][1], c[0][2]};
    out.edge1 = {c[0][3], c[1][0], c[1][1]};
    out.edge2 = {c[1][2], c[1][3], c[2][0]};
    out.normal = {c[2][1], c[2][2], c[2][3]};
    out.area_m2 = c[3][0];
    out.radiance = {c[3][1], c[3][2], c[3][3]};
    return out;
  }

  const SceneData& scene_;
  const MisLightSampler& lights_;
  bool has_few_ = false;
  LaneEnvironment sky_;
  bool has_sky_ = false;
};

}  // namespace core
