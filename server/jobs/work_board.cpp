#include "server/jobs/work_board.h"

#include <algorithm>
#include <exception>
#include <random>
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

/// Delay at which the thread notices events that do not wake it: an expired lease, or a pass
/// completed by threads of this process. Half of the shortest unit.
constexpr auto kTick = std::chrono::duration_cast<std::chrono::milliseconds>(
    std::chrono::duration<double>(UnitPlanner::kSecondsLeast / 2));
/// The same while no job runs, of which a new one wakes it: a lost broker, and as often as waiting
/// jobs are noted.
constexpr std::chrono::milliseconds kIdleTick{1000};

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

WorkBoard::WorkBoard(std::shared_ptr<queue::UnitQueue> queue, Scheduler& scheduler, Log& log,
                     WorkOptions options, Calls calls)
    : queue_(std::move(queue)),
      scheduler_(scheduler),
      log_(log),
      options_(std::move(options)),
      calls_(std::move(calls)),
      planner_(scheduler, make_uuid().substr(0, 8)),
      table_(options_, log, std::random_device()()),
      own_(1, 1, Background::Priority::kOfRendering),
      thread_([this](const std::stop_token& stop) { run(stop); }) {
  scheduler_.on_add([this] {
    const core::MutexLock lock(mutex_);
    wake();
  });
}

WorkBoard::~WorkBoard() {
  scheduler_.on_add({});
  stop();
}

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

void WorkBoard::suspend_again(std::set<std::string> workers) {
  const core::MutexLock lock(mutex_);
  table_.suspend_again(std::move(workers));
}

void WorkBoard::wake() {
  is_news_ = true;
  changed_.notify_all();
}

core::Result<api::WorkerOrders> WorkBoard::report(const Sender& sender,
                                                  const api::WorkerReport& report) {
  const core::MutexLock lock(mutex_);
  const std::size_t before = table_.worker_count();
  auto orders = table_.report(sender, report, options_.now(), unix_now());
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
    const auto unit = table_.lease(name, sender, options_.now());
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
  JobPointer job;
  std::vector<core::Slice> slices;
  bool is_checked = false;
  {
    const core::MutexLock lock(mutex_);
    const auto unit = table_.begin_result(name, sender);
    if (!unit) {
      return unit.error();
    }
    run = (*unit)->run;
    job = (*unit)->job.lock();
    slices = (*unit)->slices;
    is_checked = (*unit)->is_checked;
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
  if (work && job && !is_checked) {
    // Stored before the samples can be, and before the lease is asked for: if the worker is
    // suspended meanwhile, either the job is known to be spoilt, or the result is refused.
    calls_.note_unverified(*job, sender.worker);
  }
  std::optional<LeaseTable::Work> accepted;
  {
    const core::MutexLock lock(mutex_);
    if (!work) {
      table_.refuse_result(name, sender.worker, work.error().message, options_.now());
      return work.error();
    }
    auto taken =
        table_.take_result(name, sender.worker, *std::move(work), result.size(), options_.now());
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
  Status handed = table_.hand_back(name, sender, fault, options_.now());
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
  std::vector<std::string> suspended;
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
    suspended = table_.judge(name, digest);
  }
  accept(name, *run, *std::move(work));
  for (const std::string& worker : suspended) {
    calls_.distrust(worker);
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
  return table_.workers(options_.now());
}

WorkBoard::Counts WorkBoard::counts() const {
  const core::MutexLock lock(mutex_);
  Counts counts = table_.counts();
  counts.has_broker = has_broker_;
  return counts;
}

void WorkBoard::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const bool is_idle = scheduler_.active_count() == 0;
    {
      const core::MutexLock lock(mutex_);
      changed_.wait_for(mutex_, stop, is_idle && table_.units().empty() ? kIdleTick : kTick,
                        [this]() REQUIRES(mutex_) { return is_news_; });
      is_news_ = false;
    }
    drop_ended();
    expire_leases();
    render_hopeless();
    has_broker_ = prepare_broker();
    if (has_broker_) {
      had_broker_at_ = options_.now();
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
  const auto now = options_.now();
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
    const auto now = options_.now();
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
    for (const WorkUnit* unit : table_.expire(options_.now())) {
      // Clients see this text; the log line of each loss names the worker.
      failures.emplace_back(
          unit->run, "a part of the image was lost with " + std::to_string(unit->lost.size()) +
                         " workers, which stopped reporting while they rendered it");
    }
  }
  for (const auto& [run, reason] : failures) {
    run->fail(Error{ErrorCode::kInternal, reason, ""});
  }
}

void WorkBoard::render_hopeless() {
  const core::MutexLock lock(mutex_);
  for (const std::string& name : table_.hopeless(options_.now())) {
    render_here(name);
  }
}

/// Keeps one unit in the queue per thread of the workers, so that each finds its next one there; at
/// least one, so that an autoscaler sees that workers are needed.
void WorkBoard::plan() {
  while (true) {
    int slots = 0;
    {
      const core::MutexLock lock(mutex_);
      slots = std::max(table_.slots(options_.now()), options_.has_local_threads ? 0 : 1);
      if (table_.wanted() >= slots) {
        return;
      }
    }
    auto unit = planner_.next(slots);
    const core::MutexLock lock(mutex_);
    if (!unit) {
      table_.double_last_units(options_.now());
      return;
    }
    table_.add(unit->name, std::move(unit->unit), options_.now());
  }
}

/// Publishes names again whose messages are lost: the stream then has fewer messages than units are
/// published or leased.
void WorkBoard::find_lost_messages() {
  std::optional<std::uint64_t> expected;
  {
    const core::MutexLock lock(mutex_);
    expected = table_.messages_expected(options_.now());
  }
  if (!expected) {
    return;
  }
  const auto messages = queue_->messages();
  if (!messages) {
    note_queue_fault(messages.error());
    return;
  }
  const core::MutexLock lock(mutex_);
  table_.note_messages(*messages < *expected, options_.now());
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
    names = table_.take_to_publish(options_.now());
  }
  for (const std::string& name : names) {
    if (const Status published = queue_->publish(name); !published) {
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
    queue_->request_report(worker);
  }
}

/// Creates the stream on each new connection and publishes all open units in it.
bool WorkBoard::prepare_broker() {
  const std::uint64_t generation = queue_->generation();
  if (prepared_ == generation && queue_->is_connected()) {
    return true;
  }
  const auto silence = std::chrono::duration_cast<std::chrono::milliseconds>(options_.lease_time());
  if (const Status ready = queue_->prepare(silence); !ready) {
    if (broker_fault_ != ready.error().message) {
      broker_fault_ = ready.error().message;
      log_.write(LogLevel::kWarning, "queue_fault", {{"detail", broker_fault_}});
    }
    return false;
  }
  log_.write(LogLevel::kInfo, "queue_ready", {{"queue", queue_->name()}});
  broker_fault_.clear();
  prepared_ = generation;
  const core::MutexLock lock(mutex_);
  table_.forget_messages();
  return true;
}

}  // namespace server
