/// Background: a few threads for slow work such as loading and saving, shared by tenants: who has
/// the least work running comes first, then the oldest work.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace server {

class Background {
 public:
  using Work = std::function<void()>;

  enum class Priority {
    kNormal,
    kOfRendering  ///< the lower OS priority of render threads
  };
  /// each: the most threads that one tenant may occupy.
  Background(int threads, int each, Priority priority);
  /// Drops queued work and waits for running work.
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Queues work. Ignored after stop().
  void post(Work work, const std::string& tenant = {});
  enum class Waiting { kDrop, kFinish };
  void stop(Waiting waiting);

 private:
  struct Item {
    Work work;
    std::string tenant;
  };
  void work(Priority priority);
  /// Returns the next item that may start; the end if there is none.
  std::deque<Item>::iterator next() REQUIRES(mutex_);

  const int each_;
  core::Mutex mutex_;
  core::CondVar changed_;
  std::deque<Item> queue_ GUARDED_BY(mutex_);
  std::map<std::string, int> running_ GUARDED_BY(mutex_);  ///< By tenant.
  bool stopping_ GUARDED_BY(mutex_) = false;
  std::vector<std::jthread> threads_;
};

}  // namespace server
