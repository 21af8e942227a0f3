#include "server/jobs/job_service.h"

#include <algorithm>
#include <utility>

#include "api/errors.h"
#include "api/events.h"
#include "server/observe/clock.h"
#include "server/scenes/scene_facts.h"
#include "server/store/film_file.h"
#include "server/store/uuid.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr double kKeySeconds = 24 * 3600;
constexpr int kPilotsAtATime = 4;

/// Both in the table of idempotency keys. A tenant's name has no space.
std::string own_id_key(const std::string& id) { return "put " + id; }
std::string key_of(const JobService::Submission& submission) {
  return "of " + submission.access.tenant + " " + submission.key;
}

int threads_or_machine(int threads) {
  return threads > 0 ? threads
                     : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

}  // namespace

JobService::JobService(JobServiceParts parts, JobServiceOptions options, std::int64_t run)
    : table_(parts.table),
      scenes_(parts.scenes),
      data_(parts.data),
      log_(parts.log),
      metrics_(parts.metrics),
      quota_(parts.quota),
      memory_(parts.memory),
      options_(options),
      run_(run),
      pilots_(kPilotsAtATime),
      book_(options.book, memory_, [this] { admit(); }),
      films_(options.film_cache_bytes, SingleFlightCache<StoredFilm>::Oversized::kNotKept),
      scheduler_(threads_or_machine(options.threads)),
      loaders_(2),
      preview_loaders_(1),
      savers_(2),
      checkpointer_([this](const std::stop_token& stop) { checkpoint_loop(stop); }) {
  memory_.add_reclaimer([this] { return films_.drop_unused() || book_.forget_oldest_preview(); });
}

JobService::~JobService() { stop(); }

Rank JobService::rank_of(const api::JobSpec& spec) {
  return Rank{.is_preview = spec.job_class == api::JobClass::kPreview, .priority = spec.priority};
}

Status JobService::resume() {
  const auto last = table_.last_sequence();
  if (!last) {
    return last.error();
  }
  last_sequence_ = *last;
  if (auto forgotten = table_.forget_keys_before(unix_now() - kKeySeconds); !forgotten) {
    return forgotten;
  }
  remove_loose_films();
  const auto rows = table_.unfinished();
  if (!rows) {
    return rows.error();
  }
  // All are stored in one transaction: each of its own would be a write that the disk confirms.
  std::vector<JobTable::Change> changes;
  std::vector<JobBook::Entry> entries;
  std::vector<std::pair<std::uint64_t, std::vector<Told>>> news;
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
    JobRecord after = *record;
    after.view.state = JobState::kQueued;
    after.view.pause_reason = api::PauseReason::kNone;
    std::vector<Told> told = events_between(*job, *record, after);
    std::vector<EventRow> events;
    news.emplace_back(reserve_events(*job, told, events), told);
    changes.push_back({.row = to_row(after),
                       .events = std::move(events),
                       .deliveries = deliveries_of(after, told)});
    entries.push_back(
        {.job = job, .rank = rank_of(after.view.spec), .memory = memory_of(after.view)});
    job->set_record(std::move(after));
  }
  if (const Status stored = table_.update(changes); !stored) {
    log_.write(LogLevel::kError, "store_failed", {{"detail", stored.error().message}});
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    publish_events(*entries[i].job, news[i].first, std::move(news[i].second));
  }
  book_.enqueue(std::move(entries));
  admit();
  return core::ok_status();
}

void JobService::stop() {
  if (stopping_.exchange(true)) {
    return;
  }
  checkpointer_.request_stop();
  if (checkpointer_.joinable()) {
    checkpointer_.join();
  }
  scheduler_.stop();
  loaders_.stop(Background::Waiting::kDrop);
  preview_loaders_.stop(Background::Waiting::kDrop);
  savers_.stop(Background::Waiting::kFinish);
  for (const JobPointer& job : book_.holders()) {
    if (job->run() != nullptr && !api::is_final(job->state())) {
      checkpoint(job);
    }
    job->set_run(nullptr);  // A run holds its place, and that the job.
  }
}

std::vector<JobService::Told> JobService::events_between(const Job& job, const JobRecord& before,
                                                         const JobRecord& after) const {
  std::vector<Told> told;
  api::JobView view = after.view;
  view.queue_position = book_.position(job);
  if (before.view.state != view.state || before.view.spec_version != view.spec_version ||
      before.view.created_at_unix_seconds == 0) {
    told.push_back({api::EventType::kState, api::state_event(view)});
  }
  for (const std::string& warning : new_warnings(before.view, view)) {
    told.push_back({api::EventType::kWarning, api::warning_event(warning)});
  }
  if (api::is_final(view.state) && !api::is_final(before.view.state)) {
    told.push_back({api::EventType::kEnd, api::end_event(view)});
  }
  return told;
}

std::uint64_t JobService::reserve_events(Job& job, const std::vector<Told>& told,
                                         std::vector<EventRow>& rows) const {
  const std::uint64_t first = job.log().reserve(static_cast<int>(told.size()));
  for (std::size_t i = 0; i < told.size(); ++i) {
    rows.push_back(EventRow{.stream = run_,
                            .seq = first + i,
                            .type = std::string(api::to_text(told[i].type)),
                            .data = told[i].data});
  }
  return first;
}

void JobService::publish_events(Job& job, std::uint64_t first, std::vector<Told> told) {
  std::vector<LoggedEvent> events;
  for (std::size_t i = 0; i < told.size(); ++i) {
    LoggedEvent event;
    event.seq = first + i;
    event.type = told[i].type;
    event.data = std::move(told[i].data);
    events.push_back(std::move(event));
  }
  job.log().publish(std::move(events));
}

Status JobService::change(Job& job, const Modify& modify, const ChangeOptions& options) {
  const core::MutexLock changing(job.change_mutex());
  if (job.is_removed()) {
    return Error{ErrorCode::kNotFound, "the job was deleted", ""};
  }
  const JobRecord before = job.record();
  JobRecord after = before;
  if (auto modified = modify(after); !modified) {
    return modified;
  }
  if (!may_change(before.view.state, after.view.state)) {
    return Error{ErrorCode::kConflict,
                 "the job is " + std::string(api::to_text(before.view.state)) +
                     " and cannot become " + std::string(api::to_text(after.view.state)),
                 ""};
  }
  std::vector<Told> told = events_between(job, before, after);
  std::vector<EventRow> rows;
  const std::uint64_t first = reserve_events(job, told, rows);
  if (!job.memory_only()) {
    const Status stored = table_.update(to_row(after), rows, deliveries_of(after, told));
    if (!stored) {
      log_.write(LogLevel::kError, "store_failed",
                 {{"job", job.id()}, {"detail", stored.error().message}});
      const bool is_full = stored.error().code == ErrorCode::kNoSpace;
      if (options.unstored == Unstored::kRefused ||
          (options.unstored == Unstored::kRefusedIfFull && is_full)) {
        job.log().drop(first, static_cast<int>(told.size()));
        return stored;
      }
    }
  }
  if (!told.empty() && told.back().type == api::EventType::kEnd) {
    job.set_end_mark(EndMark{.stream = run_, .seq = first + told.size() - 1});
    metrics_.count_job_end(api::to_text(after.view.stop_reason));
  }
  job.set_record(after);
  if (options.before_telling) {
    options.before_telling(after);
  }
  if (before.view.state != after.view.state) {
    log_.write(LogLevel::kInfo, "job_state",
               {{"job", job.id()},
                {"state", api::to_text(after.view.state)},
                {"pause_reason", api::to_text(after.view.pause_reason)},
                {"stop_reason", api::to_text(after.view.stop_reason)}});
  }
  publish_events(job, first, std::move(told));
  return core::ok_status();
}

api::Parsed<api::ParsedJob> JobService::check(api::ParsedJob request, const Access& access) {
  auto facts = scenes_.facts(request.spec.scene, access);
  if (!facts) {
    Error error = facts.error();
    error.where = "/scene";
    return api::from_error(error);
  }
  if (auto faults = faults_against_scene(request.spec, *facts); !faults.empty()) {
    return api::make_problem(ErrorCode::kInvalidArgument, std::move(faults));
  }
  api::JobView asked;
  asked.spec = request.spec;
  if (auto fault = too_large(asked)) {
    return api::make_problem(ErrorCode::kInvalidArgument, {std::move(*fault)});
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
    request.warnings.push_back("This server forgets jobs " +
                               std::to_string(static_cast<std::int64_t>(kept)) +
                               " seconds after their end.");
  }
  const std::vector<std::string> more = api::adaptive_warnings(request.spec);
  request.warnings.insert(request.warnings.end(), more.begin(), more.end());
  return request;
}

std::optional<api::Problem> JobService::refused_priority(int priority, const Access& access) {
  if (priority <= access.priority_max) {
    return std::nullopt;
  }
  return api::make_problem(
      ErrorCode::kInvalidArgument,
      {api::FieldError{"/priority", std::to_string(priority) + " is more than " +
                                        std::to_string(access.priority_max) +
                                        ", the highest priority that this key may give"}});
}

core::Result<JobPointer> JobService::find_replay(const Submission& submission) {
  std::optional<IdempotencyRow> row;
  {
    auto stored = table_.find_key(key_of(submission));
    if (!stored) {
      return stored.error();
    }
    row = std::move(*stored);
  }
  if (!row || row->created_at < unix_now() - kKeySeconds) {
    return JobPointer();
  }
  auto job = find(row->job, submission.access);
  if (!job) {
    return job.error().code == ErrorCode::kNotFound ? core::Result<JobPointer>(JobPointer()) : job;
  }
  if (row->body_hash != submission.body_hash) {
    return Error{ErrorCode::kConflict,
                 "this Idempotency-Key was used with another body, for job " + row->job, ""};
  }
  return job;
}

core::Result<JobPointer> JobService::find_own_id(const Submission& submission) {
  // Among the jobs of all tenants: an id is taken once.
  auto job = find(submission.id, Access::operators());
  if (!job) {
    return job.error().code == ErrorCode::kNotFound ? core::Result<JobPointer>(JobPointer()) : job;
  }
  if (!submission.access.sees((*job)->tenant())) {
    return find(submission.id, submission.access);
  }
  const auto row = table_.find_key(own_id_key(submission.id));
  if (!row) {
    return row.error();
  }
  if (!*row || (*row)->body_hash != submission.body_hash) {
    return Error{ErrorCode::kConflict,
                 "the job " + submission.id + " is there, and was asked for otherwise", ""};
  }
  return job;
}

api::Parsed<std::unique_lock<core::Mutex>> JobService::take_quota(const std::string& tenant) {
  if (tenant.empty() || options_.quota_jobs == 0) {
    return std::unique_lock<core::Mutex>();
  }
  std::unique_lock<core::Mutex> held(quota_mutex_);
  const auto count = table_.unfinished_of(tenant);
  if (!count) {
    return api::from_error(count.error());
  }
  if (*count < options_.quota_jobs) {
    return api::Parsed<std::unique_lock<core::Mutex>>(std::move(held));
  }
  return api::make_problem(ErrorCode::kTooManyRequests,
                           "the tenant '" + tenant + "' has " + std::to_string(*count) +
                               " unfinished jobs; at most " + std::to_string(options_.quota_jobs) +
                               " are allowed");
}

api::Parsed<JobService::Submitted> JobService::submit(api::ParsedJob request,
                                                      const Submission& submission) {
  std::unique_lock<core::Mutex> keyed;
  if (!submission.key.empty() || !submission.id.empty()) {
    keyed = std::unique_lock<core::Mutex>(keyed_mutex_);
    auto replay = submission.id.empty() ? find_replay(submission) : find_own_id(submission);
    if (!replay) {
      return api::from_error(replay.error());
    }
    if (*replay) {
      return Submitted{.job = std::move(*replay), .is_replay = true};
    }
  }
  if (const auto refused = refused_work()) {
    return api::from_error(*refused);
  }
  if (auto refused = refused_priority(request.spec.priority, submission.access)) {
    return std::move(*refused);
  }
  // Until the record names them, nobody deletes the scene and the asset that are found here.
  const std::shared_lock<std::shared_mutex> naming(scenes_.names_mutex());
  auto checked = check(std::move(request), submission.access);
  if (!checked) {
    return checked.problem();
  }
  const Rank rank = rank_of(checked->spec);
  api::JobView asked;
  asked.spec = checked->spec;
  JobMemory memory = memory_of(asked);
  if (!book_.has_room(rank, memory, submission.access.tenant)) {
    return api::make_problem(ErrorCode::kTooManyRequests, book_.full_text(rank));
  }
  const auto counted = take_quota(submission.access.tenant);
  if (!counted) {
    return counted.problem();
  }
  const std::optional<std::string> preview_key = checked->spec.preview_key;
  auto job = insert(std::move(*checked), submission);
  if (!job) {
    return api::from_error(job.error());
  }
  if (preview_key) {
    supersede(*preview_key, **job, submission.access);
  }
  book_.enqueue(*job, rank, std::move(memory));
  admit();
  return Submitted{.job = std::move(*job), .is_replay = false};
}

core::Result<JobPointer> JobService::insert(api::ParsedJob request, const Submission& submission) {
  JobRecord record;
  record.sequence = ++last_sequence_;
  record.tenant = submission.access.tenant;
  record.view.id = submission.id.empty() ? make_uuid() : submission.id;
  record.view.created_at_unix_seconds = unix_now();
  record.view.spec = std::move(request.spec);
  record.view.warnings = std::move(request.warnings);
  record.view.samples_by_error = request.samples_by_error;
  auto job = std::make_shared<Job>(record, Job::History::kInLog);
  std::vector<Told> told = events_between(*job, JobRecord{}, record);
  std::vector<EventRow> rows;
  const std::uint64_t first = reserve_events(*job, told, rows);
  std::optional<IdempotencyRow> key;
  if (!submission.key.empty() || !submission.id.empty()) {
    key = IdempotencyRow{
        .key = submission.id.empty() ? key_of(submission) : own_id_key(submission.id),
        .body_hash = submission.body_hash,
        .job = record.view.id,
        .created_at = record.view.created_at_unix_seconds};
  }
  JobRow row = to_row(record);
  StorageQuota::Room room = quota_.room(row.tenant, StorageQuota::Kind::kFilm);
  if (!row.tenant.empty() && !job->memory_only()) {
    row.reserved_bytes = FilmFile::disk_bytes_max(*blank_film(record.view));
    if (const Status fits = room.grow_to(row.reserved_bytes); !fits) {
      return Error{fits.error().code, fits.error().message, "/film"};
    }
  }
  {
    // Known before it is stored: whoever finds the id waits for the commit, and gets this very job.
    const core::MutexLock changing(job->change_mutex());
    book_.add(job);
    const Status stored = job->memory_only()
                              ? (key ? table_.insert_key(*key) : core::ok_status())
                              : table_.insert(row, rows, key, deliveries_of(record, told));
    if (!stored) {
      job->set_removed();
      book_.forget(*job);
      return stored.error();
    }
  }
  log_.write(
      LogLevel::kInfo, "job_submitted",
      {{"job", record.view.id}, {"scene", record.view.spec.scene}, {"tenant", record.tenant}});
  publish_events(*job, first, std::move(told));
  return job;
}

void JobService::supersede(const std::string& preview_key, const Job& by, const Access& access) {
  for (const JobPointer& job : book_.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && job->id() != by.id() && access.shares_names_with(job->tenant()) &&
        record.view.spec.preview_key == preview_key && !api::is_final(record.view.state)) {
      static_cast<void>(cancel(job));  // One that has ended meanwhile needs no cancelling.
    }
  }
}

core::Result<std::vector<EventRow>> JobService::stored_events(const Job& job, std::int64_t stream,
                                                              std::uint64_t seq) {
  if (job.memory_only()) {
    return std::vector<EventRow>();
  }
  return table_.events_after(job.sequence(), stream, seq);
}

std::optional<Error> JobService::refused_work() const {
  if (!stopping_ && !draining_) {
    return std::nullopt;
  }
  return Error{
      ErrorCode::kUnavailable,
      stopping_ ? "the server is stopping" : "the server is being drained and takes no new jobs",
      ""};
}

void JobService::set_draining(bool is_draining) {
  if (draining_.exchange(is_draining) != is_draining) {
    log_.write(LogLevel::kWarning, is_draining ? "drain_begun" : "drain_ended", {});
  }
  admit();
}

api::DrainView JobService::drain() const {
  return {.draining = draining_, .running = book_.running_count(), .queued = book_.queue_length()};
}

bool JobService::any_job() const { return last_sequence_ > 0; }

}  // namespace server
