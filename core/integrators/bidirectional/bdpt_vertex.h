/// Vertices and subpaths of bidirectional path tracing (core/integrators/bidirectional/bdpt.cpp).
#pragma once

#include <cmath>
#include <optional>
#include <span>

#include "core/film/film.h"
#include "core/materials/adjoint_bsdf.h"
#include "core/scene/scene_data.h"
#include "core/transport/medium_sample.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Densities enter the power heuristic as squares.
inline double squared(double x) noexcept { return x * x; }

/// Partial sums of the weights at the end of a subpath, in squares. vcm: the density of this vertex
/// under the strategy that samples it from the other side, relative to that of this subpath; vc:
/// the same for all earlier vertices, without the reverse density of the next vertex.
struct PartialSums {
  double vcm = 0;
  double vc = 0;
  /// Of the strategy that merges the two subpaths at this vertex: squared number of light paths
  /// that fall into the disk around it, for a density of 1 per area. 0: they do not merge here.
  double merged = 0;
  /// As vc, of the strategy that merges them at the vertex before. Camera subpaths learn here
  /// whether light would arrive there sharply; those of light know it, and add it to vc.
  double merged_before = 0;
};

/// A subpath under construction. The sums are those at its last vertex, before the next segment.
struct Subpath : PathState {
  PartialSums sums{};
  double merged = 0;                ///< PartialSums::merged where subpaths can merge
  Rgb flight_depth{};               ///< optical depth of scattering media since the last vertex
  Rgb last_extinction = {1, 1, 1};  ///< Vertex::extinction of the last vertex
  /// Colour of PathState::u_wavelength. Both subpaths may disperse light, but it counts once.
  Rgb wavelength_color = {1, 1, 1};

  /// Returns whether the current segment began with a sharp scattering. Subpaths merge where light
  /// arrives so; connections find all other light, without bias.
  bool arrives_sharply() const noexcept { return bounces() > 0 && last.is_sharp(); }
  /// Returns whether other strategies make the path that meets a light at the end of the current
  /// segment of a camera subpath.
  bool is_shared() const noexcept { return bounces() > 0 && (sums.vcm > 0 || sums.vc > 0); }
  /// Returns the factor of the light of a whole path.
  Rgb color(bool is_dispersed) const noexcept { return is_dispersed ? wavelength_color : Rgb(1); }
};

/// The contribution of one strategy, and its weight.
struct Found {
  Rgb value;  ///< weighted
  float weight = 1;
  Rgb unweighted() const noexcept { return weight > 0 ? value / weight : Rgb{}; }
};

/// Receives the weighted contributions of strategies.
class StrategyLights {
 public:
  virtual ~StrategyLights() = default;
  /// t > 1: adds to the pixel of the camera subpath.
  virtual void add(SubpathLengths strategy, Rgb value) noexcept = 0;
  /// t = 1: as CameraSplats::add().
  virtual void splat(SubpathLengths strategy, Vec2 film_px, Rgb value) noexcept = 0;
};

template <typename P>
class PhotonPass;
struct MergedPhoton;
using MergedPhotons = PhotonPass<MergedPhoton>;

/// The camera subpath.
struct CameraSubpath : Subpath {
  PathSample out{};
  std::span<Rgb> shares{};                 ///< light shares; empty if none are recorded
  StrategyLights* lights = nullptr;        ///< null: none
  const MergedPhotons* photons = nullptr;  ///< to merge with; null: none
};

/// A surface that a subpath has hit, or a point at which it scatters in a medium.
struct Vertex {
  Vertex(const SceneData& scene, const PathState& path, const PathVertex& met)
      : surface(met), beta(path.beta), surfaces(path.scatterings() + 1), is_clear(path.is_clear) {
    in_media = path.medium_scatterings;
    is_dispersed = path.wavelength_nm > 0 && !met.drew_wavelength;
    scattering.emplace(scene.materials[surface.point.material], surface, path.footprint());
  }
  /// sample: the event along path.ray; its scatterer must outlive the vertex.
  Vertex(const PathState& path, const MediumSample& sample)
      : medium(sample.scatterer), beta(path.beta), surfaces(path.scatterings()) {
    in_media = path.medium_scatterings + 1;
    is_dispersed = path.wavelength_nm > 0;
    surface.wo_world = -path.ray.direction;
    surface.shading.origin = path.ray.origin + path.ray.direction * sample.distance_m;
    const bool is_fog = path.fog != nullptr && medium == &path.fog->medium();
    extinction = medium->sigma_t * (is_fog ? path.fog->density(origin()) : 1.0F);
  }
  Vertex(const Vertex&) = delete;
  Vertex& operator=(const Vertex&) = delete;

  Vec3 origin() const noexcept { return surface.shading.origin; }
  /// The end point of distances in densities.
  Vec3 position() const noexcept { return medium != nullptr ? origin() : surface.point.position; }
  Vec3 wo_world() const noexcept { return surface.wo_world; }
  /// Absolute cosine of the angle to the geometric normal; 1 in media, which have none.
  float cosine(Vec3 direction) const noexcept {
    return medium != nullptr ? 1.0F : std::fabs(dot(surface.point.normal_geometric, direction));
  }
  /// The normal by which lights are chosen; the same in both directions of the path.
  Vec3 light_normal() const noexcept {
    return medium != nullptr || bsdf().transmits() ? Vec3{} : surface.shading.normal_geometric;
  }
  bool has_spread() const noexcept { return medium != nullptr || bsdf().has_spread(); }
  /// Returns whether a camera and a light subpath may merge here.
  bool can_merge() const noexcept { return medium == nullptr && bsdf().has_spread(); }
  /// Pre: a surface.
  const Bsdf& bsdf() const noexcept { return scattering->seen.bsdf(); }
  /// Evaluates scattering from wo_world() to wi. In a medium the phase function is the value and
  /// both densities; the scattering coefficient is part of beta.
  ScatterEval evaluate(Vec3 wi_world, TransportMode mode) const noexcept {
    if (medium != nullptr) {
      const float phase = henyey_greenstein(-dot(wo_world(), wi_world), medium->g);
      return {Rgb(phase), phase, phase};
    }
    const SeenSurface there(scattering->at, wi_world);
    return evaluate_scatter(scattering->seen, there, mode);
  }
  /// Returns whether light has been dispersed once it leaves the vertex in this direction: the path
  /// was refracted by a dispersive solid, here or before.
  bool disperses(Vec3 wi_world) const noexcept {
    return is_dispersed || (surface.drew_wavelength && dot(surface.shading.horizon, wi_world) < 0);
  }
  /// Number of scattering events up to and including this vertex.
  int length() const noexcept { return surfaces + in_media; }

  struct Scattering {
    Scattering(const Material& material, const PathVertex& met, Footprint footprint)
        : at{material,
             met.point,
             footprint,
             met.shading.bsdf.ior,
             met.shading.bsdf.reflection_weight,
             met.shading.bsdf.refraction_weight},
          seen(at, met.wo_world) {}
    ScatterPoint at;
    SeenSurface seen;  ///< from wo_world()
  };

  const Medium* medium = nullptr;          ///< null: a surface
  PathVertex surface{};                    ///< in media only wo_world and shading.origin
  std::optional<Scattering> scattering{};  ///< at surfaces
  Rgb beta;
  int surfaces = 0;       ///< scattering events at surfaces, including this vertex
  int in_media = 0;       ///< the same in media
  bool is_clear = false;  ///< PathState::is_clear on the way here; false in media
  /// Density of a free flight that ends here, divided by its transmittance [1/m]. 1 at surfaces,
  /// where every flight ends that reaches them.
  Rgb extinction = {1, 1, 1};
  bool is_dispersed = false;       ///< the path had one wavelength before this vertex
  std::uint32_t light = kNoLight;  ///< the light at which a light subpath starts
  PartialSums sums{};              ///< at this vertex, after the segment
};

/// Density of free flight over a segment that ends at a vertex of this extinction: the mean over
/// channels. MediumStretch chooses the channel that samples a distance by throughput; weights need
/// a value that depends on the path alone, and that is the same from either end except for
/// extinction.
inline double flight_density(Rgb depth, Rgb extinction) noexcept {
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    sum += static_cast<double>(extinction[c]) * std::exp(-static_cast<double>(depth[c]));
  }
  return sum / 3;
}

}  // namespace core
