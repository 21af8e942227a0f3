#include "server/jobs/job_book.h"

#include <algorithm>
#include <utility>

namespace server {
namespace {

/// Bytes of several jobs; what they share counts once.
class Sum {
 public:
  void add(const JobMemory& memory) {
    bytes_ += memory.film_bytes;
    for (const auto& [name, bytes] : memory.shared_bytes) {
      bytes_ += counted_.insert(name).second ? bytes : 0;
    }
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::set<std::string> counted_;
  std::uint64_t bytes_ = 0;
};

}  // namespace

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

bool JobBook::has_room(Rank rank, const JobMemory& memory, const std::string& owner) const {
  const core::MutexLock lock(mutex_);
  const auto waiting_previews =
      std::count_if(queue_.begin(), queue_.end(), [](const Waiting& waiting) { return waiting.rank.is_preview; });
  if (rank.is_preview) {
    const auto held_previews =
        std::count_if(holders_.begin(), holders_.end(), [](const auto& item) { return item.second.rank.is_preview; });
    return waiting_previews + held_previews < limits_.previews_max && !has_its_previews(owner);
  }
  // With a place free a job starts at once and needs no room in the queue.
  const auto waiting = static_cast<int>(queue_.size()) - static_cast<int>(waiting_previews);
  return waiting < limits_.queue_max || (waiting == 0 && may_start(rank) && fits("", rank, memory, {}));
}

bool JobBook::has_its_previews(const std::string& owner) const {
  if (owner.empty() || limits_.previews_of_owner_max == 0) {
    return false;
  }
  const auto waiting = std::count_if(queue_.begin(), queue_.end(), [&](const Waiting& item) {
    return item.rank.is_preview && item.job->owner() == owner;
  });
  const auto held = std::count_if(holders_.begin(), holders_.end(), [&](const auto& item) {
    return item.second.rank.is_preview && item.second.owner == owner;
  });
  return waiting + held >= limits_.previews_of_owner_max;
}

void JobBook::enqueue(const JobPointer& job, Rank rank, JobMemory memory) {
  const core::MutexLock lock(mutex_);
  Waiting waiting{.job = job, .rank = rank, .memory = std::move(memory)};
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
  if (const auto holder = holders_.find(id); holder != holders_.end()) {
    holder->second.rank = rank;
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

std::string JobBook::full_text(Rank rank) const {
  if (rank.is_preview) {
    return "As many previews as there may be are waiting or rendering; try again in a few seconds.";
  }
  const int waiting = queue_length();
  return "The queue is full: " + std::to_string(waiting) + (waiting == 1 ? " job is" : " jobs are") +
         " waiting. Wait until one has started, and try again.";
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

bool JobBook::fits(const std::string& id, Rank rank, const JobMemory& memory,
                   const std::set<std::string>& parked) const {
  Sum sum;
  bool is_alone = true;
  for (const auto& [other, holder] : holders_) {
    if (other != id && parked.find(other) == parked.end()) {
      is_alone = false;
      sum.add(holder.memory);
    }
  }
  sum.add(memory);
  return limits_.memory_max_bytes == 0 || is_alone || sum.bytes() <= limits_.memory_bytes_of(rank);
}

bool JobBook::lacks_only_memory() const {
  return !queue_.empty() && may_start(queue_.front().rank) && !fits(queue_.front());
}

JobPointer JobBook::admit() {
  const core::MutexLock lock(mutex_);
  if (queue_.empty() || !may_start(queue_.front().rank) || !fits(queue_.front())) {
    return nullptr;
  }
  Waiting next = std::move(queue_.front());
  queue_.erase(queue_.begin());
  running_[next.job->id()] = next.rank;
  holders_[next.job->id()] =
      Holder{.rank = next.rank, .memory = std::move(next.memory), .owner = next.job->owner(), .can_park = !next.job->memory_only()};
  return next.job;
}

std::vector<std::string> JobBook::take_parkable() {
  const core::MutexLock lock(mutex_);
  if (!lacks_only_memory()) {
    return {};
  }
  std::vector<std::pair<std::uint64_t, std::string>> paused;
  std::set<std::string> parked;
  for (const auto& [id, holder] : holders_) {
    if (holder.is_parking) {
      parked.insert(id);
    } else if (holder.paused_at > 0 && holder.can_park) {
      paused.emplace_back(holder.paused_at, id);
    }
  }
  std::sort(paused.begin(), paused.end());
  std::vector<std::string> taken;
  for (const auto& [paused_at, id] : paused) {
    if (fits(queue_.front(), parked)) {
      break;
    }
    parked.insert(id);
    taken.push_back(id);
  }
  if (!fits(queue_.front(), parked)) {
    return {};
  }
  for (const std::string& id : taken) {
    holders_[id].is_parking = true;
  }
  return taken;
}

void JobBook::keep(const std::string& id) {
  const core::MutexLock lock(mutex_);
  if (const auto holder = holders_.find(id); holder != holders_.end()) {
    holder->second.is_parking = false;
  }
}

void JobBook::pause(const std::string& id) {
  const core::MutexLock lock(mutex_);
  running_.erase(id);
  if (const auto holder = holders_.find(id); holder != holders_.end()) {
    holder->second.paused_at = ++pauses_;
  }
}

void JobBook::claim(const std::string& id, Rank rank) {
  const core::MutexLock lock(mutex_);
  running_[id] = rank;
  Holder& holder = holders_[id];
  holder.rank = rank;
  holder.paused_at = 0;
  holder.is_parking = false;
}

void JobBook::leave(const std::string& id) {
  const core::MutexLock lock(mutex_);
  running_.erase(id);
  holders_.erase(id);
}

std::uint64_t JobBook::memory_bytes() const {
  const core::MutexLock lock(mutex_);
  Sum sum;
  for (const auto& [id, holder] : holders_) {
    sum.add(holder.memory);
  }
  return sum.bytes();
}

bool JobBook::waits_for_memory() const {
  const core::MutexLock lock(mutex_);
  return lacks_only_memory();
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
