/// Scheduler: one pool of render threads that takes slices from all active jobs.
///
/// Which job gets the next free thread: preview class first, then the higher priority, then the one
/// that was served least CPU time (a newcomer starts level with the least served of its rank). The
/// threads run at a lower priority than those that answer HTTP.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
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

  /// Adds the source, or gives it a new rank.
  void add(const std::string& name, std::shared_ptr<SliceSource> source, Rank rank);
  void set_rank(const std::string& name, Rank rank);
  /// Slices that are running go on; no new ones are started. Unknown names are no error.
  void remove(const std::string& name);
  /// There may be slices again where there were none.
  void wake();
  /// Hands out nothing more and waits for what is running.
  void stop();

  int threads() const { return static_cast<int>(threads_.size()); }
  int active_count() const;
  /// CPU seconds of all slices so far.
  double cpu_seconds() const;

 private:
  struct Entry {
    std::string name;
    std::shared_ptr<SliceSource> source;
    Rank rank;
    double served_seconds = 0;
    std::uint64_t completions = 0;
    int running = 0;          ///< Threads inside run_slice().
    bool is_starved = false;  ///< Had no slice when last asked.
  };

  void work();
  std::shared_ptr<Entry> pick() REQUIRES(mutex_);
  double level(Rank rank) const REQUIRES(mutex_);

  mutable core::Mutex mutex_;
  core::CondVar changed_;
  std::vector<std::shared_ptr<Entry>> entries_ GUARDED_BY(mutex_);
  bool stopping_ GUARDED_BY(mutex_) = false;
  double cpu_seconds_ GUARDED_BY(mutex_) = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace server
