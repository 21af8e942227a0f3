/// Direction sampling for study: cosine-weighted or uniform, for any BSDF.
#pragma once

#include "core/bsdf/bsdf.h"

namespace core {

/// Samples a direction. Delta lobes are still sampled by the BSDF. u in [0,1)^4: x picks the side,
/// y and z the direction, w between delta lobes and the rest.
BsdfSample sample_study_direction(const Bsdf& bsdf, bool cosine, Vec4 u) noexcept;

}  // namespace core
