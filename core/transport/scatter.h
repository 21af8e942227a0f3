/// scatter: a path goes on in a sampled direction; roulette: or ends.
#pragma once

#include <optional>

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Continues `path` from `vertex` along a BSDF sample whose weight is not black: throughput, next
/// ray, media, ray cone and path.last. light_samples: taken at this vertex, for MIS.
void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const BsdfSample& sample, float light_samples) noexcept;

/// Probability with which Russian roulette continues the path after scatter()
/// (core/transport/roulette.h). eta_scale takes out the n^2 of radiance in denser media, which
/// comes back when the path leaves them.
float continuation_probability(const PathState& path) noexcept;

}  // namespace core
