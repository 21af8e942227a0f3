#include "server/workers/lease_table.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "api/json/error_codes.h"
#include "core/accel/arithmetic.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Seconds = std::chrono::duration<double>;

/// How long a result waits for another worker's: that worker may be rendering another unit first,
/// and each takes twice kUnitSecondsMost on a worker half as fast as the mean. A stopped or
/// disconnected worker delays no job further.
constexpr Seconds kVerifyWait{4 * kUnitSecondsMost};
/// A unit lost by this many different workers fails its job: it may be what ends them.
constexpr std::size_t kLostMax = 3;
/// Workers are listed for this many leases after their last report: ten minutes at the default
/// lease, so that an operator sees which ones were lost. Nothing else depends on it.
constexpr int kLeasesRemembered = 40;
/// Rest after the first of several failures in a row, and the longest one: a disk that is freed, or
/// a network that returns, is noticed within about a minute.
constexpr std::chrono::seconds kRestFirst{1};
constexpr int kDoublingsMost = 6;

constexpr const char* kSuspended =
    "its result differed from that of the server; restart the worker once its machine has been "
    "checked";

Error not_open(const std::string& unit) {
  return Error{ErrorCode::kNotFound, "no unit \"" + unit + "\" is open", ""};
}

}  // namespace

double LeaseTable::report_seconds() const {
  // A lease outlives lost reports; the page shows the state of workers at most two seconds late.
  return std::min(options_.lease_seconds / 4, 2.0);
}

LeaseTable::Counts LeaseTable::counts() const {
  Counts counts = counts_;
  counts.open = static_cast<int>(units_.size());
  return counts;
}

// Workers.

std::string LeaseTable::why_idle(const Worker& worker, Time now) const {
  if (!worker.unsuitable.empty()) {
    return worker.unsuitable;
  }
  if (suspended_.contains(worker.view.id)) {
    return kSuspended;
  }
  if (now >= worker.rests_until) {
    return "";
  }
  const auto left = std::chrono::ceil<std::chrono::seconds>(worker.rests_until - now);
  return "it rests for " + std::to_string(left.count()) + " s after failing " +
         (worker.failures == 1 ? "a unit" : std::to_string(worker.failures) + " times in a row");
}

bool LeaseTable::works(const Worker& worker, Time now) const {
  return why_idle(worker, now).empty() && !worker.is_draining && is_live(worker, now);
}

int LeaseTable::slots(Time now) const {
  int threads = 0;
  for (const auto& [id, worker] : workers_) {
    threads += works(worker, now) ? worker.view.threads : 0;
  }
  return threads;
}

bool LeaseTable::has_key(const std::string& worker, const std::string& key) const {
  const auto known = workers_.find(worker);
  return known != workers_.end() && known->second.key == key;
}

Status LeaseTable::check_key(const Sender& sender) const {
  return !workers_.contains(sender.worker) || has_key(sender.worker, sender.key)
             ? core::ok_status()
             : Status(Error{ErrorCode::kForbidden, "the worker's id belongs to another key", ""});
}

core::Result<api::WorkerOrders> LeaseTable::report(const Sender& sender,
                                                   const api::WorkerReport& report, Time now,
                                                   double unix_seconds) {
  const std::string& worker = sender.worker;
  api::WorkerOrders orders;
  orders.report_seconds = report_seconds();
  const std::string machine(core::architecture_of(report.arithmetic));
  const std::string own(core::architecture_of(options_.arithmetic));
  if (machine != own) {
    orders.reason = "its processor is " + machine + ", the server's is " + own +
                    "; their arithmetic differs, whatever the build";
  } else if (report.build != options_.build) {
    orders.reason = "its build is " + report.build + ", the server's is " + options_.build;
  } else if (report.arithmetic != options_.arithmetic) {
    orders.reason = "its arithmetic is \"" + report.arithmetic + "\", the server's is \"" +
                    options_.arithmetic + "\"; --isa can pin both to the same instruction set";
  }
  if (workers_.size() >= std::size_t{kWorkersMax} && !workers_.contains(worker)) {
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
  }
  known.seen = now;
  known.is_draining = report.draining;
  known.view.id = worker;
  known.view.build = report.build;
  known.view.arithmetic = report.arithmetic;
  known.view.threads = report.threads;
  known.unsuitable = orders.reason;
  orders.reason = why_idle(known, now);
  known.view.seen_at_unix_seconds = unix_seconds;
  for (const auto& [name, seconds] : report.units) {
    const auto unit = units_.find(name);
    if (unit == units_.end() || !unit->second.has_lease(worker)) {
      orders.dropped.push_back(name);
    } else if (const auto lease = unit->second.lease_of(worker); seconds > lease->progress) {
      lease->progress = seconds;
      lease->until = now + options_.lease_time();
    }
  }
  return orders;
}

std::vector<api::WorkerView> LeaseTable::workers(Time now) const {
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
    view.reason = why_idle(worker, now);
    view.last_fault = now < worker.rests_until ? worker.last_fault : "";
    view.state = !is_live(worker, now)        ? has_left ? "left" : "lost"
                 : !worker.unsuitable.empty() ? "unsuitable"
                 : !view.reason.empty()       ? "suspended"
                 : worker.is_draining         ? "draining"
                 : view.leases > 0            ? "working"
                                              : "idle";
    views.push_back(std::move(view));
  }
  return views;
}

// Leases and results.

void LeaseTable::add(const std::string& name, WorkUnit unit, Time now) {
  const auto live = std::count_if(workers_.begin(), workers_.end(),
                                  [&](const auto& each) { return works(each.second, now); });
  unit.is_checked = std::bernoulli_distribution(options_.verify_share)(chance_);
  unit.copies = unit.is_checked && live > 1 ? 2 : 1;
  units_.emplace(name, std::move(unit));
}

bool LeaseTable::has_part_in(const WorkUnit& unit, const Sender& sender, Time now) const {
  const bool has_other_keys =
      unit.is_checked && std::any_of(workers_.begin(), workers_.end(), [&](const auto& each) {
        return works(each.second, now) && each.second.key != sender.key;
      });
  std::vector<std::string> parts;
  for (const WorkUnit::Lease& lease : unit.leases) {
    parts.push_back(lease.worker);
  }
  if (unit.first) {
    parts.push_back(unit.first->worker);
  }
  return std::any_of(parts.begin(), parts.end(), [&](const std::string& worker) {
    return worker == sender.worker || (has_other_keys && has_key(worker, sender.key));
  });
}

core::Result<const WorkUnit*> LeaseTable::lease(const std::string& name, const Sender& sender,
                                                Time now) {
  const std::string& worker = sender.worker;
  if (const Status mine = check_key(sender); !mine) {
    return mine.error();
  }
  const auto found = units_.find(name);
  if (found == units_.end()) {
    return not_open(name);
  }
  const auto known = workers_.find(worker);
  const std::string why_not =
      known == workers_.end() ? "it has not reported" : why_idle(known->second, now);
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
    return works(each.second, now) && !unit.has_failed(each.first);
  });
  if (has_part_in(unit, sender, now) || (has_others && unit.has_failed(worker))) {
    return Error{ErrorCode::kUnavailable, "the unit is meant for another worker", ""};
  }
  unit.leases.push_back({.worker = worker, .since = now, .until = now + options_.lease_time()});
  unit.published = std::max(0, unit.published - 1);
  return &unit;
}

core::Result<const WorkUnit*> LeaseTable::held(const std::string& name,
                                               const Sender& sender) const {
  if (Status mine = check_key(sender); !mine) {
    return mine.error();
  }
  const auto unit = units_.find(name);
  if (unit == units_.end()) {
    return not_open(name);
  }
  if (!unit->second.has_lease(sender.worker)) {
    return Error{ErrorCode::kConflict, "the worker does not hold the unit", ""};
  }
  return &unit->second;
}

core::Result<const WorkUnit*> LeaseTable::begin_result(const std::string& name,
                                                       const Sender& sender) {
  if (const auto leased = held(name, sender); !leased) {
    return leased.error();
  }
  WorkUnit& unit = units_.at(name);
  if (unit.is_busy) {
    return Error{ErrorCode::kUnavailable, "another result of the unit is being taken", ""};
  }
  unit.is_busy = true;
  return &unit;
}

void LeaseTable::cancel(const std::string& name) {
  if (const auto found = units_.find(name); found != units_.end()) {
    found->second.is_busy = false;
  }
}

void LeaseTable::refuse_result(const std::string& name, const std::string& worker,
                               const std::string& reason, Time now) {
  if (const auto found = units_.find(name); found != units_.end()) {
    ++counts_.refused;
    found->second.is_busy = false;
    fail_unit(*found, worker, Fault::kRefused, reason, now);
  }
}

core::Result<LeaseTable::Taken> LeaseTable::take_result(const std::string& name,
                                                        const std::string& worker, Work work,
                                                        std::size_t bytes, Time now) {
  const auto found = units_.find(name);
  if (found == units_.end()) {
    return not_open(name);
  }
  WorkUnit& unit = found->second;
  unit.is_busy = false;
  if (!unit.has_lease(worker)) {  // It was suspended meanwhile.
    return Error{ErrorCode::kConflict, "the worker does not hold the unit any more", ""};
  }
  note_result(unit, worker, bytes, now);
  unit.drop_lease(worker);
  if (!unit.is_checked) {
    unit.is_busy = true;
    return Taken{.work = std::move(work)};
  }
  WorkUnit::Result result = {worker, core::content_digest(work), std::move(work), now};
  if (!unit.first) {
    unit.first = std::move(result);
    return Taken{};
  }
  unit.is_busy = true;
  if (unit.first->digest == result.digest) {
    ++counts_.verified;
    return Taken{.work = std::move(result.work)};
  }
  ++counts_.differing;
  log_.write(LogLevel::kError, "results_differ",
             {{"unit", name}, {"worker", unit.first->worker}, {"other_worker", worker}});
  unit.other = std::move(result);
  return Taken{.work = std::nullopt, .is_disputed = true};
}

void LeaseTable::note_result(WorkUnit& unit, const std::string& name, std::size_t bytes, Time now) {
  const auto lease = unit.lease_of(name);
  if (lease == unit.leases.end()) {
    return;
  }
  Worker& worker = workers_[name];
  const double seconds = Seconds(now - lease->since).count();
  worker.samples += unit.pixel_samples;
  worker.seconds += std::max(seconds, 1e-3);
  // A worker renders its units concurrently.
  worker.view.rate = worker.samples / worker.seconds * worker.view.threads;
  ++worker.view.units;
  if (now >= worker.rests_until) {
    worker.failures = 0;
  }
  log_.write(LogLevel::kDebug, "unit_rendered",
             {{"worker", name},
              {"seconds", seconds},
              {"expected_cpu_seconds", unit.expected_seconds},
              {"bytes", static_cast<std::int64_t>(bytes)}});
}

Status LeaseTable::hand_back(const std::string& name, const Sender& sender,
                             const std::string& fault, Time now) {
  if (const auto leased = held(name, sender); !leased) {
    return leased.error();
  }
  Units::value_type& unit = *units_.find(name);
  if (fault.empty()) {
    unit.second.drop_lease(sender.worker);
  } else {
    fail_unit(unit, sender.worker, Fault::kRefused, fault, now);
  }
  return core::ok_status();
}

void LeaseTable::close(const std::string& name) {
  if (const auto found = units_.find(name); found != units_.end()) {
    ++counts_.taken;
    for (const WorkUnit::Lease& lease : found->second.leases) {
      to_report_.insert(lease.worker);
    }
    units_.erase(found);
  }
}

// Faults of workers, and disputes about their results.

void LeaseTable::fail_unit(Units::value_type& entry, const std::string& name, Fault fault,
                           const std::string& reason, Time now) {
  auto& [unit_name, unit] = entry;
  Worker& worker = workers_[name];
  ++worker.view.faults;
  worker.last_fault = reason;
  if (now >= worker.rests_until) {  // Concurrent units that fail for the same reason count once.
    worker.rests_until = now + kRestFirst * (1 << std::min(worker.failures, kDoublingsMost));
    ++worker.failures;
  }
  log_.write(LogLevel::kWarning, "unit_lost",
             {{"unit", unit_name}, {"worker", name}, {"detail", reason}});
  (fault == Fault::kLost ? unit.lost : unit.refused).insert(name);
  unit.drop_lease(name);
}

bool LeaseTable::has_hope(const WorkUnit& unit, Time now) const {
  bool is_someone_resting = false;
  for (const auto& [name, worker] : workers_) {
    if (works(worker, now) && !unit.has_failed(name)) {
      return true;
    }
    is_someone_resting = is_someone_resting || (is_live(worker, now) && worker.unsuitable.empty() &&
                                                !worker.is_draining && !works(worker, now));
  }
  return unit.is_busy || !unit.leases.empty() || unit.first ||
         (unit.refused.empty() && !is_someone_resting);
}

std::vector<std::string> LeaseTable::hopeless(Time now) const {
  std::vector<std::string> names;
  for (const auto& [name, unit] : units_) {
    if (!has_hope(unit, now) || waits_for_nobody(unit, now)) {
      names.push_back(name);
    }
  }
  return names;
}

bool LeaseTable::waits_for_nobody(const WorkUnit& unit, Time now) const {
  if (!unit.first || unit.is_busy) {
    return false;
  }
  const bool has_other = std::any_of(workers_.begin(), workers_.end(), [&](const auto& each) {
    return each.first != unit.first->worker && works(each.second, now);
  });
  return now - unit.first->at > kVerifyWait || (unit.leases.empty() && !has_other);
}

void LeaseTable::begin_own(const std::string& name) {
  units_.at(name).is_busy = true;
  ++counts_.own;
}

std::vector<std::string> LeaseTable::judge(const std::string& name, const std::string& digest) {
  std::vector<std::string> suspended;
  const auto found = units_.find(name);
  if (found == units_.end()) {
    return suspended;
  }
  const WorkUnit& unit = found->second;
  if (unit.first && !unit.other) {
    ++(unit.first->digest == digest ? counts_.verified : counts_.differing);
  }
  for (const auto* result : {&unit.first, &unit.other}) {
    if (*result && (*result)->digest != digest) {
      const std::string worker = (*result)->worker;
      log_.write(LogLevel::kError, "results_differ",
                 {{"unit", name}, {"worker", worker}, {"other_worker", "the server"}});
      if (suspend(worker)) {
        suspended.push_back(worker);
      }
    }
  }
  return suspended;
}

bool LeaseTable::suspend(const std::string& name) {
  if (!suspended_.insert(name).second) {
    return false;
  }
  if (const auto worker = workers_.find(name); worker != workers_.end()) {
    ++worker->second.view.faults;
  }
  ++counts_.suspended;
  log_.write(LogLevel::kError, "worker_suspended", {{"worker", name}, {"detail", kSuspended}});
  for (auto& [unit_name, unit] : units_) {
    unit.drop_lease(name);
    if (unit.first && unit.first->worker == name && !unit.is_busy) {
      unit.first.reset();
    }
  }
  to_report_.insert(name);
  return true;
}

// What passes with time, and planning.

std::vector<const WorkUnit*> LeaseTable::expire(Time now) {
  std::vector<const WorkUnit*> fatal;
  for (auto& entry : units_) {
    WorkUnit& unit = entry.second;
    for (const WorkUnit::Lease& lease : std::vector(unit.leases)) {
      if (!unit.is_busy && now > lease.until) {
        ++counts_.expired;
        fail_unit(entry, lease.worker, Fault::kLost, "it did not report in time", now);
      }
    }
    if (unit.lost.size() >= kLostMax) {
      fatal.push_back(&unit);
    }
  }
  std::erase_if(workers_, [&](const auto& each) {
    return now - each.second.seen > kLeasesRemembered * options_.lease_time();
  });
  return fatal;
}

LeaseTable::Units LeaseTable::remove_if(const std::function<bool(const WorkUnit&)>& is_unneeded) {
  Units removed;
  for (auto unit = units_.begin(); unit != units_.end();) {
    const auto next = std::next(unit);
    const bool is_going = is_unneeded(unit->second);
    if (is_going && unit->second.is_busy) {
      unit->second.own.request_stop();
    } else if (is_going) {
      for (const WorkUnit::Lease& lease : unit->second.leases) {
        to_report_.insert(lease.worker);
      }
      removed.insert(units_.extract(unit));
    }
    unit = next;
  }
  return removed;
}

int LeaseTable::wanted() const {
  int wanted = 0;
  for (const auto& [name, unit] : units_) {
    wanted += std::max(0, unit.wanted());
  }
  return wanted;
}

void LeaseTable::double_last_units(Time now) {
  std::map<std::string, int> held;
  std::vector<WorkUnit*> late;
  for (auto& [name, unit] : units_) {
    for (const WorkUnit::Lease& lease : unit.leases) {
      ++held[lease.worker];
    }
    if (unit.copies == 1 && unit.leases.size() == 1 && !unit.is_busy &&
        Seconds(now - unit.leases.front().since).count() > unit.expected_seconds) {
      late.push_back(&unit);
    }
  }
  std::sort(late.begin(), late.end(), [](const WorkUnit* a, const WorkUnit* b) {
    return a->leases.front().since < b->leases.front().since;
  });
  for (WorkUnit* unit : late) {
    const auto helper = std::find_if(workers_.begin(), workers_.end(), [&](const auto& each) {
      return works(each.second, now) && each.first != unit->leases.front().worker &&
             held[each.first] < each.second.view.threads;
    });
    if (helper != workers_.end()) {
      ++held[helper->first];
      unit->copies = 2;
      ++counts_.doubled;
    }
  }
}

// Messages of the broker.

std::vector<std::string> LeaseTable::take_to_publish(Time now) {
  std::vector<std::string> names;
  for (auto& [name, unit] : units_) {
    for (; unit.published < unit.wanted(); ++unit.published) {
      names.push_back(name);
      unit.published_at = now;
    }
  }
  return names;
}

void LeaseTable::forget_messages() {
  for (auto& [name, unit] : units_) {
    unit.published = 0;
  }
}

bool LeaseTable::is_late(const WorkUnit& unit, Time now) const {
  return unit.published > 0 && now - unit.published_at > 2 * options_.lease_time();
}

std::optional<std::uint64_t> LeaseTable::messages_expected(Time now) const {
  // A worker keeps the message of a unit until it is done with it.
  std::uint64_t expected = 0;
  bool is_any_late = false;
  for (const auto& [name, unit] : units_) {
    expected += static_cast<std::uint64_t>(unit.published) + unit.leases.size();
    is_any_late = is_any_late || is_late(unit, now);
  }
  return is_any_late ? std::optional(expected) : std::nullopt;
}

void LeaseTable::note_messages(bool is_any_missing, Time now) {
  for (auto& [name, unit] : units_) {
    if (is_late(unit, now)) {
      unit.published = is_any_missing ? 0 : unit.published;
      unit.published_at = now;
    }
  }
}

}  // namespace server
