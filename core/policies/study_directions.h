/// Directions for study: by the cosine or uniformly, whatever the BSDF.
#pragma once

#include "core/bsdf/bsdf.h"

namespace core {

/// Delta lobes are sampled by the BSDF all the same. u in [0,1)^4: x picks the side, y and z the
/// direction, w between delta lobes and the rest.
BsdfSample sample_study_direction(const Bsdf& bsdf, bool cosine, Vec4 u) noexcept;

}  // namespace core
