// WorkBoard's thread: creates and publishes units, and takes them back from lost workers.
#include <algorithm>
#include <utility>

#include "core/render/units/result_size.h"
#include "server/jobs/render_run.h"
#include "server/jobs/work_board.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Shortest CPU time of a unit, at the end of a pass: ten times the cost of leasing it and taking
/// its result, at a round trip of 10 ms.
constexpr double kUnitSecondsLeast = 0.1;
/// Largest part of the film in a unit: sending its result at 1 Gbit/s takes a twentieth of the
/// longest unit's time.
constexpr double kUnitBytesMost = kUnitSecondsMost / 20 * 125e6;
/// Each unit is a share of the remaining pass, so that the last ones are short and end at about the
/// same time. Source: Hummel, Schonberg and Flynn 1992, "Factoring", whose share is 1/2.
constexpr int kShareOfRest = 2;
/// Delay at which the thread notices events that do not wake it: an expired lease, or a pass
/// completed by threads of this process. Half of the shortest unit.
constexpr auto kTick = std::chrono::duration_cast<std::chrono::milliseconds>(
    std::chrono::duration<double>(kUnitSecondsLeast / 2));

/// Returns the pixel samples of the slices.
double samples_of(const core::Film& film, const std::vector<core::Slice>& slices) {
  double samples = 0;
  for (const core::Slice& slice : slices) {
    if (slice.tile < film.unit_count()) {
      const core::PixelRect rect = film.unit_rect(slice.tile);
      samples +=
          static_cast<double>(rect.width) * rect.height * (slice.last_sample - slice.first_sample);
    }
  }
  return samples;
}

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
  const auto has_ended = [](const WorkUnit& unit) {
    const RenderRun& run = *unit.run;
    const JobPointer job = unit.job.lock();
    return run.task().is_stopping() || run.end() || !job || job->run().get() != &run;
  };
  LeaseTable::Units ended;
  {
    const core::MutexLock lock(mutex_);
    ended = table_.remove_if(has_ended);
  }
  give_back(ended);
}

/// Marks a job as waiting if no worker could render it for the length of a lease, since restarting
/// a worker or the broker takes less.
void WorkBoard::note_waiting_jobs() {
  const auto now = Clock::now();
  {
    const core::MutexLock lock(mutex_);
    had_workers_at_ = table_.slots(now) > 0 ? now : had_workers_at_;
  }
  const std::string reason =
      options_.has_local_threads                      ? ""
      : now - had_broker_at_ > options_.lease_time()  ? "the queue is not connected"
      : now - had_workers_at_ > options_.lease_time() ? "no suitable worker is connected"
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

void WorkBoard::give_back(const LeaseTable::Units& units) {
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
  LeaseTable::Units waiting;
  {
    const core::MutexLock lock(mutex_);
    const auto now = Clock::now();
    if (table_.slots(now) > 0 && now - had_broker_at_ < options_.lease_time()) {
      return;
    }
    waiting =
        table_.remove_if([](const WorkUnit& unit) { return unit.leases.empty() && !unit.is_busy; });
  }
  give_back(waiting);
}

void WorkBoard::expire_leases() {
  std::vector<std::pair<std::shared_ptr<RenderRun>, std::string>> failures;
  {
    const core::MutexLock lock(mutex_);
    for (const WorkUnit* unit : table_.expire(Clock::now())) {
      // Clients see this text; the log line of each loss names the worker.
      failures.emplace_back(unit->run, "a part of the image was lost with " +
                                           std::to_string(unit->lost.size()) +
                                           " workers, which stopped reporting while they "
                                           "rendered it");
    }
  }
  for (const auto& [run, reason] : failures) {
    run->fail(Error{ErrorCode::kInternal, reason, ""});
  }
}

void WorkBoard::render_hopeless() {
  const core::MutexLock lock(mutex_);
  for (const std::string& name : table_.hopeless(Clock::now())) {
    render_here(name);
  }
}

void WorkBoard::take_unverified() {
  std::vector<LeaseTable::Alone> alone;
  {
    const core::MutexLock lock(mutex_);
    alone = table_.take_unverified(Clock::now());
  }
  for (LeaseTable::Alone& each : alone) {
    accept(each.name, *each.run, std::move(each.work));
  }
}

/// Keeps one unit in the queue per thread of the workers, so that each finds its next one there; at
/// least one, so that an autoscaler sees that workers are needed.
void WorkBoard::plan() {
  while (true) {
    int slots = 0;
    {
      const core::MutexLock lock(mutex_);
      slots = std::max(table_.slots(Clock::now()), options_.has_local_threads ? 0 : 1);
      if (table_.wanted() >= slots) {
        return;
      }
    }
    if (!plan_one(slots)) {
      const core::MutexLock lock(mutex_);
      table_.double_last_units(Clock::now());
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
    WorkUnit unit;
    unit.run = run;
    unit.job = job;
    unit.pixel_samples = samples_of(film, lent.slices);
    unit.slices = std::move(lent.slices);
    unit.expected_seconds = lent.expected_seconds;
    const core::MutexLock lock(mutex_);
    table_.add(job->id() + "." + run_name_ + "." + std::to_string(++last_unit_), std::move(unit),
               Clock::now());
    return true;
  }
  return false;
}

/// Publishes names again whose messages are lost: the stream then has fewer messages than units are
/// published or leased.
void WorkBoard::find_lost_messages() {
  std::optional<std::uint64_t> expected;
  {
    const core::MutexLock lock(mutex_);
    expected = table_.messages_expected(Clock::now());
  }
  if (!expected) {
    return;
  }
  const auto messages = publisher_->messages();
  if (!messages) {
    note_queue_fault(messages.error());
    return;
  }
  const core::MutexLock lock(mutex_);
  table_.note_messages(*messages < *expected, Clock::now());
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
    names = table_.take_to_publish(Clock::now());
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
    workers = table_.take_to_report();
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
  const auto silence = std::chrono::duration_cast<std::chrono::milliseconds>(options_.lease_time());
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
  table_.forget_messages();
  return true;
}

}  // namespace server
