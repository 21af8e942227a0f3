/// medium_sample: where a path scatters within the medium around its segment.
#pragma once

#include "core/film/film.h"
#include "core/media/medium.h"
#include "core/transport/path_state.h"

namespace core {

struct MediumSample {
  const Medium* scatterer = nullptr;  ///< null: the path reaches the end of its segment
  float distance_m = 0;               ///< where it scatters
  float depth_m = 0;                  ///< to where the path scatters, or to the end of the medium
  Rgb weight = {1, 1, 1};             ///< transmittance, and scattering coefficient, over density
};

/// The medium around a path's segment, from path.ray.origin along its direction. Where the
/// coefficients differ by channel, one channel is picked by throughput, its distance is
/// exponential, and the densities of all of them count: no channel's weight grows beyond their
/// number. Source: Wilkie et al., Hero Wavelength Spectral Sampling, 2014, for the weights.
class MediumStretch {
 public:
  /// distance_m: to the next surface. solid: around the segment; null: there is none, but path.fog
  /// if path.media is empty. Both must outlive it.
  MediumStretch(const PathState& path, const Medium* solid, float distance_m) noexcept;

  bool scatters() const noexcept { return depth_m_ > 0 && medium_->scatters(); }
  const Medium& medium() const noexcept { return *medium_; }  ///< if it scatters
  bool is_fog() const noexcept { return fog_ != nullptr; }
  /// path: the same, for its random numbers.
  MediumSample sample(const PathState& path) const noexcept;

  // The rest is for media that scatter.

  struct Point {
    Vec3 point;
    Rgb passed{};       ///< transmittance up to there
    float density = 1;  ///< which the coefficients are multiplied by
    float pdf_m = 0;    ///< of sample() [1/m]
  };
  Point at(float distance_m) const noexcept;
  /// Distances along the segment at which the medium begins and ends [m].
  Fog::Range range() const noexcept;
  /// Half of the samples that scatter do so before, if the extinction is the mean of the channels'.
  Vec3 median() const noexcept;

 private:
  const Medium* medium_ = nullptr;
  const Fog* fog_ = nullptr;  ///< null: a solid, or nothing
  Vec3 origin_;
  Vec3 direction_;
  float length_m_ = 0;
  float depth_m_ = 0;
  Rgb probs_;  ///< of the channels
};

/// A sample of the whole segment.
inline MediumSample sample_medium(const PathState& path, const Medium* solid,
                                  float distance_m) noexcept {
  return MediumStretch(path, solid, distance_m).sample(path);
}

/// Widening of the ray cone where it scatters [rad]: that of a rough surface.
inline constexpr float kMediumConeSpread = 0.1F;

/// Scatters at `point` in a medium: the next direction by its phase function, u in [0,1).
void scatter_within(PathState& path, const Medium& medium, Vec3 point, Vec2 u) noexcept;

/// Fills the auxiliary layers at a path's first event, a scattering event in a medium.
/// direction: unit direction of the arriving path.
void record_first_scattering(PathSample& out, const MediumSample& sample, Vec3 direction) noexcept;

/// Maximum number of scattering events in media for each bounce that max_depth allows. They do not
/// count as bounces, because milk has hundreds where a room has two. At an albedo of 0.99, which
/// loses half of the light in 69 events, Russian roulette ends nearly all paths earlier.
inline constexpr int kMediumScatterings = 64;

}  // namespace core
