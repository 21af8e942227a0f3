/// PassPlan: at which sample counts the picture is complete and decisions are taken. Pure
/// functions.
///
/// unit: samples of one whole set in every replicate, and of a whole window that shares light
/// samples, sample_unit(); passes and looks are rounded up to whole ones.
#pragma once

#include "core/settings/settings.h"

namespace core {

/// The first count above `samples` at which a task estimates its error: 1, 1.25, 1.5 and 1.75 times
/// 2^k samples per replicate, or so many steps of an octave.
int next_look(int samples, int replicates, int unit = 1, int steps = 4);

/// Where the pass that starts at `samples` ends: one sample, one more, then at most an eighth of
/// what is there, never beyond the next look or `samples_max`, and even. With sets, a whole one is
/// the least step.
int pass_end(int samples, int samples_max, int replicates, int unit = 1);

/// The most samples that `limit` allows: whole sets, or `limit` itself where it is below one.
int whole_sets(int limit, int unit);

/// Epochs of adaptive sampling. They begin at looks, whatever rule ends a job: extending it gives
/// the same film. The first begins at the first look that has adaptive.min_samples, and enough to
/// decide anything; each is as long as everything before it.
int first_epoch(const RenderSettings& settings);
inline int epoch_end(int from) { return 2 * from; }

/// Samples that a half of a pixel gets at once: one of each of its replicates, or a whole set.
int plan_step(const RenderSettings& settings);

/// Pilot samples of a pixel, all epochs together, by the epoch that begins at `from`: a tenth of
/// what the picture has.
int pilot_samples_at(int from);

}  // namespace core
