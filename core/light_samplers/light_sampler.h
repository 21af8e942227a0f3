/// LightSampler: picks a light and a point on it, for one scene and one environment.
///
/// How a light is picked (LightPick) is apart from how its samples are used: `ris` resamples and
/// `restir` shares samples of lights that the tree picks.
#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/lights/environment.h"
#include "core/math/frame.h"
#include "core/math/lane_math.h"
#include "core/sampling/distribution.h"
#include "core/sampling/warp.h"
#include "core/scene/scene_data.h"

namespace core {

struct LightSample {
  Vec3 wi_world;              ///< unit, to the light
  Vec3 target;                ///< point just before the light; if distant: origin + wi * huge
  bool is_far = false;        ///< environment or directional
  bool is_delta = false;      ///< pdf_solid_angle is then the probability of picking the light
  Rgb radiance;               ///< delta: irradiance per unit of cosine
  float pdf_solid_angle = 0;  ///< 0: no sample
  std::uint32_t triangle = kNoLight;  ///< index of the triangle light
  float prob_light = 0;               ///< probability of picking the light
  std::uint32_t light = kNoLight;  ///< index among triangles, punctual lights and the environment
  Vec3 place;                      ///< point on a triangle light
};

inline bool is_environment(const LightSample& sample) noexcept {
  return sample.triangle == kNoLight && sample.is_far && !sample.is_delta;
}

/// A light sample independent of the point that it was drawn for, in a measure that is the same
/// everywhere: area on triangles [m^2], solid angle for the environment, counting for delta lights.
struct LightPoint {
  std::uint32_t light = kNoLight;  ///< as in LightSample
  Vec3 place;                      ///< of distant lights: direction, unit
  Rgb radiance;                    ///< emitted; unused for delta lights
  float pdf_measure = 0;           ///< at the point it was drawn for; 0: no sample
};

/// A LightPoint as seen from one point.
struct LightView {
  Vec3 wi_world;
  Rgb radiance;           ///< as in LightSample
  float solid_angle = 0;  ///< per unit of its measure; delta lights: 1; 0: no light
  float geometric = 0;    ///< geometric factor of the tree's importance: cos / d^2, 1 / d^2 or 1
  bool is_far = false;
  bool is_delta = false;
};

/// How a light is picked.
enum class LightPick {
  kUniform,  ///< all with equal probability
  kPower,    ///< in proportion to emitted power
  /// By the scene's light tree, with the environment and directional lights beside it, in
  /// proportion to the light that each could send to the point.
  kTree
};

constexpr LightPick light_pick(LightSamplerType type) noexcept {
  return type == LightSamplerType::kUniform ? LightPick::kUniform
         : type == LightSamplerType::kPower ? LightPick::kPower
                                            : LightPick::kTree;
}

class LightSampler {
 public:
  /// Scene and environment must outlive it; environment may be null.
  LightSampler(const SceneData& scene, const Environment* environment, LightPick pick)
      : LightSampler(scene, environment, pick, SkyDensity::kRadiance) {}

  bool empty() const noexcept { return light_count_ == 0; }
  /// normal_world: geometric normal on the side that light may come from; zero: both sides.
  LightSample sample(Vec3 point, Vec3 normal_world, float u_pick, Vec2 u) const noexcept;
  /// The two halves of sample(): picks a light, for the points in `asked`; prob_light 0: none,
  template <std::size_t N>
  struct Choice {
    Ints<N> light;  ///< as in LightSample
    Floats<N> prob_light;
  };
  template <std::size_t N>
  Choice<N> choose(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal_world,
                   Floats<N> u_pick) const noexcept;
  /// and a point on this light.
  LightSample sample_of(std::size_t light, float prob_light, Vec3 point, Vec3 normal_world,
                        Vec2 u) const noexcept;
  /// Samples delta lights only, which no other technique can find.
  LightSample sample_delta(Vec3 point, float u_pick) const noexcept;
  /// Returns the environment if the light tree picks among the other lights; else null. Its
  /// directions are sampled by sample_sky().
  const Environment* environment_beside_tree() const noexcept {
    return pick_ == LightPick::kTree ? environment_ : nullptr;
  }
  /// Samples this environment, if it has no sun, for one point or several. A constant one over the
  /// hemisphere of the normal: in proportion to the cosine if the BSDF is sampled too, else evenly,
  /// because shading normals see light from close to the horizon.
  template <typename V, typename U>
  auto sample_sky(V normal_world, U u) const noexcept;
  /// Returns whether sample() uses only the light tree, at every point.
  bool has_tree_alone() const noexcept { return pick_ == LightPick::kTree && far_count_ == 0; }
  bool has_delta() const noexcept { return !scene_.punctual_lights.empty(); }
  /// Returns whether there are local lights: all but the environment and directional lights.
  bool has_local() const noexcept { return light_count_ > far_count_; }
  bool is_local(std::uint32_t light) const noexcept { return light < light_count_ - far_count_; }

  /// Returns the density of sample() for the direction to a point of triangle light `light`.
  /// cos_light > 0: between the light's normal and the direction back.
  float pdf_triangle(std::uint32_t light, Vec3 point, Vec3 normal_world, float distance_m,
                     float cos_light) const noexcept;
  /// Returns the density of sample() for a direction to the environment.
  float pdf_environment(Vec3 direction_world, Vec3 point, Vec3 normal_world) const noexcept;
  /// As above, for one point or several; at: positions of the directions on the map.
  template <typename V, typename F>
  F pdf_environment(V direction_world, const MapPoint<F>& at, V point,
                    V normal_world) const noexcept;
  /// Returns the probability with which sample() picks a light; light: as in LightSample.
  float prob_light(std::uint32_t light, Vec3 point, Vec3 normal_world) const noexcept;

  LightPoint point_of(const LightSample& sample) const noexcept;
  LightView view(const LightPoint& light, Vec3 point) const noexcept;
  /// Returns the end point of a shadow ray to the light: LightSample::target.
  Vec3 target(const LightPoint& light, const LightView& view, Vec3 point) const noexcept;
  /// Returns the density of sample() at `point` for a local light, in the light's measure; 0 if it
  /// does not shine on the point.
  float pdf_measure(const LightPoint& light, Vec3 point, Vec3 normal_world) const noexcept;
  /// Returns the density of sample() at `point` over solid angle. Not for delta lights.
  float pdf_solid_angle(const LightPoint& light, const LightView& view, Vec3 point,
                        Vec3 normal_world) const noexcept;

 protected:
  LightSampler(const SceneData& scene, const Environment* environment, LightPick pick,
               SkyDensity sky);
  template <typename F>
  F prob_tree(F irradiance_local) const noexcept;
  template <typename F>
  F prob_each_far(F prob_tree) const noexcept {
    return (1 - prob_tree) / static_cast<float>(far_count_);
  }

 private:
  /// Returns the probability with which sample() picks the environment. Pre: there is one.
  template <typename V>
  auto prob_environment(V point, V normal_world) const noexcept;
  LightSample from_triangle(std::uint32_t light, Vec3 point, float prob, Vec2 u) const noexcept;
  LightSample from_punctual(std::size_t light, Vec3 point, float prob) const noexcept;
  LightSample from_environment(Vec3 normal_world, float prob, Vec2 u) const noexcept;
  /// Of directions to a constant sky.
  template <typename F>
  F hemisphere_pdf_solid_angle(F cosine) const noexcept {
    return sky_ == SkyDensity::kCompensated ? cosine_hemisphere_pdf_solid_angle(cosine)
                                            : select(cosine > 0, F(1 / kTwoPi), F(0));
  }

  const SceneData& scene_;
  const Environment* environment_;  ///< null if black
  LightPick pick_;
  SkyDensity sky_;
  std::size_t triangles_ = 0;
  std::size_t local_punctual_ = 0;  ///< point and spot
  std::size_t light_count_ = 0;     ///< triangles, punctual lights, then the environment
  Distribution1D power_;            ///< in the order above
  std::size_t far_count_ = 0;       ///< directional lights and the environment
  float irradiance_far_ = 0;        ///< sum, unshadowed, averaged over surface orientations
};

/// A LightSampler for estimators that combine every light sample with a sample of the scattering by
/// MIS. Under SkyDensity::kCompensated its samples alone miss the dark parts of a map; therefore it
/// does not convert to a LightSampler, whose samples find all light.
class MisLightSampler : private LightSampler {
 public:
  MisLightSampler(const SceneData& scene, const Environment* environment, LightPick pick,
                  SkyDensity sky)
      : LightSampler(scene, environment, pick, sky) {}
  using LightSampler::Choice;
  using LightSampler::choose;
  using LightSampler::empty;
  using LightSampler::environment_beside_tree;
  using LightSampler::has_delta;
  using LightSampler::has_local;
  using LightSampler::has_tree_alone;
  using LightSampler::is_local;
  using LightSampler::pdf_environment;
  using LightSampler::pdf_measure;
  using LightSampler::pdf_solid_angle;
  using LightSampler::pdf_triangle;
  using LightSampler::point_of;
  using LightSampler::prob_light;
  using LightSampler::sample;
  using LightSampler::sample_delta;
  using LightSampler::sample_of;
  using LightSampler::sample_sky;
  using LightSampler::target;
  using LightSampler::view;
};

/// Distant lights share the remaining probability evenly. The split is proportional to the light
/// that both sides could send to the point, unshadowed; since occlusion is unknown, the weaker side
/// gets 0.4, unless it could send less than a hundredth of the total.
template <typename F>
F LightSampler::prob_tree(F irradiance_local) const noexcept {
  constexpr float kLeast = 0.4F;
  constexpr float kPerFaint = 1 / 0.01F;
  const F share = irradiance_local / (irradiance_local + irradiance_far_);
  const F low = kLeast * min(share * kPerFaint, F(1));
  // Never exactly 1: shared samples require that a distant light is found wherever it is visible.
  const F high = 1 - max(kLeast * min((1 - share) * kPerFaint, F(1)), F(0x1p-20F));
  return select(irradiance_local > 0, min(max(share, low), high), F(0));
}

template <std::size_t N>
LightSampler::Choice<N> LightSampler::choose(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal_world,
                                             Floats<N> u_pick) const noexcept {
  Choice<N> out{Ints<N>(0), Floats<N>(0)};
  if (pick_ == LightPick::kTree && far_count_ == 0) {
    const auto pick = scene_.light_tree.pick(asked, point, normal_world, u_pick);
    out = {pick.light, pick.prob_light};
  } else if (pick_ == LightPick::kTree) {
    const Floats<N> by_tree = prob_tree(scene_.light_tree.importance(point, normal_world));
    out.prob_light = prob_each_far(by_tree);
    out.light = within(truncated((u_pick - by_tree) / out.prob_light),
                       Ints<N>(static_cast<std::int32_t>(far_count_))) +
                Ints<N>(static_cast<std::int32_t>(light_count_ - far_count_));
    if (const Mask<N> is_local = asked & (u_pick < by_tree); is_local.any()) {
      const auto pick = scene_.light_tree.pick(is_local, point, normal_world,
                                               min(u_pick / by_tree, Floats<N>(kOneMinusEpsilon)));
      out.light = select(is_local, pick.light, out.light);
      out.prob_light = select(is_local, by_tree * pick.prob_light, out.prob_light);
    }
  } else if (pick_ == LightPick::kUniform) {
    const Floats<N> count(static_cast<float>(light_count_));
    out = {within(truncated(u_pick * count), Ints<N>(static_cast<std::int32_t>(light_count_))),
           Floats<N>(1) / count};
  } else {
    out.light = power_.table().cell_of(u_pick);
    out.prob_light = power_.table().prob_cell(out.light);
  }
  return out;
}

template <typename V, typename U>
auto LightSampler::sample_sky(V normal_world, U u) const noexcept {
  using F = decltype(u.x);
  if (!environment_->is_constant()) {
    return environment_->sample_map(u, sky_);
  }
  const V local = sky_ == SkyDensity::kCompensated ? cosine_hemisphere(u) : uniform_hemisphere(u);
  SkySample<F> out{frame_from_normal(normal_world).to_world(local),
                   color_of<F>(environment_->map().constant), hemisphere_pdf_solid_angle(local.z)};
  if (const MaskOf<F> anywhere = dot(normal_world, normal_world) == 0; any(anywhere)) {
    out.wi_world = select(anywhere, uniform_sphere(u), out.wi_world);
    out.pdf_solid_angle = select(anywhere, F(kInvPi * 0.25F), out.pdf_solid_angle);
  }
  return out;
}

template <typename V>
auto LightSampler::prob_environment(V point, V normal_world) const noexcept {
  using F = decltype(point.x);
  if (pick_ == LightPick::kUniform) {
    return F(1 / static_cast<float>(light_count_));
  }
  if (pick_ == LightPick::kPower) {
    return F(power_.prob_cell(light_count_ - 1));
  }
  return prob_each_far(prob_tree(scene_.light_tree.importance(point, normal_world)));
}

template <typename V, typename F>
F LightSampler::pdf_environment(V direction_world, const MapPoint<F>& at, V point,
                                V normal_world) const noexcept {
  if (environment_ == nullptr) {
    return F(0);
  }
  const F prob = prob_environment(point, normal_world);
  if (!environment_->is_constant()) {
    return prob * environment_->pdf_solid_angle(direction_world, at, sky_);
  }
  return prob * select(dot(normal_world, normal_world) == 0, F(kInvPi * 0.25F),
                       hemisphere_pdf_solid_angle(dot(normal_world, direction_world)));
}

}  // namespace core
