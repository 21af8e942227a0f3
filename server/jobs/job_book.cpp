#include "server/jobs/job_book.h"

#include <algorithm>
#include <utility>

namespace server {

bool JobBook::goes_before(const Waiting& a, const Waiting& b) {
  if (a.rank.is_preview != b.rank.is_preview) {
    return a.rank.is_preview;
  }
  if (a.rank.priority != b.rank.priority) {
    return a.rank.priority > b.rank.priority;
  }
  return a.job->sequence() < b.job->sequence();
}

void JobBook::add(const JobPointer& job) {
  const core::MutexLock lock(mutex_);
  jobs_[job->id()] = job;
}

void JobBook::forget(const std::string& id) {
  const core::MutexLock lock(mutex_);
  jobs_.erase(id);
  std::erase(final_, id);
  std::erase(final_previews_, id);
}

JobPointer JobBook::find(const std::string& id) const {
  const core::MutexLock lock(mutex_);
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second;
}

std::vector<JobPointer> JobBook::all() const {
  const core::MutexLock lock(mutex_);
  std::vector<JobPointer> jobs;
  for (const auto& entry : jobs_) {
    jobs.push_back(entry.second);
  }
  return jobs;
}

bool JobBook::has_room(Rank rank) const {
  const core::MutexLock lock(mutex_);
  const auto previews = [](const auto& item) { return item.rank.is_preview; };
  const auto waiting_previews = std::count_if(queue_.begin(), queue_.end(), previews);
  if (rank.is_preview) {
    const auto running_previews = std::count_if(
        running_.begin(), running_.end(), [](const auto& item) { return item.second.is_preview; });
    return waiting_previews + running_previews < limits_.previews_max;
  }
  // With a place free a job starts at once and needs no room in the queue.
  const auto waiting = static_cast<int>(queue_.size()) - static_cast<int>(waiting_previews);
  return waiting < limits_.queue_max || (waiting == 0 && may_start(rank));
}

void JobBook::enqueue(const JobPointer& job, Rank rank) {
  const core::MutexLock lock(mutex_);
  Waiting waiting{.job = job, .rank = rank};
  std::erase(final_, job->id());
  const auto place = std::upper_bound(queue_.begin(), queue_.end(), waiting, &goes_before);
  queue_.insert(place, std::move(waiting));
}

void JobBook::dequeue(const std::string& id) {
  const core::MutexLock lock(mutex_);
  std::erase_if(queue_, [&](const Waiting& waiting) { return waiting.job->id() == id; });
}

void JobBook::set_rank(const std::string& id, Rank rank) {
  const core::MutexLock lock(mutex_);
  if (const auto running = running_.find(id); running != running_.end()) {
    running->second = rank;
  }
  const auto found = std::find_if(queue_.begin(), queue_.end(),
                                  [&](const Waiting& waiting) { return waiting.job->id() == id; });
  if (found != queue_.end()) {
    found->rank = rank;
    std::stable_sort(queue_.begin(), queue_.end(), &goes_before);
  }
}

std::optional<int> JobBook::position(const std::string& id) const {
  const core::MutexLock lock(mutex_);
  const auto found = std::find_if(queue_.begin(), queue_.end(),
                                  [&](const Waiting& waiting) { return waiting.job->id() == id; });
  if (found == queue_.end()) {
    return std::nullopt;
  }
  return static_cast<int>(found - queue_.begin());
}

int JobBook::queue_length() const {
  const core::MutexLock lock(mutex_);
  return static_cast<int>(queue_.size());
}

bool JobBook::may_start(Rank rank) const {
  if (rank.is_preview) {
    return true;
  }
  int places = 0;
  bool outranks_one = false;
  for (const auto& entry : running_) {
    const Rank other = entry.second;
    places += other.is_preview ? 0 : 1;
    outranks_one = outranks_one || (!other.is_preview && rank.priority > other.priority);
  }
  return places < limits_.running_max || (outranks_one && places < 2 * limits_.running_max);
}

JobPointer JobBook::admit() {
  const core::MutexLock lock(mutex_);
  if (queue_.empty() || !may_start(queue_.front().rank)) {
    return nullptr;
  }
  Waiting next = std::move(queue_.front());
  queue_.erase(queue_.begin());
  running_[next.job->id()] = next.rank;
  return next.job;
}

void JobBook::claim(const std::string& id, Rank rank) {
  const core::MutexLock lock(mutex_);
  running_[id] = rank;
}

void JobBook::leave(const std::string& id) {
  const core::MutexLock lock(mutex_);
  running_.erase(id);
}

JobPointer JobBook::add_final(const JobPointer& job) {
  const core::MutexLock lock(mutex_);
  const auto [place, is_new] = jobs_.emplace(job->id(), job);
  JobPointer kept = place->second;
  if (is_new) {
    remember_final(job);
  }
  return kept;
}

void JobBook::retire(const JobPointer& job) {
  const core::MutexLock lock(mutex_);
  if (jobs_.find(job->id()) != jobs_.end()) {  // Else it was deleted.
    remember_final(job);
  }
}

void JobBook::remember_final(const JobPointer& job) {
  auto& list = job->memory_only() ? final_previews_ : final_;
  const auto limit = static_cast<std::size_t>(job->memory_only() ? limits_.final_previews_max
                                                                 : limits_.final_jobs_max);
  std::erase(list, job->id());
  list.push_back(job->id());
  while (list.size() > limit) {
    jobs_.erase(list.front());
    list.pop_front();
  }
}

}  // namespace server
