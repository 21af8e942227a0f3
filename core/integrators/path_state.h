/// What a path carries, for path.cpp and path_direct.cpp alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/integrators/path.h"
#include "core/math/numbers.h"

namespace core {

/// Holes and clear surfaces do not count as scattering; this bounds a path that meets nothing
/// else.
inline constexpr int kPassThroughMax = 4096;
inline constexpr float kFar = 3.0e38F;

inline Rgb absorbed(Rgb sigma_a, float distance_m) {
  return {std::exp(-sigma_a.r * distance_m), std::exp(-sigma_a.g * distance_m),
          std::exp(-sigma_a.b * distance_m)};
}

inline Bsdf make_bsdf(const Shading& shading, Vec3 wo_world) {
  return Bsdf(shading.bsdf, shading.frame.to_local(wo_world),
              shading.frame.to_local(shading.horizon),
              shading.has_layers ? &shading.layers : nullptr);
}

/// What a path carries from vertex to vertex.
struct PathIntegrator::State {
  PathSampler sampler;
  std::uint64_t& rays;
  PathSample out{};
  Ray ray{};
  Rgb beta = {1, 1, 1};
  int depth = 0;             ///< surfaces met so far, holes left out: names the random numbers
  int straight = 0;          ///< of these, clear ones that the path went straight through
  float pdf_bsdf = 0;        ///< density of the last direction; 0: camera or delta
  Vec3 last_point{};
  Vec3 last_normal{};          ///< as given to the light sampler at the last vertex
  float last_count = 1;        ///< light samples there, in the weights of MIS
  float group_count = 0;       ///< at the first surface, of the group for each of the pixel's paths; 0: it is not in one
  bool last_controlled = false;  ///< its lights of closed form are left to light samples
  bool last_fitted = false;      ///< its weights are fitted
  bool in_pair = false;          ///< nothing has been met since then: what this ray finds, a light sample could have
  float eta_scale = 1;       ///< product of eta^2: radiance against importance
  float cone_width_m = 0;
  float cone_spread_rad = 0;
  bool is_sharp = true;        ///< no rough surface so far: textures are seen as the camera sees them
  MediumStack media{};       ///< the solids that the path is in
  std::uint32_t pass_through = 0;
  float wavelength_nm = 0;  ///< 0: the path carries all of them
  float u_roulette = -1;  ///< of this bounce; below 0: not drawn yet
  float share = 1;        ///< of the pixel: less where a path was split
  std::uint32_t dice = 0;  ///< thrown where expected values are not used

  Footprint footprint() const noexcept { return {cone_width_m, is_sharp}; }
};

/// What a light sample adds to the pixel if nothing is in its way: value * scale.
struct PathIntegrator::DirectLight {
  LightSample light;
  Rgb value;
  float scale = 0;
  Rgb control;  ///< mean of the control variate less the control variate; is added whatever is in the way
  float share = 1;       ///< of MIS
  bool in_pair = false;  ///< nothing at all is in the way: a BSDF sample could have found it, and its density is known
};

/// What gets along a shadow ray, and whether it met nothing at all.
struct PathIntegrator::Passage {
  Rgb share;
  bool is_empty = false;
};

/// How much a contribution weighs; above 0 for all that is not black, of whatever sign.
inline float size_of(Rgb c) { return luminance({std::fabs(c.r), std::fabs(c.g), std::fabs(c.b)}); }

/// x modulo 1, for x >= 0.
constexpr float fraction(float x) { return x < 1 ? x : x - static_cast<float>(static_cast<int>(x)); }

/// Candidate k of `count`, u being uniform in [0,1)^3: it picks its light in stratum k, and its place on the light by an R2
/// sequence (Roberts 2018), so that all of them together follow the light sampler's density.
struct Candidate {
  float pick = 0;
  Vec2 place;
};
inline Candidate candidate(Vec4 u, int k, int count) {
  const auto i = static_cast<float>(k);
  return {std::min((u.x + i) / static_cast<float>(count), kOneMinusEpsilon),
          {fraction(u.y + i * 0.754877666F), fraction(u.z + i * 0.569840291F)}};
}

/// Light samples at the path's surface, in the weights of MIS.
inline float PathIntegrator::light_count(const State& path) const noexcept {
  return path.depth == 0 && path.group_count > 0 ? path.group_count : static_cast<float>(candidates(path.depth));
}

struct PathIntegrator::Vertex {
  SurfacePoint point;
  Vec3 wo_world;
  float distance_m = 0;
  Shading shading;
  Vec3 light_normal;  ///< for the light sampler: zero where light may come from behind
  bool drew_wavelength = false;  ///< here, for what is refracted alone
};

}  // namespace core
