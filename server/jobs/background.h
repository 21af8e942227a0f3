/// Background: a few threads for slow work such as loading and saving.
#pragma once

#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace server {

class Background {
 public:
  using Work = std::function<void()>;

  explicit Background(int threads);
  /// Drops queued work and waits for running work.
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Queues work in order. Ignored after stop().
  void post(Work work);
  enum class Waiting { kDrop, kFinish };
  void stop(Waiting waiting);

 private:
  void work();

  core::Mutex mutex_;
  core::CondVar changed_;
  std::deque<Work> queue_ GUARDED_BY(mutex_);
  bool stopping_ GUARDED_BY(mutex_) = false;
  std::vector<std::jthread> threads_;
};

}  // namespace server
