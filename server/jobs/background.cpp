#include "server/jobs/background.h"

#include <utility>

namespace server {

Background::Background(int threads) {
  for (int i = 0; i < threads; ++i) {
    threads_.emplace_back([this] { work(); });
  }
}

Background::~Background() { stop(Waiting::kDrop); }

void Background::post(Work work) {
  {
    const core::MutexLock lock(mutex_);
    if (stopping_) {
      return;
    }
    queue_.push_back(std::move(work));
  }
  changed_.notify_one();
}

void Background::stop(Waiting waiting) {
  std::deque<Work>
      dropped;  // Destroyed after the lock is released, since destructors of work may do anything.
  {
    const core::MutexLock lock(mutex_);
    stopping_ = true;
    if (waiting == Waiting::kDrop) {
      dropped.swap(queue_);
    }
  }
  changed_.notify_all();
  for (std::jthread& thread : threads_) {
    if (thread.joinable()) {
      thread.join();
    }
  }
}

void Background::work() {
  for (;;) {
    Work next;
    {
      const core::MutexLock lock(mutex_);
      while (queue_.empty() && !stopping_) {
        changed_.wait(mutex_);
      }
      if (queue_.empty()) {
        return;
      }
      next = std::move(queue_.front());
      queue_.pop_front();
    }
    next();
  }
}

}  // namespace server
