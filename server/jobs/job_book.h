/// JobBook: which jobs are known, which wait, which have a place among the running ones, and what they hold in memory.
///
/// Order of the queue: preview class first, then the higher priority, then the older; nobody is passed over
/// because it is large. A job holds its memory from its start to its end, pauses included, until it is parked.
/// A job that is final stays for a while, for whoever asks next; the oldest go first. Knows nothing of
/// stores or threads.
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
  int previews_max = 32;      ///< Preview jobs waiting, running or paused.
  int previews_of_owner_max = 16;  ///< Of one stored key; 0: any number.
  int final_jobs_max = 512;   ///< Final jobs remembered that the store has, too.
  int final_previews_max = 64;
  /// What jobs may hold in memory together; 0: any number. A sixteenth of it is for previews alone.
  std::uint64_t memory_max_bytes = 0;

  /// The most that one job of this rank can get.
  std::uint64_t memory_bytes_of(Rank rank) const {
    return rank.is_preview ? memory_max_bytes : memory_max_bytes - memory_max_bytes / 16;
  }
};

/// What a job needs in memory.
struct JobMemory {
  std::uint64_t film_bytes = 0;
  /// Scenes and environments by what names them: jobs that need the same one hold it together.
  std::map<std::string, std::uint64_t> shared_bytes;
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

  /// False when the queue is full and the job could not start at once.
  bool has_room(Rank rank, const JobMemory& memory = {}, const std::string& owner = {}) const;
  /// Why one of this rank has no room, and what to do.
  std::string full_text(Rank rank) const;
  void enqueue(const JobPointer& job, Rank rank, JobMemory memory = {});
  void dequeue(const std::string& id);
  /// Waiting or running: its new rank.
  void set_rank(const std::string& id, Rank rank);
  /// 0 is next; empty when it does not wait.
  std::optional<int> position(const std::string& id) const;
  int queue_length() const;

  /// Takes the next job out of the queue and gives it a place and its memory; null when none may start now. A
  /// place beyond running_max is given to previews, and to those that outrank one that runs. Memory beyond
  /// the limit is given to one that would be alone.
  JobPointer admit();
  /// Paused jobs, the longest first, without which the next job of the queue would have its memory; empty when it waits for
  /// something else, or would still not. They are named once until they go on, leave, or keep().
  std::vector<std::string> take_parkable();
  /// A job that was to be parked could not be; it may be asked again.
  void keep(const std::string& id);
  /// The job is paused: others may have its place. What it holds in memory, it keeps.
  void pause(const std::string& id);
  /// A place for a job that goes on after a pause, beyond the limit if need be: its memory is held.
  void claim(const std::string& id, Rank rank);
  /// The job needs no place and no memory any more. It may have none.
  void leave(const std::string& id);
  /// Held by all jobs together, by what was said of them.
  std::uint64_t memory_bytes() const;
  bool waits_for_memory() const;
  /// The job is final: it is the next to be remembered, and the oldest beyond the limit is forgotten.
  void retire(const JobPointer& job);

 private:
  struct Waiting {
    JobPointer job;
    Rank rank;
    JobMemory memory;
  };
  struct Holder {
    Rank rank;
    JobMemory memory;
    std::string owner;
    bool can_park = false;        ///< It has a film file.
    std::uint64_t paused_at = 0;  ///< In the order of pauses; 0: it runs.
    bool is_parking = false;
  };
  void remember_final(const JobPointer& job) REQUIRES(mutex_);
  static bool goes_before(const Waiting& a, const Waiting& b);
  bool may_start(Rank rank) const REQUIRES(mutex_);
  bool fits(const std::string& id, Rank rank, const JobMemory& memory, const std::set<std::string>& parked) const
      REQUIRES(mutex_);
  bool fits(const Waiting& next, const std::set<std::string>& parked = {}) const REQUIRES(mutex_) {
    return fits(next.job->id(), next.rank, next.memory, parked);
  }
  bool has_its_previews(const std::string& owner) const REQUIRES(mutex_);
  bool lacks_only_memory() const REQUIRES(mutex_);

  const BookLimits limits_;
  mutable core::Mutex mutex_;
  std::map<std::string, JobPointer> jobs_ GUARDED_BY(mutex_);
  std::vector<Waiting> queue_ GUARDED_BY(mutex_);  ///< Next first.
  std::map<std::string, Rank> running_ GUARDED_BY(mutex_);
  std::map<std::string, Holder> holders_ GUARDED_BY(mutex_);
  std::uint64_t pauses_ GUARDED_BY(mutex_) = 0;
  std::deque<std::string> final_ GUARDED_BY(mutex_);  ///< Oldest first.
  std::deque<std::string> final_previews_ GUARDED_BY(mutex_);
};

}  // namespace server
