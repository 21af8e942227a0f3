#include "server/jobs/job_book.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace server {
namespace {

void add_use(MemoryUse& use, const JobMemory& memory) {
  use.bytes += memory.own_bytes();
  use.shared.insert(memory.shared_bytes.begin(), memory.shared_bytes.end());
}

}  // namespace

std::uint64_t JobMemory::bytes() const {
  std::uint64_t bytes = own_bytes();
  for (const auto& [name, more] : shared_bytes) {
    bytes += more;
  }
  return bytes;
}

JobBook::JobBook(BookLimits limits, MemoryGate& memory, std::function<void()> on_leave)
    : limits_(limits),
      memory_(memory),
      on_leave_(std::move(on_leave)),
      held_(memory.note({}, MemoryGate::Kind::kNeeded)) {}

std::uint64_t JobBook::memory_bytes_of(Rank rank) const {
  const std::uint64_t all = memory_.bytes_max();
  return all - (rank.is_preview ? all / 16 : all / 8);
}

bool JobBook::goes_before(const Waiting& a, const Waiting& b) {
  if (a.rank.is_preview != b.rank.is_preview) {
    return a.rank.is_preview;
  }
  if (a.rank.priority != b.rank.priority) {
    return a.rank.priority > b.rank.priority;
  }
  if (a.turn != b.turn) {
    return a.turn < b.turn;
  }
  return a.job->sequence() < b.job->sequence();
}

void JobBook::arrange() {
  const auto by_image_and_age = [](const Waiting& a, const Waiting& b) {
    return std::pair(a.has_image, a.job->sequence()) < std::pair(b.has_image, b.job->sequence());
  };
  std::sort(queue_.begin(), queue_.end(), by_image_and_age);
  std::map<std::tuple<std::string, bool, int>, int> turns;
  for (const auto& [number, holder] : holders_) {
    if (holder.paused_at == 0) {
      ++turns[{holder.job->tenant(), holder.rank.is_preview, holder.rank.priority}];
    }
  }
  for (Waiting& waiting : queue_) {
    waiting.turn = turns[{waiting.job->tenant(), waiting.rank.is_preview, waiting.rank.priority}]++;
  }
  std::stable_sort(queue_.begin(), queue_.end(), &goes_before);
}

void JobBook::add(const JobPointer& job) {
  const core::MutexLock lock(mutex_);
  jobs_[job->id()] = job;
}

void JobBook::forget(const Job& job) {
  const core::MutexLock lock(mutex_);
  if (const auto found = jobs_.find(job.id());
      found != jobs_.end() && found->second.get() == &job) {
    jobs_.erase(found);
    std::erase(final_, job.id());
    std::erase(final_previews_, job.id());
  }
}

JobPointer JobBook::find(const std::string& id) const {
  const core::MutexLock lock(mutex_);
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second;
}

std::vector<JobPointer> JobBook::all() const {
  const core::MutexLock lock(mutex_);
  std::vector<JobPointer> jobs;
  jobs.reserve(jobs_.size());
  for (const auto& entry : jobs_) {
    jobs.push_back(entry.second);
  }
  return jobs;
}

std::vector<JobPointer> JobBook::with_slots() const {
  const core::MutexLock lock(mutex_);
  std::vector<JobPointer> jobs;
  for (const auto& [number, holder] : holders_) {
    jobs.push_back(holder.job);
  }
  return jobs;
}

bool JobBook::has_room(const Admission& admission, const std::string& tenant) const {
  const Rank rank = admission.rank;
  const core::MutexLock lock(mutex_);
  const auto waiting_previews = std::count_if(
      queue_.begin(), queue_.end(), [](const Waiting& waiting) { return waiting.rank.is_preview; });
  if (rank.is_preview) {
    const auto held_previews =
        std::count_if(holders_.begin(), holders_.end(),
                      [](const auto& item) { return item.second.rank.is_preview; });
    return waiting_previews + held_previews < limits_.previews_max && !has_its_previews(tenant);
  }
  // If a slot is free, a job starts at once and needs no room in the queue.
  const auto waiting = static_cast<int>(queue_.size()) - static_cast<int>(waiting_previews);
  return waiting < limits_.queue_max ||
         (waiting == 0 && may_start(rank, tenant) && fits(rank, tenant, admission.memory));
}

bool JobBook::has_room_for(int jobs) const {
  const core::MutexLock lock(mutex_);
  const auto waiting = std::count_if(queue_.begin(), queue_.end(),
                                     [](const Waiting& item) { return !item.rank.is_preview; });
  return waiting + jobs <= limits_.queue_max;
}

bool JobBook::has_its_previews(const std::string& tenant) const {
  if (tenant.empty() || limits_.previews_of_tenant_max == 0) {
    return false;
  }
  const auto waiting = std::count_if(queue_.begin(), queue_.end(), [&](const Waiting& item) {
    return item.rank.is_preview && item.job->tenant() == tenant;
  });
  const auto held = std::count_if(holders_.begin(), holders_.end(), [&](const auto& item) {
    return item.second.rank.is_preview && item.second.job->tenant() == tenant;
  });
  return waiting + held >= limits_.previews_of_tenant_max;
}

void JobBook::enqueue(std::vector<Entry> entries) {
  const core::MutexLock lock(mutex_);
  for (Entry& entry : entries) {
    std::erase(final_, entry.job->id());
    const bool has_image = entry.job->record().view.progress.samples_min > 0;
    queue_.push_back({.job = std::move(entry.job),
                      .rank = entry.admission.rank,
                      .memory = std::move(entry.admission.memory),
                      .has_image = has_image});
  }
  arrange();
}

void JobBook::dequeue(const Job& job) {
  const core::MutexLock lock(mutex_);
  std::erase_if(queue_, [&](const Waiting& waiting) { return waiting.job.get() == &job; });
  arrange();
}

void JobBook::set_rank(const Job& job, Rank rank) {
  const core::MutexLock lock(mutex_);
  for (auto& [number, holder] : holders_) {
    if (holder.job.get() == &job) {
      holder.rank = rank;
    }
  }
  const auto found = std::find_if(queue_.begin(), queue_.end(), [&](const Waiting& waiting) {
    return waiting.job.get() == &job;
  });
  if (found != queue_.end()) {
    found->rank = rank;
  }
  arrange();
}

std::optional<int> JobBook::position(const Job& job) const {
  const core::MutexLock lock(mutex_);
  const auto found = std::find_if(queue_.begin(), queue_.end(), [&](const Waiting& waiting) {
    return waiting.job.get() == &job;
  });
  if (found == queue_.end()) {
    return std::nullopt;
  }
  return static_cast<int>(found - queue_.begin());
}

int JobBook::queue_length() const {
  const core::MutexLock lock(mutex_);
  return static_cast<int>(queue_.size());
}

int JobBook::running_count() const {
  const core::MutexLock lock(mutex_);
  return static_cast<int>(std::count_if(holders_.begin(), holders_.end(), [](const auto& item) {
    return item.second.paused_at == 0;
  }));
}

std::string JobBook::full_text(Rank rank) const {
  if (rank.is_preview) {
    return "The limit on concurrent previews is reached; try again in a few seconds.";
  }
  const int waiting = queue_length();
  return "The queue is full: " + std::to_string(waiting) +
         (waiting == 1 ? " job is" : " jobs are") +
         " waiting. Wait until one has started, and try again.";
}

bool JobBook::may_start(Rank rank, const std::string& tenant,
                        const std::set<std::uint64_t>& parked) const {
  if (rank.is_preview) {
    return true;
  }
  int slots = 0;
  bool outranks_one = false;
  bool has_slot = false;
  for (const auto& [number, holder] : holders_) {
    if (holder.paused_at == 0 && !holder.rank.is_preview && !parked.contains(number)) {
      ++slots;
      outranks_one = outranks_one || rank.priority > holder.rank.priority;
      has_slot = has_slot || holder.job->tenant() == tenant;
    }
  }
  return slots < limits_.running_max ||
         ((outranks_one || !has_slot) && slots < 2 * limits_.running_max);
}

MemoryUse JobBook::use_of_holders(const std::set<std::uint64_t>& parked) const {
  MemoryUse use;
  for (const auto& [number, holder] : holders_) {
    if (parked.find(number) == parked.end()) {
      add_use(use, holder.memory);
    }
  }
  return use;
}

bool JobBook::is_too_large(Rank rank, const JobMemory& memory) const {
  return memory_.bytes_max() > 0 && memory.bytes() > memory_bytes_of(rank);
}

std::uint64_t JobBook::most_with(Rank rank, const std::string& tenant,
                                 const JobMemory& memory) const {
  const bool is_first = std::none_of(holders_.begin(), holders_.end(), [&](const auto& item) {
    return item.second.job->tenant() == tenant;
  });
  if (!is_first) {
    return memory_bytes_of(rank);
  }
  const std::uint64_t most = memory_.bytes_max_of_first(memory.bytes());
  return most > memory_.bytes_max() ? most : memory_bytes_of({.is_preview = true});
}

bool JobBook::fits(Rank rank, const std::string& tenant, const JobMemory& memory,
                   const std::set<std::uint64_t>& parked) const {
  MemoryUse use = use_of_holders(parked);
  add_use(use, memory);
  return is_too_large(rank, memory) ||
         memory_.has_room(held_, use, most_with(rank, tenant, memory));
}

bool JobBook::lacks_only_memory() const {
  return !queue_.empty() && may_start(queue_.front()) && !fits(queue_.front());
}

std::shared_ptr<JobBook::Slot> JobBook::admit() {
  for (;;) {
    MemoryGate::Fit fit = MemoryGate::Fit::kNo;
    if (auto slot = try_admit(fit)) {
      return slot;
    }
    // Without the lock, which forget_oldest_preview() takes.
    if (fit != MemoryGate::Fit::kWithoutIdle || !memory_.drop_one_idle()) {
      return nullptr;
    }
  }
}

std::shared_ptr<JobBook::Slot> JobBook::try_admit(MemoryGate::Fit& fit) {
  const core::MutexLock lock(mutex_);
  if (queue_.empty() || !may_start(queue_.front())) {
    return nullptr;
  }
  const Waiting& front = queue_.front();
  const JobMemory held = is_too_large(front.rank, front.memory) ? JobMemory{} : front.memory;
  MemoryUse use = use_of_holders();
  add_use(use, held);
  const std::uint64_t most = most_with(front.rank, front.job->tenant(), held);
  fit = memory_.try_change(held_, use, most);
  if (fit != MemoryGate::Fit::kYes) {
    return nullptr;
  }
  Waiting next = std::move(queue_.front());
  queue_.erase(queue_.begin());
  const std::uint64_t number = ++slots_given_;
  holders_[number] = Holder{.job = next.job, .rank = next.rank, .memory = held};
  arrange();
  return std::make_shared<Slot>(*this, number, std::move(next.job), std::move(next.memory));
}

std::vector<JobPointer> JobBook::take_parkable() {
  const core::MutexLock lock(mutex_);
  if (!lacks_only_memory()) {
    return {};
  }
  const Waiting& next = queue_.front();
  std::vector<std::pair<std::uint64_t, std::uint64_t>> paused;
  std::set<std::uint64_t> parked;
  for (const auto& [number, holder] : holders_) {
    if (holder.is_parking) {
      parked.insert(number);
    } else if (holder.paused_at > 0 &&
               !holder.job->memory_only()) {  // Jobs that are not memory-only have a film file.
      paused.emplace_back(holder.paused_at, number);
    }
  }
  std::sort(paused.begin(), paused.end());
  std::vector<std::uint64_t> taken;
  for (const auto& [paused_at, number] : paused) {
    if (fits(next, parked)) {
      break;
    }
    parked.insert(number);
    taken.push_back(number);
  }
  if (!fits(next, parked)) {
    return {};
  }
  std::vector<JobPointer> jobs;
  for (const std::uint64_t number : taken) {
    holders_[number].is_parking = true;
    jobs.push_back(holders_[number].job);
  }
  return jobs;
}

std::optional<std::uint64_t> JobBook::last_that_may_yield(
    const Waiting& next, const std::function<SliceSource::Turn(const Job&)>& turn_of) const {
  const std::string& tenant = next.job->tenant();
  const std::string scene = next.job->record().view.spec.scene;
  std::map<std::string, int> running;  // by tenant
  for (const auto& [number, holder] : holders_) {
    running[holder.job->tenant()] += holder.paused_at == 0 && !holder.rank.is_preview ? 1 : 0;
  }
  const bool is_first = running[tenant] == 0;
  std::optional<std::uint64_t> last;
  for (const auto& [number, holder] : holders_) {
    if (holder.is_parking) {
      return std::nullopt;
    }
    const std::string& its_tenant = holder.job->tenant();
    const bool is_like = its_tenant == tenant && holder.job->record().view.spec.scene == scene;
    if (holder.paused_at > 0 || holder.rank != next.rank ||
        !(is_first ? running[its_tenant] > 1 : is_like)) {
      continue;
    }
    const SliceSource::Turn turn = turn_of(*holder.job);
    if (!turn.has_image && !is_first) {
      return std::nullopt;
    }
    if (turn.has_image && !turn.is_timed &&
        (!last || holder.job->sequence() > holders_.at(*last).job->sequence())) {
      last = number;
    }
  }
  return last;
}

JobPointer JobBook::take_yielding(const std::function<SliceSource::Turn(const Job&)>& turn_of) {
  const core::MutexLock lock(mutex_);
  if (queue_.empty() || queue_.front().rank.is_preview) {
    return nullptr;
  }
  const Waiting& next = queue_.front();
  const auto can_start = [&](const std::set<std::uint64_t>& parked) REQUIRES(mutex_) {
    return may_start(next, parked) && fits(next, parked);
  };
  const auto last = can_start({}) ? std::nullopt : last_that_may_yield(next, turn_of);
  if (!last || !can_start({*last})) {
    return nullptr;
  }
  Holder& holder = holders_.at(*last);
  if (next.has_image && next.job->sequence() > holder.job->sequence()) {
    return nullptr;
  }
  holder.is_parking = true;
  return holder.job;
}

void JobBook::keep(const Job& job) {
  const core::MutexLock lock(mutex_);
  for (auto& [number, holder] : holders_) {
    if (holder.job.get() == &job) {
      holder.is_parking = false;
    }
  }
}

void JobBook::pause(const Job& job) {
  const core::MutexLock lock(mutex_);
  ++pauses_;
  for (auto& [number, holder] : holders_) {
    if (holder.job.get() == &job) {
      holder.paused_at = pauses_;
    }
  }
  arrange();
}

void JobBook::claim(const Job& job, Rank rank) {
  const core::MutexLock lock(mutex_);
  for (auto& [number, holder] : holders_) {
    if (holder.job.get() == &job) {
      holder.rank = rank;
      holder.paused_at = 0;
      holder.is_parking = false;
    }
  }
  arrange();
}

void JobBook::leave(std::uint64_t number) {
  {
    const core::MutexLock lock(mutex_);
    holders_.erase(number);  // The slot being released keeps the job alive.
    note_memory();
    arrange();
  }
  if (on_leave_) {
    on_leave_();
  }
}

std::vector<JobPointer> JobBook::holders() const {
  const core::MutexLock lock(mutex_);
  std::vector<JobPointer> jobs;
  for (const auto& [number, holder] : holders_) {
    jobs.push_back(holder.job);
  }
  return jobs;
}

std::uint64_t JobBook::memory_bytes() const {
  const core::MutexLock lock(mutex_);
  const MemoryUse use = use_of_holders();
  return std::accumulate(use.shared.begin(), use.shared.end(), use.bytes,
                         [](std::uint64_t sum, const auto& shared) { return sum + shared.second; });
}

void JobBook::end_load(const Job& job, std::map<std::string, std::uint64_t> shared_bytes) {
  {
    const core::MutexLock lock(mutex_);
    for (auto& [number, holder] : holders_) {
      if (holder.job.get() == &job) {
        holder.memory.load_bytes = 0;
        holder.memory.shared_bytes = shared_bytes;
      }
    }
    note_memory();
  }
  if (on_leave_) {
    on_leave_();
  }
}

bool JobBook::forget_oldest_preview() {
  JobPointer oldest;  // Destroyed, with its film, after the lock is released.
  const core::MutexLock lock(mutex_);
  if (final_previews_.empty()) {
    return false;
  }
  const auto found = jobs_.find(final_previews_.front());
  if (found != jobs_.end()) {
    oldest = std::move(found->second);
    jobs_.erase(found);
  }
  final_previews_.pop_front();
  return true;
}

bool JobBook::waits_for_memory() const {
  const core::MutexLock lock(mutex_);
  return lacks_only_memory();
}

JobPointer JobBook::add_final(const JobPointer& job) {
  const core::MutexLock lock(mutex_);
  const auto [entry, is_new] = jobs_.emplace(job->id(), job);
  JobPointer kept = entry->second;
  if (is_new) {
    remember_final(job);
  }
  return kept;
}

void JobBook::retire(const JobPointer& job) {
  const core::MutexLock lock(mutex_);
  if (const auto found = jobs_.find(job->id()); found != jobs_.end() && found->second == job) {
    // Otherwise the job was deleted, and its id may be in use again.
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
