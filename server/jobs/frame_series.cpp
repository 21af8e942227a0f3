#include "server/jobs/frame_series.h"

#include <algorithm>

#include "core/render/task/settle.h"
#include "server/jobs/job_record.h"

namespace server {
namespace {

/// Returns the first of these that is a frame of the series; null: none is.
template <typename Id>
core::Result<JobPointer> first_frame(JobService& jobs, const api::JobSpec& spec, Id id, Id end) {
  for (; id != end; ++id) {
    auto job = jobs.index().find(*id);
    if (!job && job.error().code != core::ErrorCode::kNotFound && !is_damaged(job.error(), *id)) {
      return job.error();
    }
    if (job && are_frames(spec, (*job)->record().view.spec)) {
      return job;
    }
  }
  return JobPointer();
}

}  // namespace

bool are_frames(const api::JobSpec& a, const api::JobSpec& b) {
  api::JobSpec frame = a;
  frame.camera = b.camera;
  frame.orbit = b.orbit;
  frame.time_seconds = b.time_seconds;
  frame.motion_seconds = b.motion_seconds;
  frame.render.seed = b.render.seed;
  frame.stop = b.stop;
  frame.name = b.name;
  frame.labels = b.labels;
  frame.priority = b.priority;
  frame.job_class = b.job_class;
  frame.preview_key = b.preview_key;
  frame.webhook = b.webhook;
  frame.retention_seconds = b.retention_seconds;
  // Chosen for each job alone where they are left open.
  core::adopt_settled(frame.render, b.render);
  // What does not move has no other time.
  return a.time_seconds.has_value() == b.time_seconds.has_value() && api::same_spec(frame, b);
}

core::Result<FramesAround> frames_around(JobService& jobs, BatchTable& batches, const Job& job) {
  const auto ids = batches.ids_beside(job.sequence());
  if (!ids) {
    return ids.error();
  }
  const auto own = std::find(ids->begin(), ids->end(), job.id());
  if (own == ids->end()) {
    return FramesAround();
  }
  const api::JobSpec spec = job.record().view.spec;
  auto before = first_frame(jobs, spec, std::make_reverse_iterator(own), ids->rend());
  auto after = first_frame(jobs, spec, own + 1, ids->end());
  if (!before || !after) {
    return before ? after.error() : before.error();
  }
  return FramesAround{*std::move(before), *std::move(after)};
}

}  // namespace server
