// Requests and results of workers, and units that this process renders for them.
#include "server/jobs/work_board.h"

#include <exception>
#include <utility>

#include "core/render/units/result_size.h"
#include "core/render/units/unit_renderer.h"
#include "server/jobs/render_run.h"
#include "server/observe/clock.h"
#include "server/store/uuid.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Renders slices as a worker does. Returns empty if it was stopped. Errors: of the format.
core::Result<std::optional<LeaseTable::Work>> render_slices(const std::shared_ptr<RenderRun>& run,
                                                            const std::vector<core::Slice>& slices,
                                                            const std::stop_token& stop) {
  LeaseTable::Work work;
  for (const core::Slice& slice : slices) {
    work.push_back(run->prepare(slice));
  }
  // Shares the run's lifetime.
  core::UnitRenderer renderer(std::shared_ptr<const core::Renderer>(run, &run->task().renderer()));
  if (!renderer.render(work, stop)) {
    return std::optional<LeaseTable::Work>();
  }
  auto sent =
      core::decode_work(core::encode_work(work, core::WorkPart::kResult), core::WorkPart::kResult);
  return sent ? core::Result<std::optional<LeaseTable::Work>>(*std::move(sent))
              : core::Result<std::optional<LeaseTable::Work>>(sent.error());
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
      table_(options_, log),
      own_(1, 1, Background::Priority::kOfRendering),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void WorkBoard::stop() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  const auto is_any = [](const WorkUnit& /*unit*/) { return true; };
  LeaseTable::Units left;  // Destroyed without the lock.
  {
    const core::MutexLock lock(mutex_);
    left = table_.remove_if(is_any);
  }
  own_.stop(Background::Waiting::kDrop);
  const core::MutexLock lock(mutex_);
  left.merge(table_.clear());
}

void WorkBoard::wake() {
  is_news_ = true;
  changed_.notify_all();
}

core::Result<api::WorkerOrders> WorkBoard::report(const Sender& sender,
                                                  const api::WorkerReport& report) {
  const core::MutexLock lock(mutex_);
  const std::size_t before = table_.worker_count();
  auto orders = table_.report(sender, report, Clock::now(), unix_now());
  if (table_.worker_count() > before) {
    wake();
  }
  return orders;
}

core::Result<std::string> WorkBoard::lease(const std::string& name, const Sender& sender) {
  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  {
    const core::MutexLock lock(mutex_);
    const auto unit = table_.lease(name, sender, Clock::now());
    if (!unit) {
      return unit.error();
    }
    run = (*unit)->run;
    slices = (*unit)->slices;
    wake();
  }
  core::WorkWriter writer(core::WorkPart::kInput, slices.size());
  for (const core::Slice& slice : slices) {
    writer.add(run->prepare(slice));
  }
  return writer.finish();
}

core::Result<LeaseTable::Work> WorkBoard::read_result(const RenderRun& run,
                                                      const std::vector<core::Slice>& slices,
                                                      std::string_view result) const {
  auto work = core::decode_work(result, core::WorkPart::kResult);
  if (!work) {
    return work;
  }
  const auto checked = core::check_result(
      slices.size(), [&](std::size_t i) { return run.prepare(slices[i]); },
      run.task().renderer().view().settings, *work);
  return checked ? std::move(work) : core::Result<LeaseTable::Work>(checked.error());
}

core::Result<std::uint64_t> WorkBoard::result_bytes_max(const std::string& name,
                                                        const Sender& sender) const {
  const core::MutexLock lock(mutex_);
  const auto unit = table_.held(name, sender);
  if (!unit) {
    return unit.error();
  }
  return core::result_bytes_max(*(*unit)->run->film(), (*unit)->slices.size());
}

Status WorkBoard::take(const std::string& name, const Sender& sender, std::string_view result) {
  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  {
    const core::MutexLock lock(mutex_);
    const auto unit = table_.begin_result(name, sender);
    if (!unit) {
      return unit.error();
    }
    run = (*unit)->run;
    slices = (*unit)->slices;
  }
  const auto work_or_throw = [&] {
    try {
      return read_result(*run, slices, result);
    } catch (...) {  // No memory: the unit stays with its worker, which sends the result again.
      const core::MutexLock lock(mutex_);
      table_.cancel(name);
      throw;
    }
  };
  auto work = work_or_throw();
  std::optional<LeaseTable::Work> accepted;
  {
    const core::MutexLock lock(mutex_);
    if (!work) {
      table_.refuse_result(name, sender.worker, work.error().message, Clock::now());
      return work.error();
    }
    auto taken =
        table_.take_result(name, sender.worker, *std::move(work), result.size(), Clock::now());
    if (!taken) {
      return taken.error();
    }
    if (taken->is_disputed) {
      render_here(name);
    }
    accepted = std::move(taken->work);
    wake();
  }
  if (accepted) {
    accept(name, *run, *std::move(accepted));
  }
  return core::ok_status();
}

void WorkBoard::accept(const std::string& name, RenderRun& run, LeaseTable::Work work) {
  run.accept(std::move(work));
  const core::MutexLock lock(mutex_);
  table_.close(name);
  wake();
}

Status WorkBoard::hand_back(const std::string& name, const Sender& sender,
                            const std::string& fault) {
  const core::MutexLock lock(mutex_);
  Status handed = table_.hand_back(name, sender, fault, Clock::now());
  if (handed) {
    wake();
  }
  return handed;
}

void WorkBoard::render_here(const std::string& name) {
  table_.begin_own(name);
  const WorkUnit& unit = table_.units().at(name);
  own_.post([this, name, run = unit.run, slices = unit.slices, stop = unit.own.get_token()] {
    std::optional<LeaseTable::Work> work;
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

void WorkBoard::take_own(const std::string& name, std::optional<LeaseTable::Work> work) {
  const std::string digest = work ? core::content_digest(*work) : "";
  std::vector<JobPointer> doubted;
  std::shared_ptr<RenderRun> run;
  {
    const core::MutexLock lock(mutex_);
    const auto found = table_.units().find(name);
    if (found == table_.units().end()) {  // The board has stopped.
      return;
    }
    if (!work) {
      table_.cancel(name);
      wake();
      return;
    }
    run = found->second.run;
    doubted = table_.judge(name, digest);
  }
  accept(name, *run, *std::move(work));
  for (const JobPointer& job : doubted) {
    calls_.distrust(job);
  }
}

JobPointer WorkBoard::job_of_lease(const std::string& id, const std::string& key) const {
  const core::MutexLock lock(mutex_);
  for (const auto& [name, unit] : table_.units()) {
    const JobPointer job = unit.job.lock();
    for (const WorkUnit::Lease& lease : unit.leases) {
      if (job && job->id() == id && table_.has_key(lease.worker, key)) {
        return job;
      }
    }
  }
  return nullptr;
}

std::vector<api::WorkerTile> WorkBoard::tiles_of(const Job& job) const {
  std::vector<api::WorkerTile> tiles;
  const core::MutexLock lock(mutex_);
  for (const auto& [name, unit] : table_.units()) {
    if (unit.job.lock().get() != &job) {
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
  return table_.workers(Clock::now());
}

WorkBoard::Counts WorkBoard::counts() const {
  const core::MutexLock lock(mutex_);
  Counts counts = table_.counts();
  counts.has_broker = has_broker_;
  return counts;
}

}  // namespace server
