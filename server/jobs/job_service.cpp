#include "server/jobs/job_service.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "api/answers/film_view.h"
#include "api/job/view_of.h"
#include "api/json/error_codes.h"
#include "api/json/errors.h"
#include "core/base/cgroup.h"
#include "server/jobs/work_board.h"
#include "server/observe/clock.h"
#include "server/queue/unit_queue.h"
#include "server/scenes/scene_facts.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPilotsAtATime = 4;
/// Between two attempts to start jobs that wait for room.
constexpr std::chrono::milliseconds kUpkeepPause{250};
constexpr double kHousekeepingSeconds = 600;
constexpr double kForgetSeconds = 1;
/// The write-ahead log, which a damaged bit makes worthless from there on, holds the changes of
/// this time at most.
constexpr double kWriteBackSeconds = 10;
constexpr int kForgottenAtATime = 64;

/// Updates the warnings after the spec has changed from `before`: removes those that no longer
/// apply, and adds `more`.
void update_warnings(api::JobView& view, const api::JobSpec& before,
                     const std::vector<std::string>& more) {
  const auto about = [](const api::JobSpec& spec) {
    std::vector<std::string> warnings = api::adaptive_warnings(spec);
    for (std::string& warning : api::idle_warnings(spec)) {
      warnings.push_back(std::move(warning));
    }
    return warnings;
  };
  const auto holds = [](const std::vector<std::string>& list, const std::string& warning) {
    return std::find(list.begin(), list.end(), warning) != list.end();
  };
  const std::vector<std::string> old = about(before);
  std::vector<std::string> now = about(view.spec);
  now.insert(now.end(), more.begin(), more.end());
  const bool is_same_count = before.stop.samples_per_pixel == view.spec.stop.samples_per_pixel;
  std::erase_if(view.warnings, [&](const std::string& warning) {
    return !holds(now, warning) &&
           (holds(old, warning) || (!is_same_count && warning.starts_with(api::kSamplesWarning)));
  });
  for (const std::string& warning : now) {
    if (!holds(view.warnings, warning)) {
      view.warnings.push_back(warning);
    }
  }
}

int threads_or_machine(int threads) { return threads > 0 ? threads : core::usable_threads(); }

}  // namespace

JobService::JobService(JobServiceParts parts, JobServiceOptions options, std::int64_t run)
    : table_(parts.table),
      workers_(parts.table.database(), kWorkersMax),
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
      submissions_(
          {table_, scenes_, log_, quota_, book_, journal_, index_, films_, builder_, life_},
          {options.retention.seconds, options.quota_jobs}),
      upkeep_([this](const std::stop_token& stop) { upkeep(stop); }) {
  memory_.add_reclaimer([this] { return films_.drop_unused() || book_.forget_oldest_preview(); });
  if (options_.queue) {
    local_.max = options_.render_threads;
    builder_.set_local_threads(&local_);
    board_ = std::make_unique<WorkBoard>(
        options_.queue, scheduler_, log_, options_.work,
        WorkBoard::Calls{
            .note_waiting =
                [this](Job& job, const std::string& reason) { builder_.note_waiting(job, reason); },
            .note_unverified = [this](Job& job,
                                      const std::string& worker) { note_unverified(job, worker); },
            .distrust = [this](const std::string& worker) { distrust(worker); }});
  }
}

JobService::~JobService() { stop(); }

Status JobService::resume() {
  const auto last = table_.last_sequence();
  if (!last) {
    return last.error();
  }
  submissions_.resume(*last);
  const auto suspended = workers_.suspended();
  if (!suspended) {
    return suspended.error();
  }
  if (board_) {
    board_->suspend_again(*suspended);
  }
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
  // A full disk may have stored the suspension, but not the doubt of each job.
  const core::MutexLock lock(distrusted_mutex_);
  distrusted_.assign(suspended->begin(), suspended->end());
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

void JobService::note_unverified(Job& job, const std::string& worker) {
  if (job.record().unverified.contains(worker)) {
    return;
  }
  // Fails only for a job that was deleted in the meantime.
  static_cast<void>(journal_.change(job,
                                    [&](JobRecord& record) -> Verdict {
                                      record.unverified.insert(worker);
                                      return {};
                                    },
                                    {.unstored = Journal::Unstored::kInMemory}));
}

core::Result<JobPointer> JobService::add_finished(FinishedFilm finished) {
  const std::set<std::string> unverified = finished.unverified;
  auto job = submissions_.add_finished(std::move(finished));
  if (!job || unverified.empty()) {
    return job;
  }
  // One of them may have been found out while the films were merged: distrust() has stored it and
  // then looked for jobs.
  const auto suspended = workers_.suspended();
  for (const std::string& worker : unverified) {
    if (!suspended || suspended->contains(worker)) {
      life_.distrust(*job, worker);
    }
  }
  return job;
}

void JobService::distrust(const std::string& worker) {
  if (const Status stored = doubt_jobs_of(worker); !stored) {
    log_.write(LogLevel::kError, "suspension_not_stored",
               {{"worker", worker}, {"detail", stored.error().message}});
    const core::MutexLock lock(distrusted_mutex_);
    distrusted_.push_front(worker);
  }
}

void JobService::distrust_again() {
  std::string worker;
  {
    const core::MutexLock lock(distrusted_mutex_);
    if (distrusted_.empty()) {
      return;
    }
    worker = std::move(distrusted_.front());
    distrusted_.pop_front();
  }
  if (!doubt_jobs_of(worker)) {
    const core::MutexLock lock(distrusted_mutex_);
    distrusted_.push_back(std::move(worker));
  }
}

Status JobService::doubt_jobs_of(const std::string& worker) {
  Status stored = workers_.suspend(worker);
  for (const JobPointer& job : book_.all()) {
    life_.distrust(job, worker);
  }
  const auto ids = table_.with_text(text_of_worker(worker));
  if (!ids) {
    return ids.error();
  }
  for (const std::string& id : *ids) {
    if (const auto job = index_.find(id)) {
      life_.distrust(*job, worker);
    }
  }
  return stored;
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
      const bool waits = book_.queue_length() > 0;
      never.wait_for(mutex, stop,
                     waits ? kUpkeepPause : std::max(kUpkeepPause, life_.checkpoints().pause()),
                     [] { return false; });
    }
    if (book_.queue_length() > 0) {
      life_.admit();  // A request may have released memory, or a job may have its first image.
    }
    life_.checkpoints().save_due(stop);
    if (seconds_since(forgot) > kForgetSeconds) {
      forgot = Clock::now();
      forget_expired();
      distrust_again();
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

core::Result<api::CostView> JobService::estimate(const api::JobSpec& spec,
                                                 const std::string& tenant,
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
  api::CostView cost = pilot->estimate(spec, scheduler_.threads(), options_.samples_max);
  cost.memory_bytes_low = static_cast<double>(memory.film_bytes);
  cost.memory_bytes_high = static_cast<double>(memory.bytes());
  cost.memory_bytes =
      cost.memory_bytes_high - static_cast<double>(memory.own_bytes() - memory.film_bytes);
  return cost;
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

core::Result<std::shared_ptr<const core::MotionTarget>> JobService::scene_at(
    const Job& job, double time_seconds, core::Place origin) const {
  const api::JobSpec spec = job.record().view.spec;
  return scenes_.later(spec.scene, api::later_moment(spec, time_seconds, origin));
}

Verdict JobService::check_stop(const core::StopRules& stop, const std::string& scene) const {
  if (!stop.light_not_found) {
    return {};  // No other rule depends on the scene.
  }
  const auto facts = scenes_.facts(scene, Access::operators());
  if (!facts) {
    return facts.error();
  }
  if (auto faults = stop_faults_against_scene(stop, *facts); !faults.empty()) {
    return api::make_problem(ErrorCode::kInvalidArgument, std::move(faults));
  }
  return {};
}

Verdict JobService::apply_patch(JobRecord& record, const Job& job,
                                const api::JobPatch& patch) const {
  api::JobView& view = record.view;
  const std::string state(api::to_text(view.state));
  if (api::is_final(view.state) && patch.stop_named) {
    return Error{ErrorCode::kConflict, "the job is " + state + "; use extend to continue it",
                 "/stop"};
  }
  if (api::is_final(view.state) && patch.paused.value_or(false)) {
    return Error{ErrorCode::kConflict, "the job is " + state + " and cannot be paused", "/paused"};
  }
  if (patch.stop_named) {
    if (Verdict fits = check_stop(patch.spec.stop, patch.spec.scene); !fits) {
      return fits;
    }
  }
  const api::JobSpec before = view.spec;
  if (!api::same_spec(before, patch.spec)) {
    view.spec = patch.spec;
    ++view.spec_version;
  }
  update_warnings(view, before, patch.warnings);
  if (patch.paused && !api::is_final(view.state)) {
    const auto run = job.run();
    if (*patch.paused) {
      view.state = JobState::kPaused;
      view.pause_reason = api::PauseReason::kRequested;
    } else if (run && run->has_left_end()) {
      view.pause_reason = api::PauseReason::kStorageFull;
    } else if (view.pause_reason == api::PauseReason::kRequested) {
      view.state = run ? JobState::kRendering : JobState::kQueued;
      view.pause_reason = api::PauseReason::kNone;
    }
    if (run) {
      view.progress = run->task().progress();
    }
  }
  return {};
}

Verdict JobService::patch(const JobPointer& job, std::string_view body,
                          const std::optional<std::vector<std::uint32_t>>& if_versions,
                          const Access& access) {
  JobRecord before;
  const Verdict changed = journal_.change(
      *job,
      [&](JobRecord& record) -> Verdict {
        before = record;
        if (if_versions && std::find(if_versions->begin(), if_versions->end(),
                                     record.view.spec_version) == if_versions->end()) {
          return Error{api::kPreconditionFailed,
                       "the spec has changed: its version is " +
                           std::to_string(record.view.spec_version) +
                           " now, which does not match If-Match",
                       ""};
        }
        auto parsed = api::parse_job_patch(body, record.view.spec);
        if (!parsed) {
          return parsed.problem();
        }
        if (parsed->spec.priority != before.view.spec.priority) {
          if (Verdict allowed = priority_allowed(parsed->spec.priority, access); !allowed) {
            return allowed;
          }
        }
        return apply_patch(record, *job, *parsed);
      },
      {.unstored = Journal::Unstored::kRefused, .before_publishing = [&](const JobRecord& after) {
         life_.follow_patch(job, before, after);
       }});
  if (changed) {
    life_.admit();
  }
  return changed;
}

Verdict JobService::queue_again(const JobPointer& job, const Journal::Modify& modify) {
  if (const auto refused = submissions_.refused_work()) {
    return *refused;
  }
  const std::shared_lock<std::shared_mutex> naming(scenes_.names_mutex());
  const api::JobView view = job->record().view;
  if (!scenes_.facts(view.spec.scene, Access::operators())) {
    return api::make_problem(ErrorCode::kConflict, "the job's scene no longer exists");
  }
  const auto& environment = view.spec.environment_asset;
  if (environment && !scenes_.check_environment(*environment, Access::operators())) {
    return api::make_problem(ErrorCode::kConflict, "the job's environment no longer exists");
  }
  const Admission admission = builder_.admission_of(view.spec);
  if (!book_.has_room(admission)) {
    return api::make_problem(api::kTooManyRequests, book_.full_text(admission.rank));
  }
  const auto counted = submissions_.take_quota(job->tenant());
  if (!counted) {
    return counted.problem();
  }
  JobState before = JobState::kQueued;
  const auto queue = [&](JobRecord& record) -> Verdict {
    before = record.view.state;
    if (auto modified = modify(record); !modified) {
      return modified;
    }
    record.view.state = JobState::kQueued;
    record.view.stop_reason = core::StopReason::kNone;
    record.view.finished_at_unix_seconds.reset();
    record.view.film_digest.clear();
    record.view.progress.fraction = 0;
    return {};
  };
  const Verdict changed =
      journal_.change(*job, queue, {.before_publishing = [&](const JobRecord& after) {
        if (after.film == FilmPlace::kNone) {
          films_.remove_forgotten(*job);
        }
        life_.follow_state(job, before, after);
      }});
  if (changed) {
    life_.admit();
  }
  return changed;
}

Verdict JobService::extend(const JobPointer& job, std::string_view body) {
  if (job->state() == JobState::kFinished) {
    // Reads the film before accepting: a damaged film must not be rendered again silently.
    if (const auto whole = films_.stored(*job); !whole && whole.error().code == api::kGone) {
      return api::make_problem(ErrorCode::kConflict, whole.error().message);
    }
  }
  return queue_again(job, [&](JobRecord& record) -> Verdict {
    api::JobView& view = record.view;
    auto parsed = api::parse_extend(body, view.spec);
    if (!parsed) {
      return parsed.problem();
    }
    if (view.state != JobState::kFinished) {
      return Error{ErrorCode::kConflict,
                   "the job is " + std::string(api::to_text(view.state)) +
                       "; only a finished one can be extended",
                   ""};
    }
    if (!view.ledger.empty()) {
      return Error{ErrorCode::kConflict,
                   "the film was merged from samples that no single job can continue: " +
                       api::ledger_words(view.ledger),
                   ""};
    }
    if (view.is_doubted) {
      return Error{ErrorCode::kConflict, "its samples may be wrong; retry the job first", ""};
    }
    if (record.film != FilmPlace::kOnDisk) {
      return Error{ErrorCode::kConflict, "the job's film no longer exists", ""};
    }
    if (Verdict fits = check_stop(parsed->stop, view.spec.scene); !fits) {
      return fits;
    }
    const auto& samples = parsed->stop.samples_per_pixel;
    // The mean has a fractional part while an adaptive epoch is under way.
    const auto there = std::llround(view.progress.samples_mean);
    if (samples && *samples <= there) {
      return Error{ErrorCode::kInvalidArgument,
                   std::to_string(*samples) + " is not more than the " + std::to_string(there) +
                       " that exist",
                   "/stop/samples_per_pixel"};
    }
    const api::JobSpec before = view.spec;
    view.spec.stop = parsed->stop;
    ++view.spec_version;
    update_warnings(view, before, parsed->warnings);
    return {};
  });
}

Verdict JobService::retry(const JobPointer& job) {
  return queue_again(job, [&](JobRecord& record) -> Verdict {
    api::JobView& view = record.view;
    const bool is_wrong = can_begin_again(view);
    if (view.is_doubted && !view.ledger.empty()) {
      return Error{ErrorCode::kConflict,
                   "its film was merged: retry the jobs of the films, and merge them again", ""};
    }
    if (view.state != JobState::kFailed && !is_wrong) {
      return Error{ErrorCode::kConflict,
                   "the job is " + std::string(api::to_text(view.state)) +
                       "; only a failed one can be retried, or a finished one whose samples may "
                       "be wrong",
                   ""};
    }
    if (record.film != FilmPlace::kOnDisk || is_wrong) {  // Also for an evicted film.
      if (const Status announced = films_.announce_removal(*job); !announced) {
        return announced.error();
      }
      forget_samples(record);
    }
    record.failure.reset();
    view.failure.reset();
    return {};
  });
}

Verdict JobService::remove(const std::string& id, const Access& access) {
  const auto job = find(id, access);
  if (job) {
    return remove(*job);
  }
  // If there is a row that is no record, nothing works on the job.
  const auto row = table_.find(id);
  if (job.error().code != ErrorCode::kInternal || !row || !*row || !access.sees((*row)->tenant)) {
    return job.error();
  }
  if (const Status removed = remove_record(id); !removed) {
    return removed.error();
  }
  return {};
}

Status JobService::remove_record(const std::string& id) {
  Status removed = table_.remove(id);
  if (!removed && removed.error().code == ErrorCode::kNoSpace && remove_file(data_.film_path(id))) {
    removed = table_.remove(id);  // The record reuses the disk space that the film occupied.
  }
  if (removed) {
    films_.remove_loose(id);
  }
  return removed;
}

Verdict JobService::remove(const JobPointer& job) {
  const core::MutexLock changing(job->change_mutex());
  if (job->is_removed()) {
    return Error{ErrorCode::kNotFound, "the job was deleted", ""};
  }
  const JobState state = job->state();
  if (!api::is_final(state)) {
    return Error{ErrorCode::kConflict,
                 "the job is " + std::string(api::to_text(state)) + "; cancel it first", ""};
  }
  // Before the record goes: a job that lists lack is not found either. Removing its film takes
  // long.
  job->set_removed();
  if (!job->memory_only()) {
    if (const Status removed = remove_record(job->id()); !removed) {
      job->set_removed(false);
      return removed.error();
    }
  }
  book_.forget(*job);
  films_.drop(*job);
  return {};
}

}  // namespace server
