/// SpectralBsdf: the surface at a path's three wavelengths.
///
/// If their indices of refraction differ, there is a BSDF for each. One of them is picked to sample
/// the direction; densities are means over the picks, so that wavelengths are combined by the
/// balance heuristic. An event that only one wavelength can have, refraction at a smooth boundary,
/// sets the others to zero. Source: Wilkie et al., Hero Wavelength Spectral Sampling, 2014.
#pragma once

#include <array>
#include <optional>

#include "core/bsdf/bsdf.h"

namespace core {

/// Surface parameters per wavelength.
struct SpectralSurface {
  Rgb ior = Rgb(1.5F);   ///< of a solid relative to its surroundings
  Rgb prob = {1, 0, 0};  ///< of picking a wavelength; if indices differ, 0 for wavelengths not
                         ///< carried
  float u_pick = 0;      ///< in [0,1)
};

class SpectralBsdf {
 public:
  /// As Bsdf; the colours of parameters and layers are values at the wavelengths.
  SpectralBsdf(const BsdfParameters& parameters, Vec3 wo_local, Vec3 ng_local,
               const BsdfLayers* layers, const SpectralSurface& at) noexcept;

  BsdfEval evaluate(Vec3 wi_local) const noexcept;
  BsdfSample sample(float u_lobe, Vec2 u_dir) const noexcept;
  bool has_spread() const noexcept { return picked().has_spread(); }
  bool is_diffuse_like() const noexcept { return picked().is_diffuse_like(); }
  bool transmits() const noexcept { return picked().transmits(); }
  Rgb null_transmittance() const noexcept {
    return disperses_ ? Rgb{} : picked().null_transmittance();
  }
  Rgb albedo() const noexcept { return picked().albedo(); }

 private:
  const Bsdf& picked() const noexcept { return *each_[picked_]; }

  std::array<std::optional<Bsdf>, 3> each_;  ///< for wavelengths that may be picked
  std::size_t picked_ = 0;
  Rgb prob_;
  bool disperses_ = false;  ///< more than one may be picked
};

}  // namespace core
