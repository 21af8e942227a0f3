/// JobBook: which jobs are in memory, which wait, which hold a place among the running ones.
///
/// Order of the queue: preview class first, then the higher priority, then the older. A job that is
/// final stays for a while, for whoever asks next; the oldest go first. Knows nothing of stores or
/// threads.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/jobs/job.h"

namespace server {

struct BookLimits {
  int queue_max = 1000;
  int running_max = 16;
  int previews_max = 32;      ///< Preview jobs waiting or running.
  int final_jobs_max = 512;   ///< Final jobs remembered that the store has, too.
  int final_previews_max = 64;
};

class JobBook {
 public:
  explicit JobBook(BookLimits limits) : limits_(limits) {}

  void add(const JobPointer& job);
  /// A final job that the store had; if somebody else was faster, theirs is returned.
  JobPointer add_final(const JobPointer& job);
  void forget(const std::string& id);
  JobPointer find(const std::string& id) const;
  std::vector<JobPointer> all() const;

  /// False when the queue is full.
  bool has_room(Rank rank) const;
  void enqueue(const JobPointer& job, Rank rank);
  void dequeue(const std::string& id);
  /// Waiting or running: its new rank.
  void set_rank(const std::string& id, Rank rank);
  /// 0 is next; empty when it does not wait.
  std::optional<int> position(const std::string& id) const;
  int queue_length() const;

  /// Takes the next job out of the queue and gives it a place; null when none may start now. A place
  /// beyond running_max is given to previews, and to those that outrank one that runs.
  JobPointer admit();
  /// A place for a job that goes on after a pause, beyond the limit if need be: its memory is held.
  void claim(const std::string& id, Rank rank);
  /// The job needs no place any more. It may have none.
  void leave(const std::string& id);
  /// The job is final: it is the next to be remembered, and the oldest beyond the limit is forgotten.
  void retire(const JobPointer& job);

 private:
  struct Waiting {
    JobPointer job;
    Rank rank;
  };
  void remember_final(const JobPointer& job) REQUIRES(mutex_);
  static bool goes_before(const Waiting& a, const Waiting& b);
  bool may_start(Rank rank) const REQUIRES(mutex_);

  const BookLimits limits_;
  mutable core::Mutex mutex_;
  std::map<std::string, JobPointer> jobs_ GUARDED_BY(mutex_);
  std::vector<Waiting> queue_ GUARDED_BY(mutex_);  ///< Next first.
  std::map<std::string, Rank> running_ GUARDED_BY(mutex_);
  std::deque<std::string> final_ GUARDED_BY(mutex_);  ///< Oldest first.
  std::deque<std::string> final_previews_ GUARDED_BY(mutex_);
};

}  // namespace server
