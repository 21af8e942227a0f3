/// SpectralBsdf: the surface at a path's three wavelengths.
///
/// Where their indices of refraction differ it is a BSDF for each. One of them is picked and gives
/// the direction; densities are means over the picks, so that each wavelength counts with the
/// balance heuristic. What one wavelength alone can do, refraction at a smooth boundary, leaves the
/// others black. Source: Wilkie et al., Hero Wavelength Spectral Sampling, 2014.
#pragma once

#include <array>
#include <optional>

#include "core/bsdf/bsdf.h"

namespace core {

/// What is at a surface at each wavelength.
struct SpectralSurface {
  Rgb ior = Rgb(1.5F);   ///< of a solid relative to its surroundings
  Rgb prob = {1, 0, 0};  ///< of picking a wavelength; where indices differ, 0 if none is carried
  float u_pick = 0;      ///< in [0,1)
};

class SpectralBsdf {
 public:
  /// As Bsdf; colours of parameters and layers are at the wavelengths.
  SpectralBsdf(const BsdfParameters& parameters, Vec3 wo_local, Vec3 ng_local,
               const BsdfLayers* layers, const SpectralSurface& at) noexcept;

  BsdfEval evaluate(Vec3 wi_local) const noexcept;
  BsdfSample sample(float u_lobe, Vec2 u_dir) const noexcept;
  bool has_spread() const noexcept { return picked().has_spread(); }
  bool is_wide() const noexcept { return picked().is_wide(); }
  bool transmits() const noexcept { return picked().transmits(); }
  Rgb straight() const noexcept { return disperses_ ? Rgb{} : picked().straight(); }
  Rgb albedo() const noexcept { return picked().albedo(); }

 private:
  const Bsdf& picked() const noexcept { return *each_[picked_]; }

  std::array<std::optional<Bsdf>, 3> each_;  ///< of those that may be picked
  std::size_t picked_ = 0;
  Rgb prob_;
  bool disperses_ = false;  ///< several may be
};

}  // namespace core
