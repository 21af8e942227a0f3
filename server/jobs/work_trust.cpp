// Faults of workers, and disputes about their results.
#include <algorithm>
#include <exception>
#include <utility>

#include "core/render/units/unit_renderer.h"
#include "server/jobs/work_board.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::SliceWork;

namespace {

/// Rest after the first of several failures in a row, and the longest one: a disk that is freed, or
/// a network that returns, is noticed within about a minute.
constexpr std::chrono::seconds kRestFirst{1};
constexpr int kDoublingsMost = 6;

/// Renders slices as a worker does. Returns empty if it was stopped. Errors: of the format.
core::Result<std::optional<std::vector<SliceWork>>> render_slices(
    const std::shared_ptr<RenderRun>& run, const std::vector<core::Slice>& slices,
    const std::stop_token& stop) {
  std::vector<SliceWork> work;
  for (const core::Slice& slice : slices) {
    work.push_back(run->prepare(slice));
  }
  // Shares the run's lifetime.
  core::UnitRenderer renderer(std::shared_ptr<const core::Renderer>(run, &run->task().renderer()));
  if (!renderer.render(work, stop)) {
    return std::optional<std::vector<SliceWork>>();
  }
  auto sent =
      core::decode_work(core::encode_work(work, core::WorkPart::kResult), core::WorkPart::kResult);
  return sent ? core::Result<std::optional<std::vector<SliceWork>>>(*std::move(sent))
              : core::Result<std::optional<std::vector<SliceWork>>>(sent.error());
}

}  // namespace

std::string WorkBoard::why_idle(const Worker& worker) const {
  if (!worker.unsuitable.empty() || !worker.suspended.empty()) {
    return worker.unsuitable.empty() ? worker.suspended : worker.unsuitable;
  }
  const auto left =
      std::chrono::duration_cast<std::chrono::seconds>(worker.rests_until - Clock::now());
  if (Clock::now() >= worker.rests_until) {
    return "";
  }
  return "it rests for " + std::to_string(left.count() + 1) + " s after failing " +
         (worker.failures == 1 ? "a unit" : std::to_string(worker.failures) + " times in a row") +
         ": " + worker.last_fault;
}

void WorkBoard::fail_unit(Units::value_type& entry, const std::string& name, Fault fault,
                          const std::string& reason) {
  auto& [unit_name, unit] = entry;
  Worker& worker = workers_[name];
  ++worker.view.faults;
  worker.last_fault = reason;
  if (const auto now = Clock::now(); now >= worker.rests_until) {
    // Concurrent units that fail for the same reason count once.
    worker.rests_until = now + kRestFirst * (1 << std::min(worker.failures, kDoublingsMost));
    ++worker.failures;
  }
  log_.write(LogLevel::kWarning, "unit_lost",
             {{"unit", unit_name}, {"worker", name}, {"detail", reason}});
  (fault == Fault::kLost ? unit.lost : unit.refused).insert(name);
  std::erase_if(unit.leases,
                [&name](const WorkUnit::Lease& lease) { return lease.worker == name; });
}

bool WorkBoard::has_hope(const WorkUnit& unit) const {
  bool is_someone_resting = false;
  for (const auto& [name, worker] : workers_) {
    if (works(worker) && !unit.has_failed(name)) {
      return true;
    }
    is_someone_resting = is_someone_resting || (is_live(worker) && worker.unsuitable.empty() &&
                                                !worker.is_draining && !works(worker));
  }
  return unit.is_busy || !unit.leases.empty() || unit.first ||
         (unit.refused.empty() && !is_someone_resting);
}

void WorkBoard::note_unverified(const std::string& worker, const RenderRun& run) {
  std::vector<std::weak_ptr<Job>>& jobs = workers_[worker].unverified;
  std::erase_if(jobs, [](const std::weak_ptr<Job>& each) { return each.expired(); });
  const JobPointer job = run.job();
  if (job && std::none_of(jobs.begin(), jobs.end(),
                          [&job](const std::weak_ptr<Job>& each) { return each.lock() == job; })) {
    jobs.push_back(job);
  }
}

void WorkBoard::render_hopeless() {
  const core::MutexLock lock(mutex_);
  for (auto& entry : units_) {
    if (!has_hope(entry.second)) {
      render_here(entry);
    }
  }
}

void WorkBoard::render_here(Units::value_type& entry) {
  auto& [name, unit] = entry;
  unit.is_busy = true;
  ++counts_.own;
  own_.post([this, name = name, run = unit.run, slices = unit.slices, stop = unit.own.get_token()] {
    std::optional<std::vector<SliceWork>> work;
    try {
      auto rendered = render_slices(run, slices, stop);
      if (rendered) {
        work = *std::move(rendered);
      } else {
        run->fail(rendered.error());
      }
    } catch (const std::exception& error) {
      run->fail(Error{ErrorCode::kUnavailable,
                      std::string("a part of the image could not be rendered: ") + error.what(),
                      ""});
    }
    take_own(name, std::move(work));
  });
}

void WorkBoard::take_own(const std::string& name, std::optional<std::vector<SliceWork>> work) {
  std::vector<JobPointer> doubted;
  std::shared_ptr<RenderRun> run;
  {
    const core::MutexLock lock(mutex_);
    const auto found = units_.find(name);
    if (found == units_.end()) {  // The board has stopped.
      return;
    }
    WorkUnit& unit = found->second;
    if (!work) {
      unit.is_busy = false;
      tell();
      return;
    }
    run = unit.run;
    const std::string digest = core::content_digest(*work);
    for (const auto& result : {unit.first, unit.other}) {
      if (result && result->digest != digest) {
        const std::vector<JobPointer> more =
            suspend(result->worker,
                    "its result differed from that of the server; restart the worker once "
                    "its machine has been checked");
        doubted.insert(doubted.end(), more.begin(), more.end());
      }
    }
  }
  run->accept(*std::move(work));
  {
    const core::MutexLock lock(mutex_);
    ++counts_.taken;
    remove(units_.find(name));
    tell();
  }
  for (const JobPointer& job : doubted) {
    calls_.distrust(job);
  }
}

std::vector<JobPointer> WorkBoard::suspend(const std::string& name, const std::string& reason) {
  Worker& worker = workers_[name];
  std::vector<JobPointer> doubted;
  if (!worker.suspended.empty()) {
    return doubted;
  }
  worker.suspended = reason;
  ++worker.view.faults;
  ++counts_.suspended;
  log_.write(LogLevel::kError, "worker_suspended", {{"worker", name}, {"detail", reason}});
  for (auto& [unit_name, unit] : units_) {
    std::erase_if(unit.leases,
                  [&name](const WorkUnit::Lease& lease) { return lease.worker == name; });
    if (unit.first && unit.first->worker == name && !unit.is_busy) {
      unit.first.reset();
    }
  }
  to_report_.insert(name);
  for (const std::weak_ptr<Job>& each : std::exchange(worker.unverified, {})) {
    if (JobPointer job = each.lock()) {
      doubted.push_back(std::move(job));
    }
  }
  return doubted;
}

}  // namespace server
