/// Scheduler: one pool of render threads that runs slices of all active jobs.
///
/// Order in which jobs get a free thread: preview class first, then higher priority, then the
/// tenant that has received the least CPU time. Of a tenant's jobs, those whose first pass is not
/// complete come first, the oldest ahead, so that each soon has an image; then the one that has
/// received the least for its weight (a new job starts at the minimum). The oldest job weighs so
/// much that the younger ones together get a sixteenth of the time: jobs end one after the other,
/// and none waits for ever. Jobs whose clock runs while they wait weigh as much as the oldest;
/// previews all weigh the same. The threads run at a lower OS priority than those that answer HTTP.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace server {

/// Work divided into slices of some milliseconds, for any number of threads.
class SliceSource {
 public:
  virtual ~SliceSource() = default;
  /// Runs one slice. Returns false when there is none now; running slices may create more.
  virtual bool run_slice() = 0;

  /// Its place among the sources of its tenant and rank.
  struct Turn {
    std::int64_t age = 0;   ///< Less is older.
    bool has_image = true;  ///< Its first pass is complete.
    bool is_timed = false;  ///< Its time runs out whether it is served or not.
  };
  /// Called with the scheduler's lock held; must not wait.
  virtual Turn turn() const { return {}; }
};

struct Rank {
  bool is_preview = false;
  int priority = 0;
  friend bool operator==(const Rank&, const Rank&) = default;
};

/// Lowers the OS priority of the calling thread below that of the threads that answer HTTP.
void yield_to_requests();

class Scheduler {
 public:
  explicit Scheduler(int threads);
  /// Waits for running slices.
  ~Scheduler();
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

  /// Adds the source, or changes its rank. tenant: to which its time is charged.
  void add(std::shared_ptr<SliceSource> source, Rank rank, const std::string& tenant = {});
  /// Call it also when Turn::is_timed has changed.
  void set_rank(const SliceSource& source, Rank rank);
  /// Called, without a lock, whenever a source is added; replaces the one before.
  void on_add(std::function<void()> listener);
  /// Starts no more slices of the source; running ones continue. Ignores unknown sources.
  void remove(const SliceSource& source);
  /// Returns the sources in scheduling order, for slices that are rendered elsewhere.
  std::vector<std::shared_ptr<SliceSource>> in_turn() const;
  /// Charges the source for CPU time used elsewhere. Ignores unknown sources.
  void charge(const SliceSource& source, double seconds);
  /// Starts no more slices and waits for running ones.
  void stop();

  int threads() const { return static_cast<int>(threads_.size()); }
  int active_count() const;
  /// Times summed over all threads so far.
  struct Times {
    double cpu_seconds = 0;        ///< CPU time of slices.
    double idle_seconds = 0;       ///< While there were jobs, none of which had a slice to give.
    double lock_wait_seconds = 0;  ///< After slices, for the scheduler's lock.
  };
  Times times() const;

 private:
  struct Entry {
    std::shared_ptr<SliceSource> source;
    Rank rank;
    std::string tenant;
    double weight = 1;
    double served_seconds = 0;  ///< Divided by the weight.
    std::uint64_t completions = 0;
    int running = 0;  ///< Threads inside run_slice().
    /// It had no slice when last asked and is not asked again before this time.
    std::chrono::steady_clock::time_point asleep_until;
  };

  /// CPU time that a tenant received while it had jobs.
  struct Share {
    double served_seconds = 0;
    int running = 0;
  };

  void work();
  std::shared_ptr<Entry> pick() REQUIRES(mutex_);
  bool goes_before(const Entry& a, const Entry& b) const REQUIRES(mutex_);
  /// Returns the least time among the tenant's jobs of that rank.
  double level(Rank rank, const std::string& tenant) const REQUIRES(mutex_);
  /// Called when the sources or their ranks have changed.
  void weigh() REQUIRES(mutex_);
  void join_share(const std::string& tenant) REQUIRES(mutex_);
  /// Called when a tenant has no jobs left.
  void leave_share(const std::string& tenant) REQUIRES(mutex_);

  mutable core::Mutex mutex_;
  core::CondVar changed_;
  std::vector<std::shared_ptr<Entry>> entries_ GUARDED_BY(mutex_);
  std::map<std::string, Share> shares_ GUARDED_BY(mutex_);  ///< Shares by tenant.
  std::function<void()> on_add_ GUARDED_BY(mutex_);
  bool stopping_ GUARDED_BY(mutex_) = false;
  Times times_ GUARDED_BY(mutex_);
  std::vector<std::jthread> threads_;
};

}  // namespace server
