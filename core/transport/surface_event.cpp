#include "core/transport/surface_event.h"

#include <algorithm>

#include "core/bsdf/fresnel.h"
#include "core/color/wavelength.h"
#include "core/samplers/dimensions.h"

namespace core {
namespace {

bool disperses(const Solid* solid) noexcept {
  return solid != nullptr && solid->ior > 1 && solid->material->factors.dispersion > 0;
}

/// Returns the index of refraction for this path, at its wavelength if it has one.
float ior_of(const PathState& path, const Solid* solid) noexcept {
  if (solid == nullptr) {
    return 1;
  }
  return disperses(solid) && path.wavelength_nm > 0
             ? dispersive_ior(solid->ior, solid->material->factors.dispersion, path.wavelength_nm)
             : solid->ior;
}

void solid_boundary(PathState& path, PathVertex& vertex) noexcept {
  BsdfParameters& b = vertex.shading.bsdf;
  const bool front = vertex.shading.front;
  const BoundaryMedia at(path.media, vertex.beyond, front);
  const bool disperses_around = disperses(at.around);
  if ((disperses(at.within) || disperses_around) && !(path.wavelength_nm > 0)) {
    const bool is_shared = path.u_wavelength >= 0;
    const WavelengthSample sample = sample_wavelength(
        is_shared ? path.u_wavelength
                  : path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kVolume)).w);
    const Rgb color = is_shared ? Rgb(1) : sample.weight;
    path.wavelength_nm = sample.wavelength_nm;
    if (front && !disperses_around) {
      const MaterialDescription& f = at.within->material->factors;
      const float outer = ior_of(path, at.around);
      const float cos_o = std::max(dot(vertex.shading.frame.n, vertex.wo_world), 0.0F);
      const float here = fresnel_dielectric(cos_o, ior_of(path, at.within) / outer);
      const Rgb n = mean_dispersive_ior(f.ior, f.dispersion);
      b.reflection_weight = here > 0 ? Rgb{fresnel_dielectric(cos_o, n.r / outer),
                                           fresnel_dielectric(cos_o, n.g / outer),
                                           fresnel_dielectric(cos_o, n.b / outer)} /
                                           here
                                     : Rgb(1);
      b.refraction_weight = color;
      vertex.drew_wavelength = true;
    } else {
      path.beta *= color;
    }
  }
  b.ior = relative_ior(path, at);
}

}  // namespace

float relative_ior(const PathState& path, const BoundaryMedia& at) noexcept {
  return ior_of(path, at.within) / ior_of(path, at.around);
}

float hole_factor(const PathState& path, const MediumStack& media,
                  const MediumStack& beyond) noexcept {
  const float ior = relative_ior(path, BoundaryMedia(media, beyond, true));
  return path.is_from_light ? ior * ior : 1 / (ior * ior);
}

const Material* segment_solid(PathState& path, const PathVertex& vertex) noexcept {
  path.cone_width_m += path.cone_spread_rad * vertex.distance_m;
  return path.media.medium_to(vertex.face);
}

Rgb segment_transmittance(PathState& path, const PathVertex& vertex) noexcept {
  const Material* solid = segment_solid(path, vertex);
  return solid != nullptr ? transmittance(solid->medium.sigma_t, vertex.distance_m) : Rgb(1);
}

void surface_event(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept {
  const Material& material = scene.materials[vertex.point.material];
  shade(material, vertex.point, vertex.wo_world, path.footprint(), vertex.shading);
  vertex.drew_wavelength = false;
  if (vertex.face.solid != nullptr) {
    solid_boundary(path, vertex);
  }
}

}  // namespace core
