/// PassPlan: at which sample counts the picture is complete and decisions are taken. Pure functions.
#pragma once

#include "core/render/settings.h"

namespace core {

/// The first count above `samples` at which errors are looked at: 2^k and 1.5 * 2^k samples per
/// replicate.
int next_look(int samples, int replicates);

/// How many looks there are up to `samples_max`.
int look_count(int samples_max, int replicates);

/// Where the pass that starts at `samples` ends: one sample, one more, then at most an eighth of what
/// is there, never beyond the next look or `samples_max`, and even.
int pass_end(int samples, int samples_max, int replicates);

}  // namespace core
