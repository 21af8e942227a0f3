#include "server/jobs/work_board.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/render/slice_work.h"
#include "server/observe/clock.h"
#include "server/store/uuid.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// CPU time of a unit: some hundred milliseconds are long against a request, and short against the
/// pass at whose end the last unit is waited for.
constexpr double kUnitSeconds = 0.5;
constexpr int kSlicesMax = 32;
/// Units of a pass for each thread of a worker, at least: the last ones end at about the same time.
constexpr int kUnitsOfThread = 4;
constexpr std::size_t kLostMax = 3;
/// The page and `GET /v1/workers` show what workers do as of then.
constexpr double kReportSecondsMax = 2;
/// Reports that may get lost before the broker gives a unit to the next worker, which asks here.
constexpr double kReportsOfSilence = 3;
constexpr std::chrono::milliseconds kBusyPause{20};
constexpr std::chrono::milliseconds kIdlePause{250};
constexpr std::chrono::milliseconds kAskBrokerAgain{500};
constexpr std::chrono::minutes kForgetWorker{10};
constexpr std::size_t kWorkersMax = 10'000;
constexpr std::size_t kDoneMax = 4096;
/// Weight of the newest unit in a worker's rate.
constexpr double kRateShare = 0.2;

Error not_open(const std::string& unit) {
  return Error{ErrorCode::kNotFound, "no unit \"" + unit + "\" is open", ""};
}

/// Pixel samples of the slices.
double samples_of(const core::Film& film, const std::vector<core::Slice>& slices) {
  double samples = 0;
  for (const core::Slice& slice : slices) {
    const core::PixelRect rect = film.tile_rect(slice.tile);
    samples +=
        static_cast<double>(rect.width) * rect.height * (slice.last_sample - slice.first_sample);
  }
  return samples;
}

}  // namespace

WorkBoard::WorkBoard(std::unique_ptr<queue::UnitPublisher> publisher, Scheduler& scheduler,
                     Log& log, WorkOptions options)
    : publisher_(std::move(publisher)),
      scheduler_(scheduler),
      log_(log),
      options_(std::move(options)),
      run_name_(make_uuid().substr(0, 8)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void WorkBoard::stop() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  Units left;
  const core::MutexLock lock(mutex_);
  left.swap(units_);
}

WorkBoard::Clock::duration WorkBoard::lease_time() const {
  return std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(options_.lease_seconds));
}

double WorkBoard::report_seconds() const {
  constexpr double kReportsInLease = 4;
  return std::min(options_.lease_seconds / kReportsInLease, kReportSecondsMax);
}

bool WorkBoard::is_live(const Worker& worker) const {
  return Clock::now() - worker.seen < lease_time();
}

int WorkBoard::slots() const {
  int threads = 0;
  for (const auto& [id, worker] : workers_) {
    const bool works = worker.view.reason.empty() && !worker.is_draining && is_live(worker);
    threads += works ? worker.view.threads : 0;
  }
  return threads;
}

core::Result<api::WorkerOrders> WorkBoard::report(const std::string& worker,
                                                  const api::WorkerReport& report) {
  api::WorkerOrders orders;
  orders.report_seconds = report_seconds();
  if (report.build != options_.build) {
    orders.reason = "its build is " + report.build + ", the server's is " + options_.build;
  } else if (report.arithmetic != options_.arithmetic) {
    orders.reason = "its arithmetic is \"" + report.arithmetic + "\", the server's is \"" +
                    options_.arithmetic + "\"; --isa can pin both to the same instruction set";
  }
  const core::MutexLock lock(mutex_);
  if (workers_.size() >= kWorkersMax && !workers_.contains(worker)) {
    return Error{ErrorCode::kTooManyRequests,
                 std::to_string(kWorkersMax) + " workers are known; no more are let in", ""};
  }
  const auto [found, is_new] = workers_.try_emplace(worker);
  Worker& known = found->second;
  if (is_new) {
    log_.write(orders.reason.empty() ? LogLevel::kInfo : LogLevel::kWarning, "worker_joined",
               {{"worker", worker}, {"unsuitable", orders.reason}});
  }
  known.seen = Clock::now();
  known.is_draining = report.draining;
  known.view.id = worker;
  known.view.build = report.build;
  known.view.arithmetic = report.arithmetic;
  known.view.threads = report.threads;
  known.view.reason = orders.reason;
  known.view.seen_at_unix_seconds = unix_now();
  for (const auto& [name, seconds] : report.units) {
    const auto unit = units_.find(name);
    if (unit == units_.end() || unit->second.worker != worker) {
      orders.dropped.push_back(name);
    } else if (seconds > unit->second.progress) {
      unit->second.progress = seconds;
      unit->second.until = Clock::now() + lease_time();
    }
  }
  is_news_ = is_news_ || is_new;
  changed_.notify_all();
  return orders;
}

core::Result<std::string> WorkBoard::lease(const std::string& name, const std::string& worker) {
  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  {
    const core::MutexLock lock(mutex_);
    const auto unit = units_.find(name);
    if (unit == units_.end()) {
      return not_open(name);
    }
    const auto known = workers_.find(worker);
    if (known == workers_.end() || !known->second.view.reason.empty()) {
      return Error{ErrorCode::kUnavailable, "the worker has not reported, or is not suitable", ""};
    }
    Unit& taken = unit->second;
    if (taken.is_busy || (!taken.worker.empty() && taken.worker != worker)) {
      return Error{ErrorCode::kConflict, "another worker has the unit", ""};
    }
    taken.worker = worker;
    taken.since = Clock::now();
    taken.until = taken.since + lease_time();
    taken.progress = 0;
    run = taken.run;
    slices = taken.slices;
    is_news_ = true;
    changed_.notify_all();
  }
  std::vector<core::SliceWork> work;
  for (const core::Slice& slice : slices) {
    work.push_back(run->prepare(slice));
  }
  return core::encode_work(work, core::WorkPart::kInput);
}

Status WorkBoard::take(const std::string& name, const std::string& worker,
                       std::string_view result) {
  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  {
    const core::MutexLock lock(mutex_);
    const auto unit = units_.find(name);
    if (unit == units_.end()) {
      // The answer to the first time may have been lost.
      const bool is_done = std::find(done_.begin(), done_.end(), name + worker) != done_.end();
      return is_done ? core::ok_status() : Status(not_open(name));
    }
    if (unit->second.worker != worker || unit->second.is_busy) {
      return Error{ErrorCode::kConflict, "the worker does not have the unit", ""};
    }
    unit->second.is_busy = true;
    run = unit->second.run;
    slices = unit->second.slices;
  }
  auto done = core::decode_work(result);
  Status checked = done ? core::ok_status() : Status(done.error());
  if (checked && done->size() != slices.size()) {
    checked = Error{ErrorCode::kInvalidArgument, "the result has another number of slices", ""};
  }
  const core::RenderSettings& settings = run->task().renderer().view().settings;
  for (std::size_t i = 0; checked && i < slices.size(); ++i) {
    checked = core::check_result(run->prepare(slices[i]), settings, (*done)[i]);
  }
  if (!checked) {
    const core::MutexLock lock(mutex_);
    ++refused_;
    if (const auto unit = units_.find(name); unit != units_.end()) {
      unit->second.is_busy = false;
      lose(*unit, checked.error().message);
    }
    return checked;
  }
  for (core::SliceWork& each : *done) {
    run->accept(std::move(each));
  }
  const core::MutexLock lock(mutex_);
  ++taken_;
  done_.push_back(name + worker);
  if (done_.size() > kDoneMax) {
    done_.pop_front();
  }
  if (const auto unit = units_.find(name); unit != units_.end()) {
    api::WorkerView& view = workers_[worker].view;
    const double seconds = std::chrono::duration<double>(Clock::now() - unit->second.since).count();
    // Units of a worker run side by side.
    const double rate = samples_of(*run->film(), slices) / std::max(seconds, 1e-3) * view.threads;
    view.rate = view.units == 0 ? rate : view.rate + kRateShare * (rate - view.rate);
    ++view.units;
    units_.erase(unit);
  }
  is_news_ = true;
  changed_.notify_all();
  return core::ok_status();
}

Status WorkBoard::hand_back(const std::string& name, const std::string& worker,
                            const std::string& fault) {
  const core::MutexLock lock(mutex_);
  const auto unit = units_.find(name);
  if (unit == units_.end()) {
    return not_open(name);
  }
  if (unit->second.worker != worker || unit->second.is_busy) {
    return Error{ErrorCode::kConflict, "the worker does not have the unit", ""};
  }
  if (fault.empty()) {
    unit->second.worker.clear();
    unit->second.is_published = false;
  } else {
    lose(*unit, fault);
  }
  is_news_ = true;
  changed_.notify_all();
  return core::ok_status();
}

void WorkBoard::lose(Units::value_type& entry, const std::string& reason) {
  auto& [name, unit] = entry;
  ++workers_[unit.worker].view.faults;
  log_.write(LogLevel::kWarning, "unit_lost",
             {{"unit", name}, {"worker", unit.worker}, {"detail", reason}});
  unit.lost.insert(std::exchange(unit.worker, {}));
  unit.is_published = false;
}

JobPointer WorkBoard::job_of_units(const std::string& id) const {
  const core::MutexLock lock(mutex_);
  for (const auto& [name, unit] : units_) {
    const JobPointer job = unit.run->job();
    if (job && job->id() == id) {
      return job;
    }
  }
  return nullptr;
}

std::vector<api::WorkerView> WorkBoard::workers() const {
  const core::MutexLock lock(mutex_);
  std::vector<api::WorkerView> views;
  for (const auto& [id, worker] : workers_) {
    api::WorkerView view = worker.view;
    view.leases = static_cast<int>(std::count_if(
        units_.begin(), units_.end(), [&](const auto& unit) { return unit.second.worker == id; }));
    const bool has_left = worker.is_draining && view.leases == 0;
    view.state = !is_live(worker)       ? has_left ? "left" : "lost"
                 : !view.reason.empty() ? "unsuitable"
                 : worker.is_draining   ? "draining"
                 : view.leases > 0      ? "working"
                                        : "idle";
    views.push_back(std::move(view));
  }
  return views;
}

WorkBoard::Counts WorkBoard::counts() const {
  const core::MutexLock lock(mutex_);
  return {.open = static_cast<int>(units_.size()),
          .taken = taken_,
          .expired = expired_,
          .refused = refused_,
          .has_broker = has_broker_};
}

void WorkBoard::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      const core::MutexLock lock(mutex_);
      const auto pause = units_.empty() && slots() == 0 ? kIdlePause : kBusyPause;
      changed_.wait_for(mutex_, stop, pause, [this]() REQUIRES(mutex_) { return is_news_; });
      is_news_ = false;
    }
    drop_ended();
    expire_leases();
    has_broker_ = prepare_broker();
    if (has_broker_) {
      had_broker_at_ = Clock::now();
      plan();
      publish();
    }
    drop_waiting();
  }
}

/// Units of runs that want no slices any more: a cancelled one ends when all have come back.
void WorkBoard::drop_ended() {
  Units ended;
  {
    const core::MutexLock lock(mutex_);
    for (auto unit = units_.begin(); unit != units_.end();) {
      const auto next = std::next(unit);
      RenderRun& run = *unit->second.run;
      const JobPointer job = run.job();
      if (!unit->second.is_busy &&
          (run.task().is_stopping() || run.end() || !job || job->run().get() != &run)) {
        ended.insert(units_.extract(unit));
      }
      unit = next;
    }
  }
  give_back(ended);
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
      if (unit->second.worker.empty() && !unit->second.is_busy) {
        waiting.insert(units_.extract(unit));
      }
      unit = next;
    }
  }
  give_back(waiting);
}

void WorkBoard::expire_leases() {
  std::vector<std::pair<std::shared_ptr<RenderRun>, std::string>> failed;
  {
    const core::MutexLock lock(mutex_);
    const auto now = Clock::now();
    for (auto& unit : units_) {
      Unit& held = unit.second;
      if (!held.worker.empty() && !held.is_busy && now > held.until) {
        ++expired_;
        lose(unit, "nothing was heard of it in time");
      }
      // A name that the broker has lost with a message is published again.
      if (held.worker.empty() && held.is_published && now - held.since > 2 * lease_time()) {
        held.is_published = false;
      }
      if (held.lost.size() >= kLostMax) {
        std::string names;
        for (const std::string& worker : held.lost) {
          names += " " + worker;
        }
        failed.emplace_back(held.run, "a part of the image was lost with " +
                                          std::to_string(held.lost.size()) +
                                          " workers, one after "
                                          "the other:" +
                                          names);
      }
    }
    std::erase_if(workers_,
                  [&](const auto& each) { return now - each.second.seen > kForgetWorker; });
  }
  for (const auto& [run, reason] : failed) {
    run->fail(Error{ErrorCode::kInternal, reason, ""});
  }
}

/// One unit in the queue for each thread of the workers: then each finds its next one there. One,
/// too, where there are none: what starts workers sees that they are needed.
void WorkBoard::plan() {
  while (true) {
    int wanted = 0;
    {
      const core::MutexLock lock(mutex_);
      wanted = std::max(slots(), options_.has_local_threads ? 0 : 1);
      const auto waiting = std::count_if(units_.begin(), units_.end(), [](const auto& unit) {
        return unit.second.worker.empty();
      });
      if (waiting >= wanted) {
        return;
      }
    }
    bool is_planned = false;
    for (const std::shared_ptr<SliceSource>& source : scheduler_.in_turn()) {
      const auto run = std::dynamic_pointer_cast<RenderRun>(source);
      const JobPointer job = run ? run->job() : nullptr;
      if (!job) {
        continue;
      }
      const int even_share = run->film()->tile_count() / (kUnitsOfThread * wanted);
      const auto most = static_cast<std::size_t>(std::clamp(even_share, 1, kSlicesMax));
      std::vector<core::Slice> slices = run->lend(kUnitSeconds, most);
      if (slices.empty()) {
        continue;
      }
      scheduler_.charge(*source, kUnitSeconds);
      const core::MutexLock lock(mutex_);
      const std::string name = job->id() + "." + run_name_ + "." + std::to_string(++last_unit_);
      Unit& unit = units_[name];
      unit.run = run;
      unit.slices = std::move(slices);
      unit.since = Clock::now();
      is_planned = true;
      break;
    }
    if (!is_planned) {
      return;
    }
  }
}

void WorkBoard::publish() {
  std::vector<std::string> names;
  {
    const core::MutexLock lock(mutex_);
    for (auto& [name, unit] : units_) {
      if (unit.worker.empty() && !unit.is_published) {
        names.push_back(name);
        unit.is_published = true;
        unit.since = Clock::now();
      }
    }
  }
  for (const std::string& name : names) {
    if (const Status published = publisher_->publish(name); !published) {
      log_.write(LogLevel::kWarning, "queue_fault", {{"detail", published.error().message}});
      prepared_.reset();  // All that is open is published once there is a stream again.
      return;
    }
  }
}

/// Makes the stream on each new connection and has all that is open published in it.
bool WorkBoard::prepare_broker() {
  const auto now = Clock::now();
  const std::uint64_t generation = publisher_->link().generation();
  if (prepared_ == generation && publisher_->link().is_connected()) {
    return true;
  }
  if (now - asked_broker_at_ < kAskBrokerAgain) {
    return false;
  }
  asked_broker_at_ = now;
  const auto silence = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::duration<double>(kReportsOfSilence * report_seconds()));
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
    unit.is_published = false;
  }
  return true;
}

}  // namespace server
