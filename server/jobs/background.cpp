#include "server/jobs/background.h"

#include <optional>
#include <utility>

#include "server/jobs/scheduler.h"

namespace server {

Background::Background(int threads, int each, Priority priority) : each_(each) {
  for (int i = 0; i < threads; ++i) {
    threads_.emplace_back([this, priority] { work(priority); });
  }
}

Background::~Background() { stop(Waiting::kDrop); }

void Background::post(Work work, const std::string& tenant) {
  {
    const core::MutexLock lock(mutex_);
    if (stopping_) {
      return;
    }
    queue_.push_back({std::move(work), tenant});
  }
  changed_.notify_one();
}

void Background::stop(Waiting waiting) {
  std::deque<Item>
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

std::deque<Background::Item>::iterator Background::next() {
  auto best = queue_.end();
  int least = each_;
  for (auto item = queue_.begin(); item != queue_.end(); ++item) {
    const auto running = running_.find(item->tenant);
    const int count = running == running_.end() ? 0 : running->second;
    if (count < least) {
      best = item;
      least = count;
    }
  }
  return best;
}

void Background::work(Priority priority) {
  if (priority == Priority::kOfRendering) {
    yield_to_requests();
  }
  std::optional<std::string> done;  // The tenant whose work this thread has finished.
  for (;;) {
    Item item;
    {
      const core::MutexLock lock(mutex_);
      if (done && --running_[*done] == 0) {
        running_.erase(*done);
      }
      auto found = next();
      while (found == queue_.end() && !(queue_.empty() && stopping_)) {
        changed_.wait(mutex_);
        found = next();
      }
      if (found == queue_.end()) {
        return;
      }
      item = std::move(*found);
      queue_.erase(found);
      ++running_[item.tenant];
    }
    done = item.tenant;
    item.work();
    item.work = nullptr;
    changed_.notify_all();
  }
}

}  // namespace server
