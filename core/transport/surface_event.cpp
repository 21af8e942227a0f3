#include "core/transport/surface_event.h"

#include <algorithm>
#include <cmath>

#include "core/bsdf/fresnel.h"
#include "core/color/wavelength.h"
#include "core/samplers/dimensions.h"

namespace core {
namespace {

/// Returns the index of refraction for this path, at its wavelength if it has one.
float ior_of(const PathState& path, const Material* material) noexcept {
  if (material == nullptr) {
    return 1;
  }
  const MaterialDescription& f = material->factors;
  const bool at_wavelength = f.dispersion > 0 && path.wavelength_nm > 0;
  return at_wavelength ? dispersive_ior(f.ior, f.dispersion, path.wavelength_nm)
                       : std::max(f.ior, 1.0F);
}

void solid_boundary(PathState& path, const Material& material, PathVertex& vertex) noexcept {
  BsdfParameters& b = vertex.shading.bsdf;
  const bool front = vertex.shading.front;
  const Material* around = front ? path.media.top() : path.media.without(&material);
  const MaterialDescription& f = material.factors;
  const bool disperses_around = around != nullptr && around->factors.dispersion > 0;
  if ((f.dispersion > 0 || disperses_around) && !(path.wavelength_nm > 0)) {
    const bool is_shared = path.u_wavelength >= 0;
    const WavelengthSample sample = sample_wavelength(
        is_shared ? path.u_wavelength
                  : path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kVolume)).w);
    const Rgb color = is_shared ? Rgb(1) : sample.weight;
    path.wavelength_nm = sample.wavelength_nm;
    if (front && !disperses_around) {
      const float outer = ior_of(path, around);
      const float cos_o = std::max(dot(vertex.shading.frame.n, vertex.wo_world), 0.0F);
      const float here = fresnel_dielectric(cos_o, ior_of(path, &material) / outer);
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
  b.ior = relative_ior(path, path.media, material, front);
}

}  // namespace

float relative_ior(const PathState& path, const MediumStack& media, const Material& material,
                   bool front) noexcept {
  const Material* around = front ? media.top() : media.without(&material);
  const float inner = ior_of(path, &material);
  return inner / ior_of(path, around);
}

const Medium* segment_medium(const SceneData& scene, PathState& path,
                             const PathVertex& vertex) noexcept {
  path.cone_width_m += path.cone_spread_rad * vertex.distance_m;
  const Material& material = scene.materials[vertex.point.material];
  const bool from_inside = dot(vertex.point.normal_geometric, vertex.wo_world) < 0;
  if (from_inside && material.is_volume && path.media.top() == nullptr) {
    path.media.enter(&material);
  }
  const Material* solid = path.media.top();
  return solid != nullptr ? &solid->medium : nullptr;
}

Rgb segment_transmittance(const SceneData& scene, PathState& path,
                          const PathVertex& vertex) noexcept {
  const Medium* medium = segment_medium(scene, path, vertex);
  return medium != nullptr ? transmittance(medium->sigma_t, vertex.distance_m) : Rgb(1);
}

void surface_event(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept {
  const Material& material = scene.materials[vertex.point.material];
  shade(material, vertex.point, vertex.wo_world, path.footprint(), vertex.shading);
  vertex.drew_wavelength = false;
  if (material.is_volume) {
    solid_boundary(path, material, vertex);
  }
}

}  // namespace core
