#include "server/jobs/checkpoints.h"

#include <algorithm>

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

/// The time between two checkpoints is at least this multiple of the time to write one.
constexpr double kWriteShare = 20;
/// Fraction of the interval after which writing begins, so that it completes within the interval.
constexpr double kBegin = 0.8;
/// Between two searches for jobs whose checkpoint is due.
constexpr std::chrono::milliseconds kPauseMost{1000};

}  // namespace

Status Checkpoints::save(RenderRun& run, const Job& job, bool is_final) const {
  if (!job.memory_only() && !parts_.quota.has_disk_room()) {
    return Error{ErrorCode::kNoSpace, "the disk is full", ""};
  }
  return run.save(is_final);
}

Status Checkpoints::save_now(const JobPointer& job) {
  const auto run = job->run();
  if (!run || job->memory_only() || run->task().finished()) {
    // The thread that ended the run saves its film.
    return Error{ErrorCode::kCancelled, "the job has ended", ""};
  }
  core::Progress progress = run->task().progress();
  if (const Status saved = save(*run, *job, false); !saved) {
    parts_.metrics.count(Counter::kCheckpointFailed);
    if (saved.error().code != ErrorCode::kNoSpace) {
      run->fail(saved.error());
    } else if (!job->waits_for_disk()) {
      on_full_disk_(job);
    }
    return saved;
  }
  progress.revision = run->task().progress().revision;  // Clients may have seen it.
  const auto modify = [&](JobRecord& record) -> Verdict {
    if (api::is_final(record.view.state)) {
      return Error{ErrorCode::kCancelled, "the job has ended", ""};
    }
    record.view.progress = progress;
    record.film = FilmPlace::kOnDisk;
    record.film_bytes = run->file_bytes();
    return {};
  };
  const Verdict noted =
      parts_.journal.change(*job, modify, {.unstored = Journal::Unstored::kInMemory});
  if (!noted) {  // It was cancelled, perhaps deleted, meanwhile.
    return Error{ErrorCode::kCancelled, "the job has ended", ""};
  }
  parts_.metrics.count(Counter::kCheckpointWritten);
  parts_.log.write(LogLevel::kDebug, "checkpoint",
                   {{"job", job->id()}, {"seconds", run->last_save_seconds()}});
  return core::ok_status();
}

std::chrono::milliseconds Checkpoints::pause() const {
  const std::chrono::duration<double> left(seconds_ * (1 - kBegin));
  return left < kPauseMost ? std::chrono::duration_cast<std::chrono::milliseconds>(left)
                           : kPauseMost;
}

void Checkpoints::save_due(const std::stop_token& stop) {
  if (Clock::now() < next_check_) {
    return;
  }
  next_check_ = Clock::now() + pause();
  std::map<std::string, Clock::time_point> saved_at;  // of the jobs that still run
  for (const JobPointer& job : parts_.book.with_slots()) {
    const auto run = job->run();
    if (stop.stop_requested() || !run || job->memory_only()) {
      continue;
    }
    const double interval = std::max(seconds_ * kBegin, run->last_save_seconds() * kWriteShare);
    const auto now = Clock::now();
    const auto known = saved_at_.find(job->id());
    auto last = known == saved_at_.end() ? now : known->second;
    if (known != saved_at_.end() && std::chrono::duration<double>(now - last).count() >= interval) {
      static_cast<void>(save_now(job));
      last = Clock::now();
    }
    saved_at.emplace(job->id(), last);
  }
  saved_at_ = std::move(saved_at);
}

}  // namespace server
