/// LightSampler::sample() in lanes.
///
/// Evaluated in SIMD: the choice of a light, triangles, and a sky without a sun. Points on all
/// others are sampled lane by lane.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>

#include "core/light_samplers/emitted_light.h"
#include "core/light_samplers/light_sampler.h"
#include "core/light_samplers/triangle_sample.h"
#include "core/math/lane_math.h"
#include "core/scene/scene_data.h"
#include "core/wave/lane_rows.h"

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
      : scene_(scene),
        lights_(lights),
        triangles_(static_cast<std::int32_t>(scene.triangle_lights.size())),
        sky_light_(triangles_ + static_cast<std::int32_t>(scene.punctual_lights.size())) {
    const Environment* sky = lights.environment_beside_tree();
    has_sky_ = sky != nullptr && !sky->has_sun();
    has_few_ = lights.has_tree_alone() && scene.light_tree.is_few() &&
               scene.punctual_lights.empty() &&
               std::none_of(scene.triangle_lights.begin(), scene.triangle_lights.end(),
                            [](const TriangleLight& t) { return t.varies; });
  }

  /// Samples for the lanes in `asked`; the results of the others are unspecified.
  template <std::size_t N>
  [[gnu::always_inline]] LightLanes<N> sample(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal,
                                              Floats<N> u_pick, Vec2s<N> u) const {
    if (has_few_) {
      const auto pick = scene_.light_tree.pick_few(point, normal, u_pick);
      Vec3s<N> place;
      return from_triangles(pick.light, pick.prob_light, point, u, place);
    }
    return from_any(asked, point, normal, u_pick, u);
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

  template <std::size_t N>
  [[gnu::noinline]] LightLanes<N> from_any(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal,
                                           Floats<N> u_pick, Vec2s<N> u) const {
    const auto [light, prob] = lights_.choose(asked, point, normal, u_pick);
    asked = asked & (prob > Floats<N>(0));
    LightLanes<N> out{};
    unsigned rest = asked.bits();
    const Mask<N> of_triangle = asked & (light < Ints<N>(triangles_));
    if (of_triangle.any()) {
      rest &= ~of_triangle.bits();
      Vec3s<N> place;
      out = from_triangles(select(of_triangle, light, Ints<N>(0)), prob, point, u, place);
      out.pdf_solid_angle = select(of_triangle, out.pdf_solid_angle, Floats<N>(0));
      set_varying((out.pdf_solid_angle > Floats<N>(0)).bits(), place, out);
    }
    const Mask<N> of_sky = asked & (light == Ints<N>(sky_light_));
    if (has_sky_ && of_sky.any()) {
      rest &= ~of_sky.bits();
      const SkySample<Floats<N>> seen = lights_.sample_sky(normal, u);
      out.wi_world = select(of_sky, seen.wi_world, out.wi_world);
      out.radiance = select(of_sky, seen.radiance, out.radiance);
      out.pdf_solid_angle = select(of_sky, prob * seen.pdf_solid_angle, out.pdf_solid_angle);
      out.is_far = of_sky;
      out.light = select(of_sky, light, out.light);
    }
    for (; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      set(out, k,
          lights_.sample_of(static_cast<std::size_t>(light.v[k]), prob.v[k], point.lane(k),
                            normal.lane(k), {u.x.v[k], u.y.v[k]}));
    }
    return out;
  }

  /// LightSampler::from_triangle(), with the mean radiance. All lanes have a triangle.
  template <std::size_t N>
  [[gnu::always_inline]] LightLanes<N> from_triangles(Ints<N> light, Floats<N> prob, Vec3s<N> point,
                                                      Vec2s<N> u, Vec3s<N>& place) const {
    const TriangleRows<N> t = rows(light);
    const TrianglePoint<Floats<N>> at = sample_triangle(t, point, u);
    LightLanes<N> out;
    out.wi_world = at.wi_world;
    out.target = at.target;
    out.pdf_solid_angle = prob * at.pdf_solid_angle;
    out.radiance = t.radiance;
    out.is_far = Mask<N>::of(0);
    out.is_delta = Mask<N>::of(0);
    out.light = light;
    place = at.place;
    return out;
  }

  /// Sets the radiance where it varies over triangles.
  template <std::size_t N>
  void set_varying(unsigned on, Vec3s<N> place, LightLanes<N>& out) const {
    for (; on != 0; on &= on - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(on));
      const TriangleLight& t = scene_.triangle_lights[static_cast<std::size_t>(out.light.v[k])];
      if (t.varies) {
        const Rgb seen = triangle_radiance(scene_, t, place.lane(k), -out.wi_world.lane(k));
        out.radiance.set(k, {seen.r, seen.g, seen.b});
      }
    }
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
    const float* row[N];
    TriangleRows<N> out;
    for (std::size_t k = 0; k < N; ++k) {
      const TriangleLight& t = scene_.triangle_lights[static_cast<std::size_t>(index[k])];
      row[k] = &t.p0.x;
      out.two_sided.v[k] = t.two_sided ? -1 : 0;
      out.error_m.v[k] = t.error_m;
    }
    Floats<N> c[4][4];
    transpose_rows(row, c);
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
  std::int32_t triangles_;
  std::int32_t sky_light_;  ///< index of the environment
  bool has_sky_ = false;
  bool has_few_ = false;
};

}  // namespace core
