/// PassPlan: the sample counts at which passes end and errors are estimated. Pure functions.
///
/// unit: sample_unit(), the samples of one complete set in every replicate and of a complete window
/// that shares light samples. Ends of passes and checks are rounded up to multiples of it. A check
/// is an estimate of the error by the task.
#pragma once

#include "core/settings/settings.h"

namespace core {

/// Returns the first count above `samples` at which a task checks its error: 1, 1.25, 1.5 and
/// 1.75 times 2^k samples per replicate, or `steps` per octave.
int next_check(int samples, int replicates, int unit = 1, int steps = 4);

/// Returns the end of the pass that starts at `samples`: after one sample, after one more, then
/// after at most an eighth of the samples so far; an even count, never beyond the next check or
/// `samples_max`. With sets, the smallest step is one complete set.
int pass_end(int samples, int samples_max, int replicates, int unit = 1);

/// Returns `limit` rounded down to complete sets, or `limit` itself if it is less than one set.
int whole_sets(int limit, int unit);

/// Returns the start of the first epoch of adaptive sampling. Epochs begin at checks, whatever rule
/// ends a job, so that extending a job gives the same film. The first begins at the first check
/// with adaptive.min_samples and enough samples to decide; each is as long as everything before it.
int first_epoch(const RenderSettings& settings);
inline int epoch_end(int from) { return 2 * from; }

/// Returns the samples that a half of a pixel gets at once: one of each of its replicates, or a
/// complete set.
int plan_step(const RenderSettings& settings);

/// Returns the pilot samples per pixel of all epochs up to the one that begins at `from`: a tenth
/// of the samples of the image.
int pilot_samples_at(int from);

}  // namespace core
