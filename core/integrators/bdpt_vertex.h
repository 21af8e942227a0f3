/// Vertices and subpaths of bidirectional path tracing (core/integrators/bdpt.cpp).
#pragma once

#include <cmath>
#include <span>

#include "core/film/film.h"
#include "core/materials/adjoint_bsdf.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Of the power heuristic.
inline double squared(double x) noexcept { return x * x; }

/// Partial sums of the weights at the end of a subpath, in squares. vcm: the density with which the
/// strategy that makes this vertex from the other side does so, over that of this subpath; vc: the
/// same for all vertices before it, without the density of the next one backwards.
struct PartialSums {
  double vcm = 0;
  double vc = 0;
};

/// A subpath under construction. Sums are as of its last vertex, before the next segment.
struct Subpath : PathState {
  PartialSums sums{};
};

/// What one strategy has found, with its weight.
struct Found {
  Rgb value;  ///< weighted
  float weight = 1;
  Rgb unweighted() const noexcept { return weight > 0 ? value / weight : Rgb{}; }
};

/// The camera's subpath.
struct CameraSubpath : Subpath {
  PathSample out{};
  std::span<Rgb> shares{};  ///< of the light; empty: not asked for
};

/// A surface that a subpath has met.
struct Vertex {
  Vertex(const SceneData& scene, const PathState& path, const PathVertex& met)
      : surface(met),
        at{scene.materials[surface.point.material],
           surface.point,
           path.footprint(),
           surface.shading.bsdf.ior,
           surface.shading.bsdf.reflection_weight,
           surface.shading.bsdf.refraction_weight},
        seen(at, surface.wo_world),
        beta(path.beta),
        scatterings(path.scatterings()) {}
  Vertex(const Vertex&) = delete;
  Vertex& operator=(const Vertex&) = delete;

  Vec3 origin() const noexcept { return surface.shading.origin; }
  float cosine(Vec3 direction) const noexcept {
    return std::fabs(dot(surface.point.normal_geometric, direction));
  }
  /// For the choice of a light, the same whichever way the path goes.
  Vec3 light_normal() const noexcept {
    return seen.bsdf().transmits() ? Vec3{} : surface.shading.normal_geometric;
  }

  PathVertex surface;
  ScatterPoint at;
  SeenSurface seen;  ///< from where the subpath comes
  Rgb beta;
  int scatterings;
  std::uint32_t light = kNoLight;  ///< where a light's subpath began
  PartialSums sums{};              ///< here, after the segment
};

}  // namespace core
