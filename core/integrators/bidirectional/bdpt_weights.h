/// Weights of bidirectional path tracing: the power heuristic (squares) over all strategies that
/// can sample the same path, carried along both subpaths as two partial sums.
///
/// The weights of a path sum to 1 over its strategies. Therefore every density in them is a
/// function of the path alone: Russian roulette and the random choice of null scattering are left
/// out, and the density of free flight is flight_density(), not that of the chosen channel.
///
/// path-caustics leaves out connections and splats. The vcm of a vertex then belongs to the light
/// sample that could have found the emitter, and ends there; and all scattering between the light
/// and a merge is sharp, which light subpaths know and camera subpaths learn on the way.
///
/// Densities are per area at surfaces and per volume in media: that of direction and distance over
/// the squared distance, times the cosine at a surface.
///
/// Sources: Veach 1997, 10.2; the partial sums: van Antwerpen 2011, "Recursive MIS computation for
/// streaming BDPT on the GPU", and Georgiev 2012, "Implementing vertex connection and merging",
/// where the sums for merging are those for connections over PartialSums::merged; media: Lafortune
/// and Willems 1996, "Rendering participating media with bidirectional path tracing", and PBR 3rd
/// ed., 16.3.
#pragma once

#include "core/integrators/bidirectional/bdpt_vertex.h"
#include "core/integrators/integrator.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/light_samplers/light_sampler.h"

namespace core {

class BdptWeights {
 public:
  /// The input's scene, environment and camera, and the samplers must outlive it.
  BdptWeights(const IntegratorInput& input, const LightSampler& lights,
              const EmissionSampler& emission);

  bool has_media() const noexcept { return has_media_; }  ///< scattering media
  /// Returns whether subpaths are connected, to each other and to the camera.
  bool connects() const noexcept { return connects_; }

  /// Sums of a subpath that starts at the camera.
  PartialSums from_camera(const Ray& ray) const noexcept;
  /// Sums at a vertex that the subpath has reached; its path.last, path.flight_depth and
  /// path.last_extinction are those of the segment. light: the start of the light subpath.
  PartialSums at_light_vertex(const Subpath& path, const EmissionSample& light,
                              const Vertex& vertex) const noexcept;
  PartialSums at_camera_vertex(const Subpath& path, const Vertex& vertex) const noexcept;
  /// Sums of a subpath that continues from a vertex with these sums. cosine: between the new
  /// direction and the normal there. forward: solid-angle density of the new direction; reverse: of
  /// the old one, given the new one.
  PartialSums after_scattering(const PartialSums& here, double cosine, double forward,
                               double reverse, TransportMode mode) const noexcept;
  /// The same for a delta direction.
  static PartialSums after_delta(const PartialSums& here, double cosine) noexcept {
    return {0, (here.vc + here.merged_before) * squared(cosine)};
  }

  // MIS weights. flight_depth: optical depth of scattering media along the connection.

  /// s = 0 where the path leaves the scene.
  double background(const Subpath& path) const noexcept;
  /// s = 0 at a triangle that emits.
  double emission(const Subpath& path, const Vertex& vertex) const noexcept;
  /// s = 1.
  double light_sample(const Vertex& vertex, const LightSample& light, const ScatterEval& f,
                      Rgb flight_depth) const noexcept;
  /// t = 1.
  double splat(const Vertex& vertex, const Camera::ImportanceSample& to, const ScatterEval& f,
               Rgb flight_depth) const noexcept;
  /// s > 1, t > 1. wi_world: unit, from the camera vertex to the light vertex; f, g: scattering
  /// there.
  double connection(const Vertex& from_camera, const Vertex& from_light, Vec3 wi_world,
                    const ScatterEval& f, const ScatterEval& g, Rgb flight_depth) const noexcept;
  /// Both subpaths end at the same vertex. f: scattering there, towards the light subpath's last
  /// segment. Pre: from_camera.merged > 0.
  double merging(const PartialSums& from_camera, const PartialSums& from_light,
                 const ScatterEval& f) const noexcept;

 private:
  /// Sum over all strategies that sample more vertices from the other side, beyond this one.
  /// reverse: solid-angle density, at the vertex, of the direction back along the subpath; of
  /// scattering towards the camera if `mode` is kImportance.
  double beyond(const PartialSums& sums, double reverse, TransportMode mode) const noexcept;
  double beyond(const PartialSums& sums, float reverse, TransportMode mode) const noexcept {
    return beyond(sums, static_cast<double>(reverse), mode);
  }
  double flight(Rgb depth, Rgb extinction) const noexcept {
    return has_media_ ? flight_density(depth, extinction) : 1.0;
  }
  /// Includes the free flight along the last segment, which ends at a vertex of this extinction.
  PartialSums after_flight(const Subpath& path, Rgb extinction) const noexcept;
  PartialSums after_segment(const Subpath& path, const Vertex& vertex) const noexcept;
  double camera_density(const Camera::Importance& importance) const noexcept {
    return static_cast<double>(camera_.is_orthographic() ? importance.pdf_area
                                                         : importance.pdf_solid_angle);
  }

  const SceneData& scene_;
  const Environment* environment_;
  const Camera& camera_;
  const LightSampler& lights_;
  const EmissionSampler& emission_;
  double light_paths_;  ///< one for each pixel of the full film
  bool has_media_;
  bool connects_;
};

}  // namespace core
