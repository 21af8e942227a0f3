/// Paths that begin at a light.
#pragma once

#include "core/light_samplers/emission_sampler.h"
#include "core/transport/path_state.h"

namespace core {

/// Starts `path` at a light, with the random numbers of kStartGroup and kAimGroup: its ray, where
/// the ray began, and its throughput, the emitted power. A throughput of 0: nothing was sampled.
EmissionSample start_light_path(PathState& path, const EmissionSampler& emission) noexcept;

}  // namespace core
