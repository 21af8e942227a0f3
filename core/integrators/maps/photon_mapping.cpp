// Photon mapping. Each sample of the pixels has its own map: particles leave the lights and are
// stored at every surface that is not smooth, and may continue. Camera paths end at the first
// diffuse-like surface and estimate its light from the particles in a disk around the point.
//
// sppm: the disk shrinks from sample to sample, so that the mean of all samples converges. Maps are
// independent, and none is kept. Sources: Hachisuka and Jensen 2009, "Stochastic Progressive Photon
// Mapping"; radii and independent passes: Knaus and Zwicker 2011, "Progressive Photon Mapping: A
// Probabilistic Approach". photon-map: the disk has a fixed radius; with final gathering the map is
// looked up one reflection later, where its blur is not visible. Source: Jensen 1996, "Global
// Illumination Using Photon Maps".
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/integrators/first_surfaces.h"
#include "core/integrators/maps/photon_pass.h"
#include "core/integrators/maps/photon_rules.h"
#include "core/integrators/path/path_tracer.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/materials/adjoint_bsdf.h"
#include "core/math/numbers.h"
#include "core/samplers/dimensions.h"
#include "core/transport/direct_light.h"
#include "core/transport/intersect.h"
#include "core/transport/light_path.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

using Photons = PhotonPass<Photon>;

/// Selects the particles around a point that count.
enum class Gathered {
  kAll,  ///< including direct light
  kIndirect,
  kCaustic  ///< caustics only: indirect, by smooth surfaces alone
};

/// Returns three pixels at the distance of the first surfaces.
float usual_radius_m(const SceneData& scene, const FirstSurfaces& seen) {
  constexpr float kPixels = 3;
  if (seen.pixel_m > 0) {
    return kPixels * seen.pixel_m;
  }
  return (scene.radius_m > 0 ? scene.radius_m : 1.0F) / 100;
}

class PhotonTracer final : public Integrator {
 public:
  explicit PhotonTracer(const IntegratorInput& input)
      : scene_(input.scene),
        settings_(input.settings),
        emission_(input.scene, input.environment),
        lights_(input.scene, input.environment, LightPick::kTree),
        camera_paths_(input),
        paths_(photon_paths(settings_)),
        is_progressive_(radius_shrinks(settings_)) {
    const FirstSurfaces seen = first_surfaces(scene_, *input.camera, settings_.film);
    first_radius_m_ =
        settings_.photons.radius_m > 0 ? settings_.photons.radius_m : usual_radius_m(scene_, seen);
    emission_.aim(seen.eye, seen.distance_m);
  }

  PathSample trace(const Camera::CameraRay&, const PathSampler&,
                   std::uint64_t&) const noexcept override {
    return {};  // the prepass supplies photons to samples
  }
  std::unique_ptr<Prepass> start_prepass(int sample) const override;
  void run_prepass(Prepass& pass, int part, std::uint64_t& rays) const override;
  PathSample gather(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                    const Prepass& pass, std::uint64_t& rays) const noexcept override;

 private:
  void follow_particle(PathState& path, std::vector<Photon>& out) const;
  bool ends_at(const Bsdf& bsdf, const PathVertex& vertex) const noexcept;
  void follow(TracedPath& path, const Photons& photons) const noexcept;
  Rgb direct_light(TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf) const noexcept;
  Rgb light_of(const TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
               const Photons& photons, Gathered which) const noexcept;
  Rgb final_gather(const TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                   const Photons& photons) const noexcept;
  void follow_gathering(TracedPath& path, const Photons& photons) const noexcept;

  const SceneData& scene_;
  RenderSettings settings_;
  EmissionSampler emission_;
  LightSampler lights_;
  PathTracer<DefaultOptions> camera_paths_;
  int paths_;
  bool is_progressive_;
  float first_radius_m_ = 0;
};

std::unique_ptr<Prepass> PhotonTracer::start_prepass(int sample) const {
  const int pass = sample / settings_.replicates;
  const auto factor =
      is_progressive_ ? static_cast<float>(sppm_radius(settings_.photons.alpha, pass)) : 1.0F;
  return std::make_unique<Photons>(sample, paths_, first_radius_m_ * factor);
}

void PhotonTracer::run_prepass(Prepass& pass, int part, std::uint64_t& rays) const {
  static_cast<Photons&>(pass).each_path(part, settings_,
                                        [&](const PathSampler& sampler, std::vector<Photon>& out) {
                                          PathState path = start_path(sampler, rays);
                                          follow_particle(path, out);
                                        });
}

void PhotonTracer::follow_particle(PathState& path, std::vector<Photon>& out) const {
  follow_light_path(scene_, emission_, settings_.max_depth, path, [&](const LightVertex& vertex) {
    const PathVertex& at = vertex.surface;
    const int before = path.scatterings();
    if (vertex.from_light.bsdf().has_spread() && is_finite(vertex.power)) {
      out.push_back({at.point.position, vertex.power, PackedDirection(at.wo_world),
                     PackedDirection(at.shading.normal_geometric),
                     static_cast<std::uint16_t>(before), before > 0 && vertex.is_smooth});
    }
  });
}

PathSample PhotonTracer::gather(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                const Prepass& pass, std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(scene_, camera_ray, sampler, rays)};
  follow(path, static_cast<const Photons&>(pass));
  return path.out;
}

/// Returns whether a camera path looks up the map here. Surfaces with narrow lobes, which would
/// pick out single particles, are path traced.
bool PhotonTracer::ends_at(const Bsdf& bsdf, const PathVertex& vertex) const noexcept {
  constexpr float kAlphaLeast = 0.0625F;  // roughness 1/4
  const float alpha = std::min(vertex.shading.bsdf.alpha_x, vertex.shading.bsdf.alpha_y);
  return bsdf.is_diffuse_like() || (bsdf.prob_diffuse() > 0.25F && alpha >= kAlphaLeast);
}

void PhotonTracer::follow(TracedPath& path, const Photons& photons) const noexcept {
  const bool is_map = !is_progressive_ && settings_.photons.final_gather == 0;
  PathVertex vertex;
  while (camera_paths_.next_vertex(path, vertex)) {
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (!camera_paths_.visit(path, vertex, bsdf)) {
      return;
    }
    if (camera_paths_.is_at_max_depth(path) || !ends_at(bsdf, vertex)) {
      if (!camera_paths_.is_at_max_depth(path)) {
        camera_paths_.add_direct_light(path, vertex, bsdf);
      }
      if (!camera_paths_.extend(path, vertex, bsdf)) {
        return;
      }
      continue;
    }
    if (is_map) {
      path.out.radiance += light_of(path, vertex, bsdf, photons, Gathered::kAll);
    } else {
      path.out.radiance += direct_light(path, vertex, bsdf);
      path.out.radiance += light_of(path, vertex, bsdf, photons,
                                    is_progressive_ ? Gathered::kIndirect : Gathered::kCaustic);
    }
    if (!is_map && !is_progressive_) {
      path.out.radiance += final_gather(path, vertex, bsdf, photons);
    }
    if (!scatter_delta(scene_, path, vertex, bsdf) || path.scatterings() > settings_.max_depth) {
      return;
    }
  }
}

/// Returns the direct light by light samples alone.
Rgb PhotonTracer::direct_light(TracedPath& path, const PathVertex& vertex,
                               const Bsdf& bsdf) const noexcept {
  const DirectLight direct = sample_direct_light(path, vertex, bsdf, lights_);
  const Rgb open = transmittance_to(scene_, path, vertex, direct);
  return is_black(open) ? open
                        : path.beta * direct.value * open * (1 / direct.light.pdf_solid_angle);
}

/// Returns the light of the particles that the surface scatters along the path.
Rgb PhotonTracer::light_of(const TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                           const Photons& photons, Gathered which) const noexcept {
  // Minimum cosine of a particle's direction; 1e-6 of diffuse light is below it.
  constexpr float kCosLeast = 1e-3F;
  const int least = which == Gathered::kAll ? 0 : 1;
  const int most = settings_.max_depth - 1 - path.scatterings();
  const Vec3 n = vertex.shading.normal_geometric;
  Rgb sum;
  photons.map.each(vertex.point.position, [&](const Photon& photon) {
    const int scatterings = photon.scatterings;
    if (scatterings < least || scatterings > most ||
        (which == Gathered::kCaustic && !photon.is_caustic) ||
        !faces_alike(photon.normal.unpacked(), n)) {
      return;
    }
    const Vec3 wi = photon.wi_world.unpacked();
    const Rgb f = bsdf.evaluate(vertex.shading.frame.to_local(wi)).value_cos;
    sum += f * photon.power / std::max(std::fabs(dot(n, wi)), kCosLeast);
  });
  return path.beta * sum * (kInvPi / (square(photons.radius_m) * static_cast<float>(paths_)));
}

/// Final gathering: samples one more reflection and then looks up the map, for light that does not
/// come from a light directly or by smooth surfaces alone.
Rgb PhotonTracer::final_gather(const TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                               const Photons& photons) const noexcept {
  const int count = settings_.photons.final_gather;
  Rgb sum;
  for (int i = 0; i < count; ++i) {
    TracedPath branch = path;
    branch.sampler = path.sampler.branch(i, count);
    branch.out.radiance = {};
    const Vec4 u = branch.sampler.get_4d(dimension_group(branch.depth, BounceGroup::kBsdf));
    const BsdfSample sample = bsdf.sample(u.x, {u.y, u.z});
    if (is_black(sample.weight) || sample.is_delta || sample.is_null) {
      continue;  // the path itself follows smooth lobes
    }
    scatter(scene_, branch, vertex, sample, 1);
    follow_gathering(branch, photons);
    sum += branch.out.radiance;
  }
  return sum * (1 / static_cast<float>(count));
}

void PhotonTracer::follow_gathering(TracedPath& path, const Photons& photons) const noexcept {
  bool is_smooth = true;  // since gathering began: lights hit so far belong to the first surface
  PathVertex vertex;
  while (path.scatterings() <= settings_.max_depth) {
    const Rgb before = path.out.radiance;
    if (!camera_paths_.next_vertex(path, vertex)) {
      path.out.radiance = is_smooth ? before : path.out.radiance;
      return;
    }
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    const bool goes_on = camera_paths_.visit(path, vertex, bsdf);
    path.out.radiance = is_smooth ? before : path.out.radiance;
    if (!goes_on) {
      return;
    }
    if (!camera_paths_.is_at_max_depth(path)) {
      if (ends_at(bsdf, vertex)) {
        path.out.radiance += direct_light(path, vertex, bsdf);
        path.out.radiance += light_of(path, vertex, bsdf, photons, Gathered::kIndirect);
        if (!scatter_delta(scene_, path, vertex, bsdf)) {
          return;
        }
        continue;
      }
      camera_paths_.add_direct_light(path, vertex, bsdf);
    }
    const int scatterings = path.scatterings();
    if (!camera_paths_.extend(path, vertex, bsdf)) {
      return;
    }
    is_smooth = is_smooth && (path.scatterings() == scatterings || !(path.last.pdf_bsdf > 0));
  }
}

}  // namespace

float usual_photon_radius_m(const SceneData& scene, const Camera& camera,
                            const FilmSettings& film) {
  return usual_radius_m(scene, first_surfaces(scene, camera, film));
}

std::unique_ptr<const Integrator> make_photon_tracer(const IntegratorInput& input) {
  return std::make_unique<PhotonTracer>(input);
}

}  // namespace core
