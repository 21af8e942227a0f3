/// JobBook: known jobs, the queue, the running jobs, and the memory that they hold.
///
/// Order of the queue: preview class first, then higher priority, then tenants in turn (the tenant
/// with fewer running or earlier jobs first), then jobs without an image, then age; a job is never
/// passed over for its size. A job holds its memory from start to end, including pauses, until it
/// is parked. Running jobs of a tenant, rank and scene are the first in that order: a later one
/// gives its slot to an earlier one that waits, once it has an image. Final jobs are kept for a
/// while for later requests; the oldest are dropped first. Independent of stores and threads.
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
  int running_max = 64;
  int previews_max = 32;            ///< Preview jobs queued, running or paused.
  int previews_of_tenant_max = 16;  ///< 0: any number; the operator's previews are not counted.
  int final_jobs_max = 512;         ///< Final jobs kept in memory although the store has them.
  int final_previews_max = 64;
};

/// Memory required by a job.
struct JobMemory {
  std::uint64_t film_bytes = 0;
  std::uint64_t work_bytes = 0;  ///< Besides the film, while it renders.
  ///< Besides the scene, while it is loaded and there is no film yet.
  std::uint64_t load_bytes = 0;
  /// Scenes and environments by name: jobs that use the same one share it.
  std::map<std::string, std::uint64_t> shared_bytes = {};

  std::uint64_t own_bytes() const { return std::max(film_bytes + work_bytes, load_bytes); }
  /// Upper bound if the job is alone.
  std::uint64_t bytes() const;
};

/// What a job needs to start, computed once when it is queued.
struct Admission {
  Rank rank = {};
  JobMemory memory = {};
  std::uint64_t film_file_bytes = 0;  ///< The largest size of its film file.
};

class JobBook {
 public:
  /// memory: the gate that accounts for the jobs' memory; must outlive this. on_leave: called
  /// without a lock after a job released its slot and memory.
  JobBook(BookLimits limits, MemoryGate& memory, std::function<void()> on_leave = {});

  /// A slot among the running jobs, with the memory that goes with it. Held by the loader or the
  /// renderer of the job; released when the work ends in any way. Must not outlive the book.
  class Slot {
   public:
    /// needed: by the job, even if it is more than it can ever have.
    Slot(JobBook& book, std::uint64_t number, JobPointer job, JobMemory needed)
        : book_(book), number_(number), job_(std::move(job)), needed_(std::move(needed)) {}
    ~Slot() { book_.leave(number_); }
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    const JobPointer& job() const { return job_; }
    const JobMemory& needed() const { return needed_; }

   private:
    JobBook& book_;
    const std::uint64_t number_;
    const JobPointer job_;
    const JobMemory needed_;
  };

  void add(const JobPointer& job);
  /// Adds a final job read from the store; returns the existing one if another thread added it
  /// first.
  JobPointer add_final(const JobPointer& job);
  /// Forgets a deleted job. Its slot is released when its work ends.
  void forget(const Job& job);
  JobPointer find(const std::string& id) const;
  std::vector<JobPointer> all() const;
  /// Returns the jobs with a slot: all that have a run, and those that are being loaded.
  std::vector<JobPointer> with_slots() const;

  /// Returns false when the queue is full and the job could not start at once.
  bool has_room(const Admission& admission, const std::string& tenant = {}) const;
  /// Returns whether `jobs` more jobs of class normal fit into the queue.
  bool has_room_for(int jobs) const;
  /// Explains why a job of this rank has no room, and what to do.
  std::string full_text(Rank rank) const;
  void enqueue(const JobPointer& job, Admission admission) {
    enqueue({Entry{.job = job, .admission = std::move(admission)}});
  }
  struct Entry {
    JobPointer job;
    Admission admission;
  };
  void enqueue(std::vector<Entry> entries);
  void dequeue(const Job& job);
  /// Changes the rank of a queued or running job.
  void set_rank(const Job& job, Rank rank);
  /// Returns the position in the queue, 0 for the next; empty when it is not queued.
  std::optional<int> position(const Job& job) const;
  int queue_length() const;
  /// Number of jobs that load, render or end, excluding paused ones.
  int running_count() const;

  /// Takes the next job out of the queue and gives it a slot and its memory; null when none may
  /// start now. Slots beyond running_max, up to twice as many, are given to previews, to jobs that
  /// outrank a running one, and to the first job of a tenant. A job that can never have its memory
  /// gets its slot without it, and is refused when it is loaded.
  std::shared_ptr<Slot> admit();
  /// Releases the memory for loading once the job's scene is loaded. shared_bytes: shared memory
  /// that the job holds from now on.
  void end_load(const Job& job, std::map<std::string, std::uint64_t> shared_bytes);
  /// Returns the most that one job of this rank can get; 0: no limit. An eighth of the memory is
  /// reserved for requests, half of which previews and the first job of a tenant may use too.
  std::uint64_t memory_bytes_of(Rank rank) const;
  /// Returns paused jobs, longest first, whose parking would free the memory that the next job of
  /// the queue needs; empty when it waits for something else, or would still not fit. Each job is
  /// returned only once until it resumes, leaves, or keep().
  std::vector<JobPointer> take_parkable();
  /// Returns a running job that should be parked for the next job of the queue, which comes before
  /// it and can start then (last_that_may_yield). Null while another one is being parked. turn_of:
  /// of a running job; called with the lock.
  JobPointer take_yielding(const std::function<SliceSource::Turn(const Job&)>& turn_of);
  /// Makes a job that could not be parked available again.
  void keep(const Job& job);
  /// Releases the slot of a paused job, which keeps its memory.
  void pause(const Job& job);
  /// Gives a resumed job a slot, beyond the limit if necessary, since its memory is held.
  void claim(const Job& job, Rank rank);
  /// Returns the memory held by all jobs together, as declared.
  std::uint64_t memory_bytes() const;
  bool waits_for_memory() const;
  /// Returns jobs with a slot or memory: loading, rendering, paused in memory, or ending.
  std::vector<JobPointer> holders() const;
  /// Adds a final job as the newest to be kept; drops the oldest beyond the limit.
  void retire(const JobPointer& job);
  /// Drops the oldest final preview and its film. Returns false when there is none.
  bool forget_oldest_preview();

 private:
  struct Waiting {
    JobPointer job;
    Rank rank;
    JobMemory memory;
    bool has_image = false;
    int turn = 0;  ///< Jobs of its tenant and rank that run or are queued before it.
  };
  struct Holder {
    JobPointer job;
    Rank rank;
    JobMemory memory;
    std::uint64_t paused_at = 0;  ///< In the order of pauses; 0: not paused.
    bool is_parking = false;
  };
  /// As admit(), without dropping idle memory. fit: of the next job's memory.
  std::shared_ptr<Slot> try_admit(MemoryGate::Fit& fit);
  void leave(std::uint64_t number);
  void remember_final(const JobPointer& job) REQUIRES(mutex_);
  static bool goes_before(const Waiting& a, const Waiting& b);
  /// Sorts the queue after a job was added, removed or got another rank.
  void arrange() REQUIRES(mutex_);
  /// parked: as of use_of_holders().
  bool may_start(Rank rank, const std::string& tenant,
                 const std::set<std::uint64_t>& parked = {}) const REQUIRES(mutex_);
  bool may_start(const Waiting& next, const std::set<std::uint64_t>& parked = {}) const
      REQUIRES(mutex_) {
    return may_start(next.rank, next.job->tenant(), parked);
  }
  /// Memory of all holders, except those whose numbers are in `parked`.
  MemoryUse use_of_holders(const std::set<std::uint64_t>& parked = {}) const REQUIRES(mutex_);
  /// Updates the lease after a holder has changed.
  void note_memory() REQUIRES(mutex_) { MemoryGate::change(held_, use_of_holders()); }
  bool is_too_large(Rank rank, const JobMemory& memory) const;
  /// Returns the limit for all memory with this job. The first job of a tenant may use what
  /// previews may, and a small one as much as small requests.
  std::uint64_t most_with(Rank rank, const std::string& tenant, const JobMemory& memory) const
      REQUIRES(mutex_);
  bool fits(Rank rank, const std::string& tenant, const JobMemory& memory,
            const std::set<std::uint64_t>& parked = {}) const REQUIRES(mutex_);
  bool fits(const Waiting& next, const std::set<std::uint64_t>& parked = {}) const
      REQUIRES(mutex_) {
    return fits(next.rank, next.job->tenant(), next.memory, parked);
  }
  bool has_its_previews(const std::string& tenant) const REQUIRES(mutex_);
  /// Returns the youngest running job with an image, of the same rank, whose time does not run out:
  /// of the same tenant and scene, once all of these have images; for the first job of a tenant, of
  /// tenants that have several. Empty while any job is being parked.
  std::optional<std::uint64_t> last_that_may_yield(
      const Waiting& next, const std::function<SliceSource::Turn(const Job&)>& turn_of) const
      REQUIRES(mutex_);
  bool lacks_only_memory() const REQUIRES(mutex_);

  const BookLimits limits_;
  MemoryGate& memory_;
  const std::function<void()> on_leave_;
  mutable core::Mutex mutex_;
  MemoryGate::Lease held_ GUARDED_BY(mutex_);  ///< Memory held by all holders together.
  std::map<std::string, JobPointer> jobs_ GUARDED_BY(mutex_);
  std::vector<Waiting> queue_ GUARDED_BY(mutex_);  ///< Next first.
  std::uint64_t slots_given_ GUARDED_BY(mutex_) = 0;
  /// Holders by slot number. A job that was paused while loading may briefly have two.
  std::map<std::uint64_t, Holder> holders_ GUARDED_BY(mutex_);
  std::uint64_t pauses_ GUARDED_BY(mutex_) = 0;
  std::deque<std::string> final_ GUARDED_BY(mutex_);  ///< Oldest first.
  std::deque<std::string> final_previews_ GUARDED_BY(mutex_);
};

}  // namespace server
