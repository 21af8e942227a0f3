#include "core/transport/scene_colors.h"

#include <cmath>

#include "core/color/wavelength.h"
#include "core/samplers/dimensions.h"
#include "core/transport/surface_event.h"

namespace core {

Medium SpectralColors::medium(const Material& material) const noexcept {
  const MaterialDescription& f = material.factors;
  return medium_within(f, values(f.attenuation_color), values(f.multiscatter_color));
}

Medium SpectralColors::medium(const Medium& coefficients) const noexcept {
  return {values(coefficients.sigma_t), values(coefficients.sigma_s), coefficients.g};
}

void SpectralColors::shade(Shading& s) const noexcept {
  s.bsdf.base_color = values(s.bsdf.base_color);
  s.bsdf.f0 = values(s.bsdf.f0);
  s.bsdf.specular_color = values(s.bsdf.specular_color);
  if (s.has_layers) {
    s.layers.for_each_color([this](Rgb& color) { color = values(color); });
    s.layers.wavelengths_nm = wavelengths_.nm();
  }
}

void SpectralColors::surface_event(const SceneData& scene, const PathState& path,
                                   PathVertex& vertex, PathSample& out) const noexcept {
  const Material& material = scene.materials[vertex.point.material];
  Shading& s = vertex.shading;
  core::shade(material, vertex.point, vertex.wo_world, path.footprint(), s);
  vertex.drew_wavelength = false;
  if (vertex.face.solid != nullptr) {
    s.bsdf.ior = core::relative_ior(path, {path.media, vertex.beyond, s.front});
  }
  if (!out.hit) {
    record_first_surface(out, vertex, make_bsdf(s, vertex.wo_world).albedo());
  }
  shade(s);
}

Rgb SpectralColors::relative_ior(const BoundaryMedia& at) const noexcept {
  const Rgb nm = wavelengths_.nm();
  const auto ior = [nm](const Solid* solid) {
    if (solid == nullptr || solid->ior == 1) {
      return Rgb(1);
    }
    const MaterialDescription& f = solid->material->factors;
    if (f.ior_curve.is_known()) {
      return Rgb{f.ior_curve.at(nm.r), f.ior_curve.at(nm.g), f.ior_curve.at(nm.b)};
    }
    const auto dispersed = [&f](float one) { return dispersive_ior(f.ior, f.dispersion, one); };
    return f.dispersion > 0 ? Rgb{dispersed(nm.r), dispersed(nm.g), dispersed(nm.b)}
                            : Rgb(solid->ior);
  };
  const Rgb inner = ior(at.within);
  const Rgb outer = ior(at.around);
  return {inner.r / outer.r, inner.g / outer.g, inner.b / outer.b};
}

SpectralBsdf SpectralColors::bsdf(const PathState& path, const PathVertex& vertex) const noexcept {
  const Shading& s = vertex.shading;
  SpectralSurface at{.ior = Rgb(s.bsdf.ior)};
  if (vertex.face.solid != nullptr) {
    at.ior = relative_ior({path.media, vertex.beyond, s.front});
    if (!(at.ior == Rgb(at.ior.r))) {
      // The colours of all wavelengths have the same norm, so only the path's throughput matters.
      const Rgb size = {std::fabs(path.beta.r), std::fabs(path.beta.g), std::fabs(path.beta.b)};
      const float sum = size.r + size.g + size.b;
      at.prob = sum > 0 ? size / sum : at.prob;
      at.u_pick = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kVolume)).w;
    }
  }
  return SpectralBsdf(s.bsdf, s.frame.to_local(vertex.wo_world), s.frame.to_local(s.horizon),
                      s.has_layers ? &s.layers : nullptr, at);
}

}  // namespace core
