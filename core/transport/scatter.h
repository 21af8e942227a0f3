/// scatter: continues a path in a sampled direction; Russian roulette, which may end it.
#pragma once

#include <optional>

#include "core/materials/adjoint_bsdf.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Continues `path` from `vertex` along a BSDF sample whose weight is not black: throughput, next
/// ray, media, ray cone and path.last. light_samples: taken at this vertex, for MIS.
void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const BsdfSample& sample, float light_samples) noexcept;
/// The same along a direction of sample_scatter() in that mode; one light sample at each vertex.
void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const ScatterSample& sample, TransportMode mode) noexcept;

/// Magnitude of the largest channel, which roulette goes by.
float throughput_size(Rgb beta) noexcept;

/// Probability with which Russian roulette continues the path after scatter()
/// (core/transport/roulette.h). eta_scale takes out the n^2 of radiance in denser media, which
/// comes back when the path leaves them.
float continuation_probability(const PathState& path) noexcept;

/// Russian roulette: continues the path with probability `survive` (1 and more: certain) and
/// divides its throughput by it. u in [0,1). False: the path is over.
bool survives_roulette(PathState& path, float u, float survive) noexcept;

}  // namespace core
