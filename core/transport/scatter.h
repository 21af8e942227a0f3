/// scatter: continues a path in a sampled direction; Russian roulette may end it.
#pragma once

#include "core/materials/adjoint_bsdf.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Continues `path` from `vertex` with a BSDF sample whose weight is not black: updates throughput,
/// ray, media, ray cone and path.last. light_samples: number taken at this vertex, for MIS.
void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const BsdfSample& sample, float light_samples) noexcept;
/// As above, for a direction from sample_scatter() in that transport mode, with one light sample
/// per vertex.
void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const ScatterSample& sample, TransportMode mode) noexcept;

/// Continues `path` from `vertex` in a delta direction alone, with the numbers "bsdf" of its depth.
/// Returns false if there is none.
bool scatter_delta(const SceneData& scene, PathState& path, const PathVertex& vertex,
                   const Bsdf& bsdf) noexcept;

/// Returns the probability with which Russian roulette continues the path after scatter()
/// (core/transport/roulette.h). eta_scale removes the n^2 of radiance in denser media, which is
/// undone when the path leaves them.
float continuation_probability(const PathState& path) noexcept;

}  // namespace core
