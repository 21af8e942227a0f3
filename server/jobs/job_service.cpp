#include "server/jobs/job_service.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "api/json/errors.h"
#include "core/base/cgroup.h"
#include "server/jobs/work_board.h"
#include "server/observe/clock.h"
#include "server/queue/units.h"
#include "server/scenes/scene_facts.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPilotsAtATime = 4;
constexpr std::chrono::milliseconds kUpkeepPause{250};
constexpr double kHousekeepingSeconds = 600;
constexpr double kForgetSeconds = 1;
/// The write-ahead log, which a damaged bit makes worthless from there on, holds the changes of
/// this time at most.
constexpr double kWriteBackSeconds = 10;
constexpr int kForgottenAtATime = 64;

int threads_or_machine(int threads) { return threads > 0 ? threads : core::usable_threads(); }

}  // namespace

JobService::JobService(JobServiceParts parts, JobServiceOptions options, std::int64_t run)
    : table_(parts.table),
      scenes_(parts.scenes),
      data_(parts.data),
      log_(parts.log),
      quota_(parts.quota),
      memory_(parts.memory),
      options_(options),
      pilots_(kPilotsAtATime),
      book_(options.book, memory_, [this] { life_.admit(); }),
      journal_(table_, book_, log_, parts.metrics, run),
      index_(table_, book_),
      films_({table_, data_, quota_, memory_, log_, parts.metrics, journal_, index_},
             options.film_cache_bytes),
      builder_({scenes_, data_, log_, book_, journal_, films_}, options.samples_max,
               options.arithmetic, options.build),
      scheduler_(threads_or_machine(options.threads)),
      life_({data_, quota_, log_, parts.metrics, book_, journal_, films_, builder_, scheduler_},
            options.checkpoint_seconds),
      upkeep_([this](const std::stop_token& stop) { upkeep(stop); }) {
  memory_.add_reclaimer([this] { return films_.drop_unused() || book_.forget_oldest_preview(); });
  if (options_.queue) {
    local_.max = options_.render_threads;
    builder_.set_local_threads(&local_);
    board_ = std::make_unique<WorkBoard>(
        std::make_unique<queue::UnitPublisher>(options_.queue), scheduler_, log_, options_.work,
        WorkBoard::Calls{
            .note_waiting =
                [this](Job& job, const std::string& reason) { builder_.note_waiting(job, reason); },
            .distrust = [this](const JobPointer& job) { life_.begin_again(job); }});
  }
}

JobService::~JobService() { stop(); }

Status JobService::resume() {
  const auto last = table_.last_sequence();
  if (!last) {
    return last.error();
  }
  last_sequence_ = *last;
  if (auto forgotten = table_.forget_keys_before(unix_now() - kKeySeconds); !forgotten) {
    return forgotten;
  }
  if (table_.database().damage().empty()) {  // Otherwise records of these films may be lost.
    films_.remove_all_loose();
  }
  const auto rows = table_.unfinished();
  if (!rows) {
    return rows.error();
  }
  std::vector<std::pair<JobPointer, JobRecord>> changes;
  std::vector<JobBook::Entry> entries;
  for (const JobRow& row : *rows) {
    auto record = to_record(row);
    if (!record) {
      log_.write(LogLevel::kError, "job_unreadable",
                 {{"job", row.id}, {"detail", record.error().message}});
      continue;
    }
    auto job = std::make_shared<Job>(*record, Job::History::kInLog);
    book_.add(job);
    if (record->view.state == JobState::kPaused && !job->waits_for_disk()) {
      continue;
    }
    JobRecord after = *std::move(record);
    after.view.state = JobState::kQueued;
    after.view.pause_reason = api::PauseReason::kNone;
    entries.push_back({.job = job, .admission = builder_.admission_of(after.view.spec)});
    changes.emplace_back(job, std::move(after));
  }
  journal_.change_together(std::move(changes));
  book_.enqueue(std::move(entries));
  life_.admit();
  return core::ok_status();
}

void JobService::stop() {
  if (!life_.begin_stop()) {
    return;
  }
  upkeep_.request_stop();
  if (upkeep_.joinable()) {
    upkeep_.join();
  }
  if (board_) {
    board_->stop();
  }
  life_.finish_stop();
}

api::Parsed<JobService::Checked> JobService::check(api::ParsedJob request, const Access& access) {
  auto facts = scenes_.facts(request.spec.scene, access);
  if (!facts) {
    Error error = facts.error();
    error.where = "/scene";
    return api::from_error(error);
  }
  if (auto faults = faults_against_scene(request.spec, *facts); !faults.empty()) {
    return api::make_problem(ErrorCode::kInvalidArgument, std::move(faults));
  }
  if (request.spec.environment_asset) {
    if (const auto usable = scenes_.check_environment(*request.spec.environment_asset, access);
        !usable) {
      return api::from_error(usable.error());
    }
  }
  if (auto warning = api::settle_environment(request.spec, *facts)) {
    request.warnings.push_back(std::move(*warning));
  }
  const double kept = options_.retention.seconds;
  if (kept > 0 && request.spec.retention_seconds.value_or(0) > kept) {
    request.warnings.push_back("This server deletes jobs " +
                               std::to_string(static_cast<std::int64_t>(kept)) +
                               " seconds after they have ended.");
  }
  const std::vector<std::string> more = api::adaptive_warnings(request.spec);
  request.warnings.insert(request.warnings.end(), more.begin(), more.end());
  Admission admission = builder_.admission_of(request.spec);
  if (auto fault = builder_.too_large(request.spec, admission.memory)) {
    return api::make_problem(ErrorCode::kInvalidArgument, {std::move(*fault)});
  }
  return Checked{.job = std::move(request), .admission = std::move(admission)};
}

void JobService::upkeep(const std::stop_token& stop) {
  core::Mutex mutex;
  core::CondVar never;
  auto kept_house = Clock::now();
  auto forgot = kept_house;
  auto written_back = kept_house;
  const auto seconds_since = [](Clock::time_point then) {
    return std::chrono::duration<double>(Clock::now() - then).count();
  };
  while (!stop.stop_requested()) {
    {
      const core::MutexLock lock(mutex);
      never.wait_for(mutex, stop, kUpkeepPause, [] { return false; });
    }
    if (book_.waits_for_memory()) {
      life_.admit();  // A request may have released memory.
    }
    life_.save_due(stop);
    if (seconds_since(forgot) > kForgetSeconds) {
      forgot = Clock::now();
      forget_expired();
      life_.go_on_with_room();
    }
    if (seconds_since(written_back) > kWriteBackSeconds) {
      written_back = Clock::now();
      static_cast<void>(table_.database().checkpoint());  // Retried later.
    }
    if (seconds_since(kept_house) > kHousekeepingSeconds) {
      kept_house = Clock::now();
      films_.evict();
      static_cast<void>(table_.forget_keys_before(unix_now() - kKeySeconds));  // Retried later.
    }
  }
}

void JobService::forget_expired() {
  const auto ids = table_.expired(unix_now(), options_.retention, kForgottenAtATime);
  for (const std::string& id : ids ? *ids : std::vector<std::string>()) {
    const auto job = index_.find(id);
    if (job && remove(*job)) {
      log_.write(LogLevel::kInfo, "job_forgotten", {{"job", id}});
    }
  }
}

JobService::Counts JobService::counts() const {
  Counts counts;
  if (auto by_state = table_.count_by_state()) {
    counts.by_state = std::move(*by_state);
  }
  counts.queued = book_.queue_length();
  counts.rendering = scheduler_.active_count();
  counts.threads = scheduler_.times();
  counts.film_cache_bytes = films_.cached_bytes();
  counts.held_bytes = book_.memory_bytes();
  counts.waits_for_memory = book_.waits_for_memory();
  const RenderRun::Work work = life_.work_done();
  counts.rays = work.rays;
  counts.samples = work.samples;
  return counts;
}

int JobService::jobs_without_room() const {
  int count = 0;
  for (const JobPointer& job : book_.all()) {
    count += job->waits_for_disk() ? 1 : 0;
  }
  return count;
}

core::Result<CostEstimate> JobService::estimate(const api::JobSpec& spec, const std::string& tenant,
                                                const std::stop_token& stop) {
  // Loads scenes only in its turn: otherwise the scenes of many dry runs would be in memory at the
  // same time.
  const auto turn = pilots_.take(tenant, stop, std::nullopt);
  if (!turn) {
    return turn.error();
  }
  auto renderer = builder_.renderer(pilot_spec(spec), {.stop = stop});
  if (!renderer) {
    return renderer.error();
  }
  const JobMemory memory = builder_.admission_of(spec).memory;
  const auto held = memory_.note({.shared = memory.shared_bytes}, MemoryGate::Kind::kNeeded);
  const auto pilot = std::make_shared<Pilot>(*renderer);
  scheduler_.add(pilot, Rank{.is_preview = true, .priority = 0}, tenant);
  const bool worked = pilot->wait(stop);
  scheduler_.remove(*pilot);
  if (stop.stop_requested()) {
    return Error{ErrorCode::kCancelled, "stopped while the pilot was rendered", ""};
  }
  if (!worked) {
    return Error{ErrorCode::kUnavailable, "the pilot could not be rendered in time", ""};
  }
  CostEstimate cost = pilot->estimate(spec, scheduler_.threads(), options_.samples_max);
  cost.memory_bytes_low = static_cast<double>(memory.film_bytes);
  cost.memory_bytes_high = static_cast<double>(memory.bytes());
  cost.memory_bytes =
      cost.memory_bytes_high - static_cast<double>(memory.own_bytes() - memory.film_bytes);
  return cost;
}

std::optional<Error> JobService::refused_work() const {
  if (!life_.is_stopping() && !life_.is_draining()) {
    return std::nullopt;
  }
  return Error{ErrorCode::kUnavailable,
               life_.is_stopping() ? "the server is stopping"
                                   : "the server is draining and accepts no new jobs",
               ""};
}

api::DrainView JobService::drain() const {
  return {.draining = life_.is_draining(),
          .running = book_.running_count(),
          .queued = book_.queue_length()};
}

core::Result<core::View> JobService::scene_view(const Job& job) const {
  if (const auto run = job.run()) {
    return run->task().renderer().view();
  }
  return builder_.view(job.record().view.spec, {});
}

}  // namespace server
