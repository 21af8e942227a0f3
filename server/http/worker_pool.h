/// Threads for connections: created when needed, up to a limit, and ended after some idle time.
///
/// Stacks are 8 MiB (virtual), regardless of the process limit.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include <pthread.h>

#include "core/base/mutex.h"

namespace server {

class WorkerPool {
 public:
  using Task = std::function<void()>;

  /// max_threads: at least 1.
  explicit WorkerPool(int max_threads) : max_threads_(max_threads) {}
  /// Waits for all tasks, including queued ones.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Returns false if no thread is available and none can be created; the task is then dropped.
  bool submit(Task task) EXCLUDES(mutex_);
  int thread_count() const EXCLUDES(mutex_);

 private:
  static void* thread_main(void* pool);
  void work() EXCLUDES(mutex_);
  bool start_thread() REQUIRES(mutex_);
  void join_ended(std::vector<pthread_t> ended);

  const int max_threads_;
  mutable core::Mutex mutex_;
  core::CondVar has_work_;
  core::CondVar has_ended_;
  std::deque<Task> tasks_ GUARDED_BY(mutex_);
  std::vector<pthread_t> ended_
      GUARDED_BY(mutex_);  ///< Threads that have ended and must be joined.
  int thread_count_ GUARDED_BY(mutex_) = 0;
  int idle_count_ GUARDED_BY(mutex_) = 0;
  bool is_closing_ GUARDED_BY(mutex_) = false;
};

}  // namespace server
