#include "server/jobs/scheduler.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <tuple>
#include <utility>

#include <unistd.h>

#include "core/base/cpu_time.h"

namespace server {
namespace {

/// How long a source without slices is left alone.
constexpr std::chrono::milliseconds kAskAgain{20};
constexpr int kNice = 5;
constexpr double kExpectedSliceSeconds = 0.02;
/// Time of the jobs that lead to that of all who follow them.
constexpr double kLead = 15;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Returns true if a precedes b.
bool goes_first(Rank a, Rank b) {
  if (a.is_preview != b.is_preview) {
    return a.is_preview;
  }
  return a.priority > b.priority;
}

}  // namespace

void yield_to_requests() {
  // On Linux a priority belongs to the thread; a missing permission to change it is harmless.
  [[maybe_unused]] const int priority = ::nice(kNice);
}

Scheduler::Scheduler(int threads) {
  for (int i = 0; i < std::max(1, threads); ++i) {
    threads_.emplace_back([this] { work(); });
  }
}

Scheduler::~Scheduler() { stop(); }

double Scheduler::level(Rank rank, const std::string& tenant) const {
  double least = 0;
  bool found = false;
  for (const auto& entry : entries_) {
    if (entry->rank == rank && entry->tenant == tenant &&
        (!found || entry->served_seconds < least)) {
      least = entry->served_seconds;
      found = true;
    }
  }
  return least;
}

void Scheduler::weigh() {
  struct Group {
    int count = 0;
    int timed = 0;
    std::int64_t oldest = std::numeric_limits<std::int64_t>::max();  ///< Of those not timed.
  };
  std::map<std::tuple<std::string, bool, int>, Group> groups;
  const auto group_of = [&groups](const Entry& entry) -> Group& {
    return groups[{entry.tenant, entry.rank.is_preview, entry.rank.priority}];
  };
  for (const auto& entry : entries_) {
    const SliceSource::Turn turn = entry->source->turn();
    Group& group = group_of(*entry);
    ++group.count;
    group.timed += turn.is_timed ? 1 : 0;
    group.oldest = turn.is_timed ? group.oldest : std::min(group.oldest, turn.age);
  }
  for (const auto& entry : entries_) {
    const SliceSource::Turn turn = entry->source->turn();
    const Group& group = group_of(*entry);
    const int followers = group.count - group.timed - 1;
    const bool leads = turn.is_timed || turn.age == group.oldest;
    entry->weight = leads && followers > 0 && !entry->rank.is_preview ? kLead * followers : 1;
  }
}

void Scheduler::join_share(const std::string& tenant) {
  if (shares_.contains(tenant)) {
    return;
  }
  const auto least =
      std::min_element(shares_.begin(), shares_.end(), [](const auto& a, const auto& b) {
        return a.second.served_seconds < b.second.served_seconds;
      });
  const double start = least == shares_.end() ? 0 : least->second.served_seconds;
  shares_[tenant] = Share{.served_seconds = start};
}

void Scheduler::leave_share(const std::string& tenant) {
  const auto share = shares_.find(tenant);
  const bool has_job = std::any_of(entries_.begin(), entries_.end(),
                                   [&](const auto& entry) { return entry->tenant == tenant; });
  if (share != shares_.end() && share->second.running == 0 && !has_job) {
    shares_.erase(share);
  }
}

void Scheduler::add(std::shared_ptr<SliceSource> source, Rank rank, const std::string& tenant) {
  std::function<void()> listener;
  {
    const core::MutexLock lock(mutex_);
    const double start = level(rank, tenant);
    join_share(tenant);
    const auto found = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const auto& entry) { return entry->source == source; });
    auto entry = std::make_shared<Entry>();
    entry->source = std::move(source);
    entry->rank = rank;
    entry->tenant = tenant;
    entry->served_seconds = start;
    if (found != entries_.end()) {
      *found = std::move(entry);
    } else {
      entries_.push_back(std::move(entry));
    }
    weigh();
    listener = on_add_;
  }
  changed_.notify_all();
  if (listener) {
    listener();
  }
}

void Scheduler::on_add(std::function<void()> listener) {
  const core::MutexLock lock(mutex_);
  on_add_ = std::move(listener);
}

void Scheduler::set_rank(const SliceSource& source, Rank rank) {
  const core::MutexLock lock(mutex_);
  for (const auto& entry : entries_) {
    if (entry->source.get() == &source && !(entry->rank == rank)) {
      entry->served_seconds = level(rank, entry->tenant);
      entry->rank = rank;
    }
  }
  weigh();
}

void Scheduler::remove(const SliceSource& source) {
  const core::MutexLock lock(mutex_);
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) {
    return entry->source.get() == &source;
  });
  if (found != entries_.end()) {
    const std::string tenant = (*found)->tenant;
    entries_.erase(found);
    leave_share(tenant);
    weigh();
  }
}

std::vector<std::shared_ptr<SliceSource>> Scheduler::in_turn() const {
  const core::MutexLock lock(mutex_);
  auto entries = entries_;
  std::vector<std::shared_ptr<SliceSource>> sources;
  while (!entries.empty()) {
    auto first = entries.begin();
    for (auto each = first + 1; each != entries.end(); ++each) {
      first = goes_before(**each, **first) ? each : first;
    }
    sources.push_back((*first)->source);
    entries.erase(first);
  }
  return sources;
}

void Scheduler::charge(const SliceSource& source, double seconds) {
  const core::MutexLock lock(mutex_);
  for (const auto& entry : entries_) {
    if (entry->source.get() == &source) {
      entry->served_seconds += seconds / entry->weight;
      shares_[entry->tenant].served_seconds += seconds;
    }
  }
}

void Scheduler::stop() {
  {
    const core::MutexLock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::jthread& thread : threads_) {
    if (thread.joinable()) {
      thread.join();
    }
  }
}

int Scheduler::active_count() const {
  const core::MutexLock lock(mutex_);
  return static_cast<int>(entries_.size());
}

Scheduler::Times Scheduler::times() const {
  const core::MutexLock lock(mutex_);
  return times_;
}

bool Scheduler::goes_before(const Entry& a, const Entry& b) const {
  // Counts a slice's time for each running thread; otherwise all threads would pick the same job.
  const auto served = [](const auto& part, double weight = 1) {
    return part.served_seconds + kExpectedSliceSeconds * part.running / weight;
  };
  if (!(a.rank == b.rank)) {
    return goes_first(a.rank, b.rank);
  }
  if (a.tenant != b.tenant) {
    return served(shares_.at(a.tenant)) < served(shares_.at(b.tenant));
  }
  const SliceSource::Turn turn_a = a.source->turn();
  const SliceSource::Turn turn_b = b.source->turn();
  if (turn_a.has_image != turn_b.has_image) {
    return turn_b.has_image;
  }
  return turn_a.has_image ? served(a, a.weight) < served(b, b.weight) : turn_a.age < turn_b.age;
}

std::shared_ptr<Scheduler::Entry> Scheduler::pick() {
  std::shared_ptr<Entry> best;
  const auto now = Clock::now();
  for (const auto& entry : entries_) {
    if (entry->asleep_until > now) {
      continue;
    }
    if (!best || goes_before(*entry, *best)) {
      best = entry;
    }
  }
  return best;
}

void Scheduler::work() {
  yield_to_requests();
  mutex_.lock();
  while (!stopping_) {
    const std::shared_ptr<Entry> entry = pick();
    if (!entry) {
      const bool has_jobs = !entries_.empty();
      const auto since = Clock::now();
      if (has_jobs) {
        changed_.wait_for(mutex_, kAskAgain);
        times_.idle_seconds += seconds_since(since);
      } else {
        changed_.wait(mutex_);  // Nothing to ask: add() and stop() notify.
      }
      continue;
    }
    const std::uint64_t completions = entry->completions;
    ++entry->running;
    ++shares_[entry->tenant].running;
    mutex_.unlock();
    const double begin = core::thread_cpu_seconds();
    const bool ran = entry->source->run_slice();
    const double spent = core::thread_cpu_seconds() - begin;
    const auto since = Clock::now();
    mutex_.lock();
    times_.lock_wait_seconds += seconds_since(since);
    --entry->running;
    entry->served_seconds += spent / entry->weight;
    Share& share = shares_[entry->tenant];
    --share.running;
    share.served_seconds += spent;
    leave_share(entry->tenant);
    times_.cpu_seconds += spent;
    if (ran) {
      ++entry->completions;
      if (std::exchange(entry->asleep_until, {}) != Clock::time_point{}) {
        changed_.notify_all();
      }
    } else if (entry->completions == completions) {
      // Ends earlier when a slice of the source finishes. It may also have slices without that: it
      // made a decision while it was asked, or slices came back from elsewhere.
      entry->asleep_until = Clock::now() + kAskAgain;
    }
  }
  mutex_.unlock();
}

}  // namespace server
