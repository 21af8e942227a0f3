// Requests and results of workers.
#include "server/jobs/work_board.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "api/json/error_codes.h"
#include "core/render/units/result_size.h"
#include "server/observe/clock.h"
#include "server/store/uuid.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::SliceWork;
using core::Status;

namespace {

/// Reports of this many workers keep six tenths of a core busy: a report takes 0.12 ms of the
/// coordinator (tests/bench/farm replay --record) and comes every two seconds.
constexpr std::size_t kWorkersMax = 10'000;

Error not_open(const std::string& unit) {
  return Error{ErrorCode::kNotFound, "no unit \"" + unit + "\" is open", ""};
}

double seconds_between(std::chrono::steady_clock::time_point from,
                       std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

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

WorkBoard::WorkBoard(std::unique_ptr<queue::UnitPublisher> publisher, Scheduler& scheduler,
                     Log& log, WorkOptions options, Calls calls)
    : publisher_(std::move(publisher)),
      scheduler_(scheduler),
      log_(log),
      options_(std::move(options)),
      calls_(std::move(calls)),
      run_name_(make_uuid().substr(0, 8)),
      own_(1, 1, Background::Priority::kOfRendering),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void WorkBoard::stop() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  {
    const core::MutexLock lock(mutex_);
    for (auto& [name, unit] : units_) {
      unit.own.request_stop();
    }
  }
  own_.stop(Background::Waiting::kDrop);
  Units left;
  const core::MutexLock lock(mutex_);
  left.swap(units_);
}

WorkBoard::Clock::duration WorkBoard::lease_time() const {
  return std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(options_.lease_seconds));
}

double WorkBoard::report_seconds() const {
  // A lease outlives lost reports; the page shows the state of workers at most two seconds late.
  return std::min(options_.lease_seconds / 4, 2.0);
}

bool WorkBoard::is_live(const Worker& worker) const {
  return Clock::now() - worker.seen < lease_time();
}

bool WorkBoard::works(const Worker& worker) const {
  return why_idle(worker).empty() && !worker.is_draining && is_live(worker);
}

int WorkBoard::slots() const {
  int threads = 0;
  for (const auto& [id, worker] : workers_) {
    threads += works(worker) ? worker.view.threads : 0;
  }
  return threads;
}

std::map<std::string, int> WorkBoard::leases() const {
  std::map<std::string, int> counts;
  for (const auto& [name, unit] : units_) {
    for (const WorkUnit::Lease& lease : unit.leases) {
      ++counts[lease.worker];
    }
  }
  return counts;
}

WorkBoard::Units::node_type WorkBoard::remove(Units::const_iterator unit) {
  for (const WorkUnit::Lease& lease : unit->second.leases) {
    to_report_.insert(lease.worker);
  }
  return units_.extract(unit);
}

void WorkBoard::tell() {
  is_news_ = true;
  changed_.notify_all();
}

core::Result<api::WorkerOrders> WorkBoard::report(const Sender& sender,
                                                  const api::WorkerReport& report) {
  const std::string& worker = sender.worker;
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
    // Not a sum of strings: GCC 12 would warn of a copy out of bounds.
    std::ostringstream message;
    message << kWorkersMax << " workers have reported; no more are accepted";
    return Error{api::kTooManyRequests, message.str(), ""};
  }
  if (const Status mine = check_key(sender); !mine) {
    return mine.error();
  }
  const auto [found, is_new] = workers_.try_emplace(worker);
  Worker& known = found->second;
  known.key = sender.key;
  if (is_new) {
    log_.write(orders.reason.empty() ? LogLevel::kInfo : LogLevel::kWarning, "worker_joined",
               {{"worker", worker}, {"unsuitable", orders.reason}});
    tell();
  }
  known.seen = Clock::now();
  known.is_draining = report.draining;
  known.view.id = worker;
  known.view.build = report.build;
  known.view.arithmetic = report.arithmetic;
  known.view.threads = report.threads;
  known.unsuitable = orders.reason;
  orders.reason = why_idle(known);
  known.view.seen_at_unix_seconds = unix_now();
  for (const auto& [name, seconds] : report.units) {
    const auto unit = units_.find(name);
    if (unit == units_.end() || !unit->second.has_lease(worker)) {
      orders.dropped.push_back(name);
    } else if (const auto lease = unit->second.lease_of(worker); seconds > lease->progress) {
      lease->progress = seconds;
      lease->until = Clock::now() + lease_time();
    }
  }
  return orders;
}

Status WorkBoard::check_key(const Sender& sender) const {
  const auto known = workers_.find(sender.worker);
  return known == workers_.end() || known->second.key == sender.key
             ? core::ok_status()
             : Status(Error{ErrorCode::kForbidden, "the worker's id belongs to another key", ""});
}

bool WorkBoard::has_part_in(const WorkUnit& unit, const Sender& sender) const {
  const bool has_other_keys =
      unit.is_checked && std::any_of(workers_.begin(), workers_.end(), [&](const auto& each) {
        return works(each.second) && each.second.key != sender.key;
      });
  std::vector<std::string> parts;
  for (const WorkUnit::Lease& lease : unit.leases) {
    parts.push_back(lease.worker);
  }
  if (unit.first) {
    parts.push_back(unit.first->worker);
  }
  for (const std::string& worker : parts) {
    const auto known = workers_.find(worker);
    if (worker == sender.worker ||
        (has_other_keys && known != workers_.end() && known->second.key == sender.key)) {
      return true;
    }
  }
  return false;
}

core::Result<std::string> WorkBoard::lease(const std::string& name, const Sender& sender) {
  const std::string& worker = sender.worker;
  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  {
    const core::MutexLock lock(mutex_);
    if (const Status mine = check_key(sender); !mine) {
      return mine.error();
    }
    const auto found = units_.find(name);
    if (found == units_.end()) {
      return not_open(name);
    }
    const auto known = workers_.find(worker);
    const std::string why_not =
        known == workers_.end() ? "it has not reported" : why_idle(known->second);
    if (!why_not.empty()) {
      return Error{ErrorCode::kUnavailable, "the worker gets no units: " + why_not, ""};
    }
    WorkUnit& unit = found->second;
    if (unit.is_busy) {  // A result may still be requested from another worker.
      return Error{ErrorCode::kUnavailable, "a result of the unit is being taken", ""};
    }
    if (unit.wanted() < 1) {
      return Error{ErrorCode::kConflict, "another worker holds the unit", ""};
    }
    const bool has_others = std::any_of(workers_.begin(), workers_.end(), [&](const auto& each) {
      return works(each.second) && !unit.has_failed(each.first);
    });
    if (has_part_in(unit, sender) || (has_others && unit.has_failed(worker))) {
      return Error{ErrorCode::kUnavailable, "the unit is meant for another worker", ""};
    }
    const auto now = Clock::now();
    unit.leases.push_back({.worker = worker, .since = now, .until = now + lease_time()});
    unit.published = std::max(0, unit.published - 1);
    run = unit.run;
    slices = unit.slices;
    tell();
  }
  core::WorkWriter writer(core::WorkPart::kInput, slices.size());
  for (const core::Slice& slice : slices) {
    writer.add(run->prepare(slice));
  }
  return writer.finish();
}

core::Result<std::vector<SliceWork>> WorkBoard::read_result(const RenderRun& run,
                                                            const std::vector<core::Slice>& slices,
                                                            std::string_view result) const {
  auto work = core::decode_work(result, core::WorkPart::kResult);
  if (!work) {
    return work;
  }
  const auto checked = core::check_result(
      slices.size(), [&](std::size_t i) { return run.prepare(slices[i]); },
      run.task().renderer().view().settings, *work);
  return checked ? std::move(work) : core::Result<std::vector<SliceWork>>(checked.error());
}

Status WorkBoard::check_lease(const std::string& name, const Sender& sender) const {
  if (Status mine = check_key(sender); !mine) {
    return mine;
  }
  const auto unit = units_.find(name);
  if (unit == units_.end()) {
    return not_open(name);
  }
  return unit->second.has_lease(sender.worker)
             ? core::ok_status()
             : Status(Error{ErrorCode::kConflict, "the worker does not hold the unit", ""});
}

core::Result<std::uint64_t> WorkBoard::result_bytes_max(const std::string& name,
                                                        const Sender& sender) const {
  const core::MutexLock lock(mutex_);
  if (const Status leased = check_lease(name, sender); !leased) {
    return leased.error();
  }
  const WorkUnit& unit = units_.at(name);
  return core::result_bytes_max(*unit.run->film(), unit.slices.size());
}

Status WorkBoard::take(const std::string& name, const Sender& sender, std::string_view result) {
  const std::string& worker = sender.worker;
  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  {
    const core::MutexLock lock(mutex_);
    if (Status leased = check_lease(name, sender); !leased) {
      return leased;
    }
    WorkUnit& unit = units_.at(name);
    if (unit.is_busy) {
      return Error{ErrorCode::kUnavailable, "another result of the unit is being taken", ""};
    }
    unit.is_busy = true;
    run = unit.run;
    slices = unit.slices;
  }
  const auto work_or_throw = [&] {
    try {
      return read_result(*run, slices, result);
    } catch (...) {  // No memory: the unit stays with its worker, which sends the result again.
      const core::MutexLock lock(mutex_);
      if (const auto found = units_.find(name); found != units_.end()) {
        found->second.is_busy = false;
      }
      throw;
    }
  };
  auto work = work_or_throw();
  std::optional<std::vector<SliceWork>> settled;
  {
    const core::MutexLock lock(mutex_);
    const auto found = units_.find(name);
    if (found == units_.end()) {  // Only stop() removes a busy unit.
      return not_open(name);
    }
    Units::value_type& unit = *found;
    if (!work) {
      ++counts_.refused;
      unit.second.is_busy = false;
      fail_unit(unit, worker, Fault::kRefused, work.error().message);
      return work.error();
    }
    note_result(unit.second, worker, result.size());
    unit.second.is_busy = false;
    settled = settle(unit, worker, *std::move(work));
    unit.second.is_busy = unit.second.is_busy || settled.has_value();
  }
  if (settled) {
    run->accept(*std::move(settled));
  }
  const core::MutexLock lock(mutex_);
  if (settled) {
    ++counts_.taken;
    remove(units_.find(name));
  }
  tell();
  return core::ok_status();
}

std::optional<std::vector<SliceWork>> WorkBoard::settle(Units::value_type& entry,
                                                        const std::string& worker,
                                                        std::vector<SliceWork> work) {
  auto& [name, unit] = entry;
  if (const auto lease = unit.lease_of(worker); lease != unit.leases.end()) {
    unit.leases.erase(lease);
  }
  if (!unit.is_checked) {
    note_unverified(worker, *unit.run);
    return work;
  }
  WorkUnit::Result result = {worker, core::content_digest(work), std::move(work), Clock::now()};
  if (!unit.first) {
    unit.first = std::move(result);
    return std::nullopt;
  }
  if (unit.first->digest == result.digest) {
    ++counts_.verified;
    return std::move(result.work);
  }
  ++counts_.differing;
  log_.write(LogLevel::kError, "results_differ",
             {{"unit", name}, {"worker", unit.first->worker}, {"other_worker", worker}});
  unit.other = std::move(result);
  render_here(entry);
  return std::nullopt;
}

void WorkBoard::note_result(WorkUnit& unit, const std::string& name, std::size_t bytes) {
  const auto lease = unit.lease_of(name);
  if (lease == unit.leases.end()) {
    return;
  }
  Worker& worker = workers_[name];
  const double seconds = seconds_between(lease->since, Clock::now());
  worker.samples += samples_of(*unit.run->film(), unit.slices);
  worker.seconds += std::max(seconds, 1e-3);
  // A worker renders its units concurrently.
  worker.view.rate = worker.samples / worker.seconds * worker.view.threads;
  ++worker.view.units;
  if (Clock::now() >= worker.rests_until) {
    worker.failures = 0;
  }
  log_.write(LogLevel::kDebug, "unit_rendered",
             {{"worker", name},
              {"seconds", seconds},
              {"expected_cpu_seconds", unit.expected_seconds},
              {"bytes", static_cast<std::int64_t>(bytes)}});
}

Status WorkBoard::hand_back(const std::string& name, const Sender& sender,
                            const std::string& fault) {
  const std::string& worker = sender.worker;
  const core::MutexLock lock(mutex_);
  if (Status leased = check_lease(name, sender); !leased) {
    return leased;
  }
  const auto found = units_.find(name);
  if (fault.empty()) {
    WorkUnit& unit = found->second;
    unit.leases.erase(unit.lease_of(worker));
  } else {
    fail_unit(*found, worker, Fault::kRefused, fault);
  }
  tell();
  return core::ok_status();
}

JobPointer WorkBoard::job_of_lease(const std::string& id, const std::string& key) const {
  const core::MutexLock lock(mutex_);
  for (const auto& [name, unit] : units_) {
    const JobPointer job = unit.run->job();
    for (const WorkUnit::Lease& lease : unit.leases) {
      const auto worker = workers_.find(lease.worker);
      if (job && job->id() == id && worker != workers_.end() && worker->second.key == key) {
        return job;
      }
    }
  }
  return nullptr;
}

std::vector<api::WorkerTile> WorkBoard::tiles_of(const Job& job) const {
  std::vector<api::WorkerTile> tiles;
  const core::MutexLock lock(mutex_);
  for (const auto& [name, unit] : units_) {
    if (unit.run->job().get() != &job) {
      continue;
    }
    const core::Film& film = *unit.run->film();
    for (const core::Slice& slice : unit.slices) {
      for (const WorkUnit::Lease& lease : unit.leases) {
        if (slice.tile < film.tile_count()) {
          tiles.push_back({lease.worker, film.tile_rect(slice.tile)});
        }
      }
    }
  }
  return tiles;
}

std::vector<api::WorkerView> WorkBoard::workers() const {
  const core::MutexLock lock(mutex_);
  std::map<std::string, std::vector<std::string>> held;
  for (const auto& [name, unit] : units_) {
    for (const WorkUnit::Lease& lease : unit.leases) {
      held[lease.worker].push_back(name);
    }
  }
  std::vector<api::WorkerView> views;
  for (const auto& [id, worker] : workers_) {
    api::WorkerView view = worker.view;
    view.held = std::move(held[id]);
    view.leases = static_cast<int>(view.held.size());
    const bool has_left = worker.is_draining && view.leases == 0;
    view.reason = why_idle(worker);
    view.state = !is_live(worker)             ? has_left ? "left" : "lost"
                 : !worker.unsuitable.empty() ? "unsuitable"
                 : !view.reason.empty()       ? "suspended"
                 : worker.is_draining         ? "draining"
                 : view.leases > 0            ? "working"
                                              : "idle";
    views.push_back(std::move(view));
  }
  return views;
}

WorkBoard::Counts WorkBoard::counts() const {
  const core::MutexLock lock(mutex_);
  Counts counts = counts_;
  counts.open = static_cast<int>(units_.size());
  counts.has_broker = has_broker_;
  return counts;
}

}  // namespace server
