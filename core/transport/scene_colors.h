/// Conversion of a scene's colours to the spectrum of a path: policies of functions that follow
/// paths.
#pragma once

#include "core/bsdf/spectral_bsdf.h"
#include "core/color/wavelengths.h"
#include "core/materials/shade.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/surface_event.h"
#include "core/transport/vertex.h"

namespace core {

/// Uses RGB colours unchanged.
struct RgbColors {
  static constexpr bool is_spectral = false;  // NOLINT(readability-identifier-naming): a trait
  static Rgb values(Rgb color) noexcept { return color; }
  static Rgb color(Rgb values) noexcept { return values; }
  static const Medium& medium(const Material& material) noexcept { return material.medium; }
  /// Called for each stretch of medium along a shadow ray.
  static void passed(const Medium&, float /*depth_m*/) noexcept {}
};

/// The same, and sums the optical depth of scattering media.
class FlightColors : public RgbColors {
 public:
  /// depth must outlive it.
  explicit FlightColors(Rgb& depth) noexcept : depth_(depth) {}
  void passed(const Medium& medium, float depth_m) const noexcept {
    if (medium.scatters()) {
      depth_ += medium.sigma_t * depth_m;
    }
  }

 private:
  Rgb& depth_;
};

/// Takes them at three wavelengths.
class SpectralColors {
 public:
  static constexpr bool is_spectral = true;  // NOLINT(readability-identifier-naming): a trait
  /// wavelengths must outlive it.
  explicit SpectralColors(const Wavelengths& wavelengths) noexcept : wavelengths_(wavelengths) {}

  Rgb values(Rgb color) const noexcept { return wavelengths_.values(color); }
  Rgb color(Rgb values) const noexcept { return wavelengths_.color(values); }
  /// Absorption is as deep as its colour is at the distance that the material gives.
  Medium medium(const Material& material) const noexcept;
  /// Coefficients are colours.
  Medium medium(const Medium& coefficients) const noexcept;
  /// Colours of a shaded point.
  void shade(Shading& shading) const noexcept;
  /// Fills vertex.shading, and the auxiliary layers, in colours, at the path's first surface.
  void surface_event(const SceneData& scene, const PathState& path, PathVertex& vertex,
                     PathSample& out) const noexcept;
  /// As core::relative_ior(), at the wavelengths.
  Rgb relative_ior(const BoundaryMedia& at) const noexcept;
  /// The BSDF at a point shaded so.
  SpectralBsdf bsdf(const PathState& path, const PathVertex& vertex) const noexcept;
  static void passed(const Medium&, float /*depth_m*/) noexcept {}

 private:
  const Wavelengths& wavelengths_;
};

}  // namespace core
