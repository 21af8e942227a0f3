/// LightSampler: picks a light and a point on it, for one scene and one environment.
///
/// uniform: every light alike; power: by emitted power; tree: the scene's light tree, with the
/// environment and directional lights beside it, in proportion to what either could send to the
/// point; ris: as the tree, for the candidates of which the
/// integrator takes one; restir: as the tree, for the samples that neighbouring pixels share.
#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/lights/environment.h"
#include "core/math/lane_math.h"
#include "core/sampling/distribution.h"
#include "core/scene/scene_data.h"

namespace core {

/// Nothing is sampled on a triangle that is seen flatter than this.
inline constexpr float kCosLightLeast = 1e-7F;

struct LightSample {
  Vec3 wi_world;                      ///< unit, to the light
  Vec3 target;                        ///< point just before the light; far away: origin + wi * huge
  bool is_far = false;                ///< environment or directional
  bool is_delta = false;              ///< pdf_solid_angle is then the probability of the pick alone
  Rgb radiance;                       ///< delta: irradiance per unit of cosine
  float pdf_solid_angle = 0;          ///< 0: nothing was sampled
  std::uint32_t triangle = kNoLight;  ///< which triangle light
  float prob_light = 0;               ///< of the pick alone
  std::uint32_t light = kNoLight;     ///< which of all: triangles, punctual lights, the environment
  Vec3 place;                         ///< on a triangle light
};

/// A sample of the lights apart from the point that it was drawn for, in a measure that is the same
/// everywhere: area on triangles [m^2], solid angle for the environment, counting for delta lights.
struct LightPoint {
  std::uint32_t light = kNoLight;  ///< as in LightSample
  Vec3 place;                      ///< of far lights: direction, unit
  Rgb radiance;                    ///< emitted; delta lights: unused
  float pdf_measure = 0;           ///< at the point that it was drawn for; 0: nothing was sampled
};

/// A LightPoint as one point sees it.
struct LightView {
  Vec3 wi_world;
  Rgb radiance;  ///< as in LightSample
  float solid_angle =
      0;  ///< for a unit of its measure; delta lights: 1; 0: no light can come from there
  float falloff = 0;  ///< what the tree's importance falls with: cos / d^2, 1 / d^2, 1
  bool is_far = false;
  bool is_delta = false;
};

class LightSampler {
 public:
  /// Both must outlive it; environment may be null. sky: what its directions are sampled by.
  LightSampler(const SceneData& scene, const Environment* environment, LightSamplerType type,
               SkyDensity sky = SkyDensity::kRadiance);

  bool empty() const noexcept { return light_count_ == 0; }
  /// normal_world: geometric, on the side that light may come from; zero: any side.
  LightSample sample(Vec3 point, Vec3 normal_world, float u_pick, Vec2 u) const noexcept;
  /// The same for delta lights alone, which no other technique can find.
  LightSample sample_delta(Vec3 point, float u_pick) const noexcept;
  /// Does sample() use the light tree alone, whatever the point?
  bool has_tree_alone() const noexcept {
    return type_ == LightSamplerType::kTree && far_count_ == 0;
  }
  /// The environment where sample() asks it or the light tree, and nothing else; else null. It is
  /// then sampled by sky_density().
  const Environment* sky_beside_tree() const noexcept {
    return type_ == LightSamplerType::kTree && far_count_ == 1 ? environment_ : nullptr;
  }
  SkyDensity sky_density() const noexcept { return sky_; }
  /// Probability with which sample() asks the tree at several points.
  template <std::size_t N>
  Floats<N> prob_tree(Vec3s<N> point, Vec3s<N> normal_world) const noexcept {
    return prob_tree(scene_.light_tree.importance(point, normal_world));
  }
  bool has_delta() const noexcept { return !scene_.punctual_lights.empty(); }
  /// Lights at a place: all but the environment and directional ones.
  bool has_local() const noexcept { return light_count_ > far_count_; }
  bool is_local(std::uint32_t light) const noexcept { return light < light_count_ - far_count_; }

  /// Density with which sample() gives the direction to a point of triangle light `light`.
  /// cos_light > 0: between the light's normal and the direction back.
  float pdf_triangle(std::uint32_t light, Vec3 point, Vec3 normal_world, float distance_m,
                     float cos_light) const noexcept;
  /// The same for the environment.
  float pdf_environment(Vec3 direction_world, Vec3 point, Vec3 normal_world) const noexcept;
  /// The same; uv, sin_theta: where the direction meets the map (Environment::pdf_solid_angle()).
  float pdf_environment(Vec3 direction_world, Vec2 uv, float sin_theta, Vec3 point,
                        Vec3 normal_world) const noexcept;
  /// Probability with which sample() picks a light; light: as in LightSample.
  float prob_light(std::uint32_t light, Vec3 point, Vec3 normal_world) const noexcept;

  LightPoint point_of(const LightSample& sample) const noexcept;
  LightView view(const LightPoint& light, Vec3 point) const noexcept;
  /// Where a shadow ray to it ends: LightSample::target.
  Vec3 target(const LightPoint& light, const LightView& view) const noexcept;
  /// Density with which sample() gives a light that is not far at `point`, in the light's measure;
  /// 0 where it does not shine on the point.
  float pdf_measure(const LightPoint& light, Vec3 point, Vec3 normal_world) const noexcept;
  /// Density over solid angle with which sample() gives it at `point`. Not for delta lights.
  float pdf_solid_angle(const LightPoint& light, const LightView& view, Vec3 point,
                        Vec3 normal_world) const noexcept;

 private:
  template <std::size_t N>
  Floats<N> prob_tree(Floats<N> irradiance_local) const noexcept;
  float prob_tree(Vec3 point, Vec3 normal_world) const noexcept;
  /// Probability with which sample() picks the environment; 0 without one.
  float prob_environment(Vec3 point, Vec3 normal_world) const noexcept;
  LightSample from_triangle(std::uint32_t light, Vec3 point, float prob, Vec2 u) const noexcept;
  LightSample from_punctual(std::size_t light, Vec3 point, float prob) const noexcept;
  LightSample from_environment(Vec3 normal_world, float prob, Vec2 u) const noexcept;
  /// Is a sky sampled in proportion to what arrives, its radiance times the cosine? Only where it
  /// is the same everywhere, and the BSDF is sampled too: shading normals see below the horizon.
  bool by_cosine(Vec3 normal_world) const noexcept {
    return sky_ == SkyDensity::kCompensated && environment_->is_constant() &&
           !(normal_world == Vec3{});
  }

  const SceneData& scene_;
  const Environment* environment_;  ///< null when black
  LightSamplerType type_;
  SkyDensity sky_;
  std::size_t triangles_ = 0;
  std::size_t local_punctual_ = 0;  ///< point and spot
  std::size_t light_count_ = 0;     ///< triangles, punctual, then the environment
  Distribution1D power_;            ///< over that order
  std::size_t far_count_ = 0;       ///< directional lights and the environment
  float irradiance_far_ = 0;  ///< of them all, unshadowed, mean over surfaces of all directions
};

/// Far lights share the rest evenly. In proportion to what both sides could send to the point,
/// unshadowed; but as neither knows what stands in between, the weaker one gets 0.4, down to where
/// it could send no more than a hundredth of the whole.
template <std::size_t N>
Floats<N> LightSampler::prob_tree(Floats<N> irradiance_local) const noexcept {
  const Floats<N> least(0.4F);
  const Floats<N> per_faint(1 / 0.01F);
  const Floats<N> one(1);
  const Floats<N> share = irradiance_local / (irradiance_local + Floats<N>(irradiance_far_));
  const Floats<N> low = least * min(share * per_faint, one);
  // Never quite 1: sharing samples relies on a far light being found wherever it is seen.
  const Floats<N> high =
      one - max(least * min((one - share) * per_faint, one), Floats<N>(0x1p-20F));
  return select(irradiance_local > Floats<N>(0), min(max(share, low), high), Floats<N>(0));
}

}  // namespace core
