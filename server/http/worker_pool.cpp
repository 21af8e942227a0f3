#include "server/http/worker_pool.h"

#include <chrono>
#include <cstddef>
#include <utility>

#include "core/base/check.h"
#include "server/http/signal_block.h"

namespace server {
namespace {

constexpr std::size_t kStackBytes = 8U << 20U;
constexpr std::chrono::seconds kIdleTime(10);

}  // namespace

WorkerPool::~WorkerPool() {
  std::vector<pthread_t> ended;
  {
    core::MutexLock lock(mutex_);
    is_closing_ = true;
    has_work_.notify_all();
    while (thread_count_ > 0) {
      has_ended_.wait(mutex_);
    }
    ended.swap(ended_);
  }
  join_ended(std::move(ended));
}

bool WorkerPool::submit(Task task) {
  std::vector<pthread_t> ended;
  {
    core::MutexLock lock(mutex_);
    const bool has_idle = idle_count_ > static_cast<int>(tasks_.size());
    if (!has_idle && !start_thread()) {
      return false;
    }
    tasks_.push_back(std::move(task));
    has_work_.notify_one();
    ended.swap(ended_);
  }
  join_ended(std::move(ended));
  return true;
}

int WorkerPool::thread_count() const {
  core::MutexLock lock(mutex_);
  return thread_count_;
}

bool WorkerPool::start_thread() {
  if (thread_count_ >= max_threads_ || is_closing_) {
    return false;
  }
  pthread_attr_t attributes;
  CHECK(pthread_attr_init(&attributes) == 0);
  CHECK(pthread_attr_setstacksize(&attributes, kStackBytes) == 0);
  const SignalBlock block;
  pthread_t thread = {};
  const int failure = pthread_create(&thread, &attributes, &WorkerPool::thread_main, this);
  pthread_attr_destroy(&attributes);
  if (failure != 0) {
    return false;
  }
  ++thread_count_;
  return true;
}

void* WorkerPool::thread_main(void* pool) {
  static_cast<WorkerPool*>(pool)->work();
  return nullptr;
}

void WorkerPool::work() {
  while (true) {
    Task task;
    {
      core::MutexLock lock(mutex_);
      const auto retire_at = std::chrono::steady_clock::now() + kIdleTime;
      ++idle_count_;
      while (tasks_.empty() && !is_closing_ &&
             has_work_.wait_until(mutex_, retire_at) != std::cv_status::timeout) {
      }
      --idle_count_;
      if (tasks_.empty()) {
        --thread_count_;
        ended_.push_back(pthread_self());
        has_ended_.notify_all();
        return;
      }
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    task();
  }
}

void WorkerPool::join_ended(std::vector<pthread_t> ended) {
  for (const pthread_t thread : ended) {
    pthread_join(thread, nullptr);
  }
}

}  // namespace server
