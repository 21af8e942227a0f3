// WorkBoard's thread: creates and publishes units, and takes them back from lost workers.
#include <algorithm>
#include <utility>

#include "core/render/units/result_size.h"
#include "server/jobs/work_board.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Limits of a unit's CPU time, so that a worker takes 1 to 5 s for it. Most: a worker half as fast
/// as the mean takes 5 s. Least, at the end of a pass: ten times the cost of leasing a unit and
/// taking its result, at a round trip of 10 ms.
constexpr double kUnitSecondsMost = 2.5;
constexpr double kUnitSecondsLeast = 0.1;
/// How long a result waits for another worker's: that worker may be rendering another unit first,
/// and each takes 5 s on a worker half as fast as the mean. A stopped or disconnected worker delays
/// no job further.
constexpr std::chrono::duration<double> kVerifyWait{4 * kUnitSecondsMost};
/// Largest part of the film in a unit: sending its result at 1 Gbit/s takes a twentieth of the
/// longest unit's time.
constexpr double kUnitBytesMost = kUnitSecondsMost / 20 * 125e6;
/// Each unit is a share of the remaining pass, so that the last ones are short and end at about the
/// same time. Source: Hummel, Schonberg and Flynn 1992, "Factoring", whose share is 1/2.
constexpr int kShareOfRest = 2;
/// A unit lost by this many different workers fails its job: it may be what ends them.
constexpr std::size_t kLostMax = 3;
/// Delay at which the thread notices events that do not wake it: an expired lease, or a pass
/// completed by threads of this process. Half of the shortest unit.
constexpr auto kTick = std::chrono::duration_cast<std::chrono::milliseconds>(
    std::chrono::duration<double>(kUnitSecondsLeast / 2));
/// Workers are listed for this many leases after their last report: ten minutes at the default
/// lease, so that an operator sees which ones were lost. Nothing else depends on it.
constexpr int kLeasesRemembered = 40;

}  // namespace

void WorkBoard::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      const core::MutexLock lock(mutex_);
      changed_.wait_for(mutex_, stop, kTick, [this]() REQUIRES(mutex_) { return is_news_; });
      is_news_ = false;
    }
    drop_ended();
    expire_leases();
    render_hopeless();
    take_unverified();
    has_broker_ = prepare_broker();
    if (has_broker_) {
      had_broker_at_ = Clock::now();
      plan();
      find_lost_messages();
      publish();
      request_reports();
    }
    drop_waiting();
    note_waiting_jobs();
  }
}

/// Drops the units of runs that need no more slices: a cancelled run ends when all have come back.
void WorkBoard::drop_ended() {
  Units ended;
  {
    const core::MutexLock lock(mutex_);
    for (auto unit = units_.begin(); unit != units_.end();) {
      const auto next = std::next(unit);
      RenderRun& run = *unit->second.run;
      const JobPointer job = run.job();
      if (run.task().is_stopping() || run.end() || !job || job->run().get() != &run) {
        unit->second.own.request_stop();
        if (!unit->second.is_busy) {
          ended.insert(remove(unit));
        }
      }
      unit = next;
    }
  }
  give_back(ended);
}

/// Marks a job as waiting if no worker could render it for the length of a lease, since restarting
/// a worker or the broker takes less.
void WorkBoard::note_waiting_jobs() {
  const auto now = Clock::now();
  {
    const core::MutexLock lock(mutex_);
    had_workers_at_ = slots() > 0 ? now : had_workers_at_;
  }
  const std::string reason = options_.has_local_threads            ? ""
                             : now - had_broker_at_ > lease_time() ? "the queue is not connected"
                             : now - had_workers_at_ > lease_time()
                                 ? "no suitable worker is connected"
                                 : "";
  // Jobs that were given the warning by an earlier process are looked up once a second.
  constexpr std::chrono::seconds kPause{1};
  if (now - noted_at_ < kPause && (!reason.empty() || warned_.empty())) {
    return;
  }
  noted_at_ = now;
  for (const std::weak_ptr<Job>& warned : std::exchange(warned_, {})) {
    if (const JobPointer job = warned.lock(); job && reason.empty()) {
      calls_.note_waiting(*job, "");
    }
  }
  for (const std::shared_ptr<SliceSource>& source : scheduler_.in_turn()) {
    const auto run = std::dynamic_pointer_cast<RenderRun>(source);
    if (const JobPointer job = run && !run->end() ? run->job() : nullptr) {
      const bool waits = !reason.empty() && run->is_lent();
      calls_.note_waiting(*job, waits ? reason : "");
      if (waits) {
        warned_.push_back(job);
      }
    }
  }
}

void WorkBoard::give_back(const Units& units) {
  for (const auto& [name, unit] : units) {
    for (const core::Slice& slice : unit.slices) {
      unit.run->give_back(slice);
    }
  }
}

void WorkBoard::drop_waiting() {
  if (!options_.has_local_threads) {
    return;
  }
  Units waiting;
  {
    const core::MutexLock lock(mutex_);
    if (slots() > 0 && Clock::now() - had_broker_at_ < lease_time()) {
      return;
    }
    for (auto unit = units_.begin(); unit != units_.end();) {
      const auto next = std::next(unit);
      if (unit->second.leases.empty() && !unit->second.is_busy) {
        waiting.insert(units_.extract(unit));
      }
      unit = next;
    }
  }
  give_back(waiting);
}

void WorkBoard::fail(const Failures& failures) {
  for (const auto& [run, reason] : failures) {
    run->fail(Error{ErrorCode::kInternal, reason, ""});
  }
}

void WorkBoard::expire_leases() {
  Failures failures;
  {
    const core::MutexLock lock(mutex_);
    const auto now = Clock::now();
    for (auto& entry : units_) {
      WorkUnit& unit = entry.second;
      for (const WorkUnit::Lease& lease : std::vector(unit.leases)) {
        if (!unit.is_busy && now > lease.until) {
          ++counts_.expired;
          fail_unit(entry, lease.worker, Fault::kLost, "it did not report in time");
        }
      }
      if (unit.lost.size() >= kLostMax) {
        // Clients see this text; the log line of each loss names the worker.
        failures.emplace_back(unit.run, "a part of the image was lost with " +
                                            std::to_string(unit.lost.size()) +
                                            " workers, which stopped reporting while they "
                                            "rendered it");
      }
    }
    std::erase_if(workers_, [&](const auto& each) {
      return now - each.second.seen > kLeasesRemembered * lease_time();
    });
  }
  fail(failures);
}

void WorkBoard::take_unverified() {
  struct Alone {
    std::string name;
    std::shared_ptr<RenderRun> run;
    WorkUnit::Result result;
  };
  std::vector<Alone> alone;
  {
    const core::MutexLock lock(mutex_);
    for (auto& [name, unit] : units_) {
      const bool has_other =
          unit.first && std::any_of(workers_.begin(), workers_.end(), [&](const auto& each) {
            return each.first != unit.first->worker && works(each.second);
          });
      const bool is_late = unit.first && Clock::now() - unit.first->at > kVerifyWait;
      if (unit.first && !unit.is_busy && (is_late || (unit.leases.empty() && !has_other))) {
        unit.is_busy = true;
        alone.push_back({name, unit.run, *std::exchange(unit.first, std::nullopt)});
        note_unverified(alone.back().result.worker, *unit.run);
        log_.write(LogLevel::kWarning, "result_not_verified",
                   {{"unit", name}, {"worker", alone.back().result.worker}});
      }
    }
  }
  for (Alone& each : alone) {
    each.run->accept(std::move(each.result.work));
    const core::MutexLock lock(mutex_);
    ++counts_.taken;
    remove(units_.find(each.name));
  }
}

/// Keeps one unit in the queue per thread of the workers, so that each finds its next one there; at
/// least one, so that an autoscaler sees that workers are needed.
void WorkBoard::plan() {
  while (true) {
    int slots = 0;
    {
      const core::MutexLock lock(mutex_);
      slots = std::max(this->slots(), options_.has_local_threads ? 0 : 1);
      int waiting = 0;
      for (const auto& [name, unit] : units_) {
        waiting += std::max(0, unit.wanted());
      }
      if (waiting >= slots) {
        return;
      }
    }
    if (!plan_one(slots)) {
      double_last_units();
      return;
    }
  }
}

bool WorkBoard::plan_one(int slots) {
  for (const std::shared_ptr<SliceSource>& source : scheduler_.in_turn()) {
    const auto run = std::dynamic_pointer_cast<RenderRun>(source);
    const JobPointer job = run ? run->job() : nullptr;
    if (!job) {
      continue;
    }
    const int shares = kShareOfRest * slots;
    const double seconds =
        std::clamp(run->task().seconds_to_hand_out() / shares, kUnitSecondsLeast, kUnitSecondsMost);
    // The time of the first slices is unknown, so the film also limits the unit.
    const core::Film& film = *run->film();
    const int fitting =
        static_cast<int>(kUnitBytesMost * film.tile_count() / static_cast<double>(film.bytes()));
    const std::uint64_t sums = core::result_bytes_max(film, 0);
    const std::uint64_t allowed = (kResultBytesMax - std::min(kResultBytesMax, sums)) /
                                  (core::result_bytes_max(film, 1) - sums);
    const auto most =
        static_cast<std::size_t>(std::max(1, std::min(film.tile_count() / shares, fitting)));
    RenderRun::Lent lent = run->lend(seconds, std::min<std::size_t>(most, allowed));
    if (lent.slices.empty()) {
      continue;
    }
    scheduler_.charge(*source, lent.expected_seconds);
    const core::MutexLock lock(mutex_);
    WorkUnit& unit = units_[job->id() + "." + run_name_ + "." + std::to_string(++last_unit_)];
    unit.run = run;
    unit.slices = std::move(lent.slices);
    unit.expected_seconds = lent.expected_seconds;
    const auto live = std::count_if(workers_.begin(), workers_.end(),
                                    [this](const auto& each) { return works(each.second); });
    unit.is_checked = live > 1 && std::bernoulli_distribution(options_.verify_share)(chance_);
    unit.copies = unit.is_checked ? 2 : 1;
    return true;
  }
  return false;
}

/// When nothing is left to lease, gives the longest-running units to idle workers too.
void WorkBoard::double_last_units() {
  const core::MutexLock lock(mutex_);
  const auto now = Clock::now();
  auto held = leases();
  std::vector<WorkUnit*> late;
  for (auto& [name, unit] : units_) {
    const bool is_late = unit.copies == 1 && unit.leases.size() == 1 && !unit.is_busy &&
                         std::chrono::duration<double>(now - unit.leases.front().since).count() >
                             unit.expected_seconds;
    if (is_late) {
      late.push_back(&unit);
    }
  }
  std::sort(late.begin(), late.end(), [](const WorkUnit* a, const WorkUnit* b) {
    return a->leases.front().since < b->leases.front().since;
  });
  for (WorkUnit* unit : late) {
    const auto helper = std::find_if(workers_.begin(), workers_.end(), [&](const auto& each) {
      return works(each.second) && each.first != unit->leases.front().worker &&
             held[each.first] < each.second.view.threads;
    });
    if (helper != workers_.end()) {
      ++held[helper->first];
      unit->copies = 2;
      ++counts_.doubled;
    }
  }
}

/// Publishes names again whose messages are lost. A worker keeps the message of a unit until it is
/// done with it, so the stream then has fewer messages than units are published or leased.
void WorkBoard::find_lost_messages() {
  const auto now = Clock::now();
  const auto is_late = [&](const WorkUnit& unit) {
    return unit.published > 0 && now - unit.published_at > 2 * lease_time();
  };
  std::uint64_t expected = 0;
  {
    const core::MutexLock lock(mutex_);
    bool is_any_late = false;
    for (const auto& [name, unit] : units_) {
      expected += static_cast<std::uint64_t>(unit.published) + unit.leases.size();
      is_any_late = is_any_late || is_late(unit);
    }
    if (!is_any_late) {
      return;
    }
  }
  const auto messages = publisher_->messages();
  if (!messages) {
    note_queue_fault(messages.error());
    return;
  }
  const core::MutexLock lock(mutex_);
  for (auto& [name, unit] : units_) {
    if (is_late(unit)) {
      unit.published = *messages < expected ? 0 : unit.published;
      unit.published_at = now;
    }
  }
}

/// All open units are published once there is a stream again.
void WorkBoard::note_queue_fault(const Error& fault) {
  log_.write(LogLevel::kWarning, "queue_fault", {{"detail", fault.message}});
  prepared_.reset();
}

void WorkBoard::publish() {
  std::vector<std::string> names;
  {
    const core::MutexLock lock(mutex_);
    for (auto& [name, unit] : units_) {
      for (; unit.published < unit.wanted(); ++unit.published) {
        names.push_back(name);
        unit.published_at = Clock::now();
      }
    }
  }
  for (const std::string& name : names) {
    if (const Status published = publisher_->publish(name); !published) {
      note_queue_fault(published.error());
      return;
    }
  }
}

void WorkBoard::request_reports() {
  std::set<std::string> workers;
  {
    const core::MutexLock lock(mutex_);
    workers.swap(to_report_);
  }
  for (const std::string& worker : workers) {
    publisher_->request_report(worker);
  }
}

/// Creates the stream on each new connection and publishes all open units in it.
bool WorkBoard::prepare_broker() {
  const std::uint64_t generation = publisher_->link().generation();
  if (prepared_ == generation && publisher_->link().is_connected()) {
    return true;
  }
  const auto silence = std::chrono::duration_cast<std::chrono::milliseconds>(lease_time());
  if (const Status ready = publisher_->prepare(silence); !ready) {
    if (broker_fault_ != ready.error().message) {
      broker_fault_ = ready.error().message;
      log_.write(LogLevel::kWarning, "queue_fault", {{"detail", broker_fault_}});
    }
    return false;
  }
  log_.write(LogLevel::kInfo, "queue_ready", {{"queue", publisher_->link().name()}});
  broker_fault_.clear();
  prepared_ = generation;
  const core::MutexLock lock(mutex_);
  for (auto& [name, unit] : units_) {
    unit.published = 0;
  }
  return true;
}

}  // namespace server
