/// JobBook: which jobs are known, which wait, which have a place among the running ones, and what
/// they hold in memory.
///
/// Order of the queue: preview class first, then the higher priority, then tenants in turn (one
/// with fewer jobs that run or stand before comes first), then the older; no job is passed over
/// because it is large. A job holds its memory from its start to its end, pauses
/// included, until it is parked. A job that is final stays for a while, for later requests; the
/// oldest go first. Knows nothing of stores or threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/jobs/job.h"
#include "server/observe/memory_gate.h"

namespace server {

struct BookLimits {
  int queue_max = 1000;
  int running_max = 16;
  int previews_max = 32;            ///< Preview jobs waiting, running or paused.
  int previews_of_tenant_max = 16;  ///< 0: any number; the operator's are not counted.
  int final_jobs_max = 512;         ///< Final jobs remembered that the store has, too.
  int final_previews_max = 64;
};

/// What a job needs in memory.
struct JobMemory {
  std::uint64_t film_bytes = 0;
  std::uint64_t work_bytes = 0;  ///< Beside the film while it renders.
  std::uint64_t load_bytes = 0;  ///< Beside the scene while that is loaded, before there is a film.
  /// Scenes and environments by what names them: jobs that need the same one hold it together.
  std::map<std::string, std::uint64_t> shared_bytes = {};

  std::uint64_t own_bytes() const { return std::max(film_bytes + work_bytes, load_bytes); }
  /// At most, if the job is alone.
  std::uint64_t bytes() const;
};

class JobBook {
 public:
  /// memory: what jobs take is taken there; outlives this. on_leave: called, without a lock, after
  /// a job gave back its place and its memory.
  JobBook(BookLimits limits, MemoryGate& memory, std::function<void()> on_leave = {});

  /// A place among the running jobs, and the memory that goes with it. The loader or the renderer
  /// of the job holds it; both are given back with it, however the work ends. Must not outlive the
  /// book.
  class Place {
   public:
    Place(JobBook& book, std::uint64_t number, JobPointer job)
        : book_(book), number_(number), job_(std::move(job)) {}
    ~Place() { book_.leave(number_); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    const JobPointer& job() const { return job_; }

   private:
    JobBook& book_;
    const std::uint64_t number_;
    const JobPointer job_;
  };

  void add(const JobPointer& job);
  /// A final job that the store had; if another thread was faster, its job is returned.
  JobPointer add_final(const JobPointer& job);
  /// Deleted: not found any more. Its place is given back when its work ends.
  void forget(const Job& job);
  JobPointer find(const std::string& id) const;
  std::vector<JobPointer> all() const;

  /// False when the queue is full and the job could not start at once.
  bool has_room(Rank rank, const JobMemory& memory = {}, const std::string& tenant = {}) const;
  /// Could so many more jobs of class normal wait?
  bool has_room_for(int jobs) const;
  /// Why one of this rank has no room, and what to do.
  std::string full_text(Rank rank) const;
  void enqueue(const JobPointer& job, Rank rank, JobMemory memory = {});
  struct Entry {
    JobPointer job;
    Rank rank;
    JobMemory memory;
  };
  void enqueue(std::vector<Entry> entries);
  void dequeue(const Job& job);
  /// Waiting or running: its new rank.
  void set_rank(const Job& job, Rank rank);
  /// 0 is next; empty when it does not wait.
  std::optional<int> position(const Job& job) const;
  int queue_length() const;
  /// Jobs that load, render or end; not the paused ones.
  int running_count() const;

  /// Takes the next job out of the queue and gives it a place and its memory; null when none may
  /// start now. A place beyond running_max is given to previews, to those that outrank one that
  /// runs, and to the first of a tenant, up to twice running_max. One that would never have its
  /// memory gets its place without it, and is refused when it is loaded.
  std::shared_ptr<Place> admit();
  /// The scene of the job is loaded: others may have what that took. shared_bytes: what the job
  /// holds from now on together with others.
  void end_load(const Job& job, std::map<std::string, std::uint64_t> shared_bytes);
  /// The most that one job of this rank can get; 0: any number. An eighth of the memory is for
  /// requests alone, half of which previews may have, too.
  std::uint64_t memory_bytes_of(Rank rank) const;
  /// Paused jobs, the longest first, without which the next job of the queue would have its memory;
  /// empty when it waits for something else, or would still not. They are named once until they go
  /// on, leave, or keep().
  std::vector<JobPointer> take_parkable();
  /// A job that was to be parked could not be; it may be asked again.
  void keep(const Job& job);
  /// The job is paused: others may have its place. What it holds in memory, it keeps.
  void pause(const Job& job);
  /// A job goes on after a pause, beyond the limit if need be: its memory is held.
  void claim(const Job& job, Rank rank);
  /// Held by all jobs together, by what was said of them.
  std::uint64_t memory_bytes() const;
  bool waits_for_memory() const;
  /// Jobs with a place or memory: loading, rendering, paused in memory, or ending.
  std::vector<JobPointer> holders() const;
  /// The job is final: it is the next to be remembered, and the oldest beyond the limit is
  /// forgotten.
  void retire(const JobPointer& job);
  /// The oldest final preview goes, and its film with it. False: there is none.
  bool forget_oldest_preview();

 private:
  struct Waiting {
    JobPointer job;
    Rank rank;
    JobMemory memory;
    int turn = 0;  ///< Jobs of its tenant and rank that run or stand before it.
  };
  struct Holder {
    JobPointer job;
    Rank rank;
    JobMemory memory;
    std::uint64_t paused_at = 0;  ///< In the order of pauses; 0: it runs.
    bool is_parking = false;
  };
  void leave(std::uint64_t number);
  void remember_final(const JobPointer& job) REQUIRES(mutex_);
  static bool goes_before(const Waiting& a, const Waiting& b);
  /// Puts the queue in order again, after a job came, went or got another rank.
  void arrange() REQUIRES(mutex_);
  bool may_start(Rank rank, const std::string& tenant) const REQUIRES(mutex_);
  bool may_start(const Waiting& next) const REQUIRES(mutex_) {
    return may_start(next.rank, next.job->tenant());
  }
  /// Of all holders; parked: numbers of those that count for nothing.
  MemoryUse use_of_holders(const std::set<std::uint64_t>& parked = {}) const REQUIRES(mutex_);
  /// Of all holders, after one of them has changed.
  void note_memory() REQUIRES(mutex_) { MemoryGate::change(held_, use_of_holders()); }
  bool is_too_large(Rank rank, const JobMemory& memory) const;
  bool fits(Rank rank, const JobMemory& memory, const std::set<std::uint64_t>& parked = {}) const
      REQUIRES(mutex_);
  bool has_its_previews(const std::string& tenant) const REQUIRES(mutex_);
  bool lacks_only_memory() const REQUIRES(mutex_);

  const BookLimits limits_;
  MemoryGate& memory_;
  const std::function<void()> on_leave_;
  mutable core::Mutex mutex_;
  MemoryGate::Lease held_ GUARDED_BY(mutex_);  ///< By all holders together.
  std::map<std::string, JobPointer> jobs_ GUARDED_BY(mutex_);
  std::vector<Waiting> queue_ GUARDED_BY(mutex_);  ///< Next first.
  std::uint64_t places_given_ GUARDED_BY(mutex_) = 0;
  /// By the number of the place. A job that was paused while loading may have two for a moment.
  std::map<std::uint64_t, Holder> holders_ GUARDED_BY(mutex_);
  std::uint64_t pauses_ GUARDED_BY(mutex_) = 0;
  std::deque<std::string> final_ GUARDED_BY(mutex_);  ///< Oldest first.
  std::deque<std::string> final_previews_ GUARDED_BY(mutex_);
};

}  // namespace server
