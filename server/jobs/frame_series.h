/// Frames: jobs of a batch that differ by camera and time alone, as those of a turntable or an
/// animation, in the order of the batch.
#pragma once

#include "server/jobs/job_service.h"
#include "server/store/batch_table.h"

namespace server {

struct FramesAround {
  JobPointer before;  ///< null: it is the first
  JobPointer after;   ///< null: it is the last
};

/// Returns whether the jobs differ at most by camera, time, seed, rules that end them, and what no
/// image shows, such as names.
bool are_frames(const api::JobSpec& a, const api::JobSpec& b);

/// Errors: of the store.
core::Result<FramesAround> frames_around(JobService& jobs, BatchTable& batches, const Job& job);

}  // namespace server
