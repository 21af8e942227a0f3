/// Checkpoints: saves the films of jobs that are rendering, so that little is lost by a crash.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "server/jobs/job_book.h"
#include "server/jobs/journal.h"
#include "server/jobs/render_run.h"
#include "server/store/storage_quota.h"

namespace server {

class Checkpoints {
 public:
  /// All members must outlive it.
  struct Parts {
    StorageQuota& quota;
    Log& log;
    Metrics& metrics;
    JobBook& book;
    Journal& journal;
  };
  /// seconds: from the end of one checkpoint to the end of the next. on_full_disk: called for a job
  /// that could not be saved for lack of disk space.
  Checkpoints(Parts parts, double seconds, std::function<void(const JobPointer&)> on_full_disk)
      : parts_(parts), seconds_(seconds), on_full_disk_(std::move(on_full_disk)) {}

  /// The longest time between two calls of save_due() after which a film is still saved in time.
  std::chrono::milliseconds pause() const;
  /// Saves the films that are due. Call it from one thread.
  void save_due(const std::stop_token& stop);
  /// Saves the film of an unfinished job and records it. The record is never ahead of the file.
  /// Errors: kCancelled when the job has ended or has no film file; those of save(), after which
  /// the job fails, or waits for space unless it is paused.
  core::Status save_now(const JobPointer& job);
  /// Saves the film without using the disk reserve, which is kept for records. Errors: kNoSpace,
  /// kInternal.
  core::Status save(RenderRun& run, const Job& job, bool is_final) const;

 private:
  const Parts parts_;
  const double seconds_;
  const std::function<void(const JobPointer&)> on_full_disk_;
  std::map<std::string, std::chrono::steady_clock::time_point> saved_at_;  ///< by save_due()
  std::chrono::steady_clock::time_point next_check_;                       ///< of save_due()
};

}  // namespace server
