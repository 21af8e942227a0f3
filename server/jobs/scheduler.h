/// Scheduler: one pool of render threads that takes slices from all active jobs.
///
/// Which job gets the next free thread: preview class first, then the higher priority, then one of
/// the tenant that was served least CPU time, and of its jobs the one that was served least
/// (newcomers start level with the least served). The threads run at a lower priority than those
/// that answer HTTP.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace server {

/// Work that can be handed out in slices of some milliseconds, to any number of threads.
class SliceSource {
 public:
  virtual ~SliceSource() = default;
  /// Does one slice. False: there is none now; one of those running may bring more.
  virtual bool run_slice() = 0;
};

struct Rank {
  bool is_preview = false;
  int priority = 0;
  friend bool operator==(const Rank&, const Rank&) = default;
};

class Scheduler {
 public:
  explicit Scheduler(int threads);
  /// Waits for the slices that are running.
  ~Scheduler();
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

  /// Adds the source, or gives it a new rank. tenant: whom its time is counted for.
  void add(std::shared_ptr<SliceSource> source, Rank rank, const std::string& tenant = {});
  void set_rank(const SliceSource& source, Rank rank);
  /// Slices that are running go on; no new ones are started. Unknown sources are no error.
  void remove(const SliceSource& source);
  /// Whose turn it is, the first one first; for slices that are rendered elsewhere.
  std::vector<std::shared_ptr<SliceSource>> in_turn() const;
  /// The source was served so much elsewhere. Unknown sources are no error.
  void charge(const SliceSource& source, double seconds);
  /// There may be slices again where there were none.
  void wake();
  /// Hands out nothing more and waits for what is running.
  void stop();

  int threads() const { return static_cast<int>(threads_.size()); }
  int active_count() const;
  /// Of all threads so far.
  struct Times {
    double cpu_seconds = 0;        ///< Of slices.
    double idle_seconds = 0;       ///< While there were jobs, none of which had a slice to give.
    double lock_wait_seconds = 0;  ///< After slices, for the scheduler's lock.
  };
  Times times() const;

 private:
  struct Entry {
    std::shared_ptr<SliceSource> source;
    Rank rank;
    std::string tenant;
    double served_seconds = 0;
    std::uint64_t completions = 0;
    int running = 0;          ///< Threads inside run_slice().
    bool is_starved = false;  ///< Had no slice when last asked.
  };

  /// What the jobs of a tenant were given while it had any.
  struct Share {
    double served_seconds = 0;
    int running = 0;
  };

  void work();
  std::shared_ptr<Entry> pick() REQUIRES(mutex_);
  bool goes_before(const Entry& a, const Entry& b) const REQUIRES(mutex_);
  /// Of the tenant's jobs of that rank, the time of the least served.
  double level(Rank rank, const std::string& tenant) const REQUIRES(mutex_);
  void join_share(const std::string& tenant) REQUIRES(mutex_);
  /// Of a tenant that has no job left.
  void leave_share(const std::string& tenant) REQUIRES(mutex_);

  mutable core::Mutex mutex_;
  core::CondVar changed_;
  std::vector<std::shared_ptr<Entry>> entries_ GUARDED_BY(mutex_);
  std::map<std::string, Share> shares_ GUARDED_BY(mutex_);  ///< By tenant.
  bool stopping_ GUARDED_BY(mutex_) = false;
  Times times_ GUARDED_BY(mutex_);
  std::vector<std::jthread> threads_;
};

}  // namespace server
