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

/// In the table of idempotency keys, whose other keys begin with the id of a bearer key or a space.
std::string own_id_key(const std::string& id) { return "put " + id; }

int threads_or_machine(int threads) {
  return threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

}  // namespace

JobService::JobService(JobServiceParts parts, JobServiceOptions options, std::int64_t run)
    : table_(parts.table),
      scenes_(parts.scenes),
      data_(parts.data),
      log_(parts.log),
      metrics_(parts.metrics),
      quota_(parts.quota),
      options_(options),
      run_(run),
      pilots_(kPilotsAtATime),
      book_(options.book),
      films_(options.film_cache_bytes, SingleFlightCache<StoredFilm>::Oversized::kNotKept),
      film_readers_(options.film_cache_bytes + options.film_readers_bytes),
      scheduler_(threads_or_machine(options.threads)),
      loaders_(2),
      preview_loaders_(1),
      savers_(2),
      checkpointer_([this](const std::stop_token& stop) { checkpoint_loop(stop); }) {}

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
  for (const JobRow& row : *rows) {
    auto record = to_record(row);
    if (!record) {
      log_.write(LogLevel::kError, "job_unreadable",
                 {{"job", row.id}, {"detail", record.error().message}});
      continue;
    }
    const JobState state = record->view.state;
    const Rank rank = rank_of(record->view.spec);
    auto job = std::make_shared<Job>(std::move(*record), Job::History::kInLog);
    book_.add(job);
    if (state == JobState::kPaused) {
      continue;
    }
    const Status queued = change(
        *job,
        [](JobRecord& changed) {
          changed.view.state = JobState::kQueued;
          return core::ok_status();
        },
        {.go_on_in_memory = true});
    if (queued) {
      book_.enqueue(job, rank, memory_of(job->record().view));
    }
  }
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
  for (const JobPointer& job : book_.all()) {
    if (job->run() != nullptr && !api::is_final(job->state())) {
      checkpoint(job);
    }
    job->set_run(nullptr);  // A run and its job hold each other's parts.
  }
}

std::vector<JobService::Told> JobService::events_between(const JobRecord& before,
                                                         const JobRecord& after) const {
  std::vector<Told> told;
  api::JobView view = after.view;
  view.queue_position = book_.position(view.id);
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
  const JobRecord before = job.record();
  JobRecord after = before;
  if (auto modified = modify(after); !modified) {
    return modified;
  }
  if (!may_change(before.view.state, after.view.state)) {
    return Error{ErrorCode::kConflict,
                 "the job is " + std::string(api::to_text(before.view.state)) + " and cannot become " +
                     std::string(api::to_text(after.view.state)),
                 ""};
  }
  std::vector<Told> told = events_between(before, after);
  std::vector<EventRow> rows;
  const std::uint64_t first = reserve_events(job, told, rows);
  if (!job.memory_only()) {
    const Status stored = table_.update(to_row(after), rows, deliveries_of(after.view, told));
    if (!stored) {
      log_.write(LogLevel::kError, "store_failed",
                 {{"job", job.id()}, {"detail", stored.error().message}});
      if (!options.go_on_in_memory) {
        job.log().drop(first, static_cast<int>(told.size()));
        return stored;
      }
    }
  }
  if (!told.empty() && told.back().type == api::EventType::kEnd) {
    job.set_end_mark(EndMark{.stream = run_, .seq = first + told.size() - 1});
  }
  job.set_record(after);
  if (options.before_telling) {
    options.before_telling(after);
  }
  if (before.view.state != after.view.state) {
    log_.write(LogLevel::kInfo, "job_state",
               {{"job", job.id()}, {"state", api::to_text(after.view.state)},
                {"stop_reason", api::to_text(after.view.stop_reason)}});
  }
  publish_events(job, first, std::move(told));
  return core::ok_status();
}

api::Parsed<api::ParsedJob> JobService::check(api::ParsedJob request) {
  auto facts = scenes_.facts(request.spec.scene);
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
  if (auto reason = too_large(asked)) {
    return api::make_problem(ErrorCode::kInvalidArgument, {api::FieldError{"/film", std::move(*reason)}});
  }
  if (request.spec.environment_asset) {
    if (const auto usable = scenes_.check_environment(*request.spec.environment_asset); !usable) {
      return api::from_error(usable.error());
    }
  }
  if (auto warning = api::settle_environment(request.spec, *facts)) {
    request.warnings.push_back(std::move(*warning));
  }
  const std::vector<std::string> more = api::adaptive_warnings(request.spec);
  request.warnings.insert(request.warnings.end(), more.begin(), more.end());
  return request;
}

core::Result<JobPointer> JobService::find_replay(const Submission& submission) {
  std::optional<IdempotencyRow> row;
  {
    auto stored = table_.find_key(submission.key);
    if (!stored) {
      return stored.error();
    }
    row = std::move(*stored);
  }
  if (!row || row->created_at < unix_now() - kKeySeconds) {
    return JobPointer();
  }
  auto job = find(row->job);
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
  auto job = find(submission.id);
  if (!job) {
    return job.error().code == ErrorCode::kNotFound ? core::Result<JobPointer>(JobPointer()) : job;
  }
  const auto row = table_.find_key(own_id_key(submission.id));
  if (!row) {
    return row.error();
  }
  if (!*row || (*row)->body_hash != submission.body_hash) {
    return Error{ErrorCode::kConflict, "the job " + submission.id + " is there, and was asked for otherwise",
                 ""};
  }
  return job;
}

api::Parsed<std::unique_lock<core::Mutex>> JobService::take_quota(const std::string& owner) {
  if (owner.empty() || options_.quota_jobs == 0) {
    return std::unique_lock<core::Mutex>();
  }
  std::unique_lock<core::Mutex> held(quota_mutex_);
  const auto count = table_.unfinished_of(owner);
  if (!count) {
    return api::from_error(count.error());
  }
  if (*count < options_.quota_jobs) {
    return api::Parsed<std::unique_lock<core::Mutex>>(std::move(held));
  }
  return api::make_problem(ErrorCode::kTooManyRequests,
                           "the key '" + owner + "' has " + std::to_string(*count) +
                               " unfinished jobs; at most " + std::to_string(options_.quota_jobs) +
                               " are allowed");
}

api::Parsed<JobService::Submitted> JobService::submit(api::ParsedJob request,
                                                      const Submission& submission) {
  if (stopping_) {
    return api::make_problem(ErrorCode::kUnavailable, "the server is stopping");
  }
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
  // Until the record names them, nobody deletes the scene and the asset that are found here.
  const std::shared_lock<std::shared_mutex> naming(scenes_.names_mutex());
  auto checked = check(std::move(request));
  if (!checked) {
    return checked.problem();
  }
  const Rank rank = rank_of(checked->spec);
  api::JobView asked;
  asked.spec = checked->spec;
  JobMemory memory = memory_of(asked);
  if (!book_.has_room(rank, memory, submission.owner)) {
    return api::make_problem(ErrorCode::kTooManyRequests, book_.full_text(rank));
  }
  const auto counted = take_quota(submission.owner);
  if (!counted) {
    return counted.problem();
  }
  const std::optional<std::string> preview_key = checked->spec.preview_key;
  auto job = insert(std::move(*checked), submission);
  if (!job) {
    return api::from_error(job.error());
  }
  if (preview_key) {
    supersede(*preview_key, (*job)->id());
  }
  book_.enqueue(*job, rank, std::move(memory));
  admit();
  return Submitted{.job = std::move(*job), .is_replay = false};
}

core::Result<JobPointer> JobService::insert(api::ParsedJob request, const Submission& submission) {
  JobRecord record;
  record.sequence = ++last_sequence_;
  record.view.id = submission.id.empty() ? make_uuid() : submission.id;
  record.view.created_at_unix_seconds = unix_now();
  record.view.spec = std::move(request.spec);
  record.view.warnings = std::move(request.warnings);
  record.view.samples_by_error = request.samples_by_error;
  auto job = std::make_shared<Job>(record, Job::History::kInLog, submission.owner);
  std::vector<Told> told = events_between(JobRecord{}, record);
  std::vector<EventRow> rows;
  const std::uint64_t first = reserve_events(*job, told, rows);
  std::optional<IdempotencyRow> key;
  if (!submission.key.empty() || !submission.id.empty()) {
    key = IdempotencyRow{.key = submission.id.empty() ? submission.key : own_id_key(submission.id),
                         .body_hash = submission.body_hash,
                         .job = record.view.id,
                         .created_at = record.view.created_at_unix_seconds};
  }
  JobRow row = to_row(record);
  row.owner = submission.owner;
  StorageQuota::Room room = quota_.room(row.owner, StorageQuota::Kind::kFilm);
  if (!row.owner.empty() && !job->memory_only()) {
    row.reserved_bytes = FilmFile::disk_bytes_max(*blank_film(record.view));
    if (const Status fits = room.grow_to(row.reserved_bytes); !fits) {
      return Error{fits.error().code, fits.error().message, "/film"};
    }
  }
  const Status stored = job->memory_only()
                            ? (key ? table_.insert_key(*key) : core::ok_status())
                            : table_.insert(row, rows, key, deliveries_of(record.view, told));
  if (!stored) {
    return stored.error();
  }
  book_.add(job);
  log_.write(LogLevel::kInfo, "job_submitted",
             {{"job", record.view.id}, {"scene", record.view.spec.scene}, {"key", submission.owner}});
  publish_events(*job, first, std::move(told));
  return job;
}

void JobService::supersede(const std::string& preview_key, const std::string& by) {
  for (const JobPointer& job : book_.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && job->id() != by && record.view.spec.preview_key == preview_key &&
        !api::is_final(record.view.state)) {
      static_cast<void>(cancel(job));  // One that has ended meanwhile needs no cancelling.
    }
  }
}

core::Result<JobPointer> JobService::find(const std::string& id) {
  const Error unknown{ErrorCode::kNotFound, "no job has the id \"" + id + "\"", ""};
  if (!api::is_uuid(id)) {
    return unknown;
  }
  if (auto job = book_.find(id)) {
    return job;
  }
  const auto row = table_.find(id);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown;
  }
  auto record = to_record(**row);
  if (!record) {
    return record.error();
  }
  auto job = std::make_shared<Job>(std::move(*record), Job::History::kInStore);
  const auto events = table_.events_after((*row)->sequence, 0, 0);
  if (!events) {
    return events.error();
  }
  for (const EventRow& event : *events) {
    if (event.type == api::to_text(api::EventType::kEnd)) {
      job->set_end_mark(EndMark{.stream = event.stream, .seq = event.seq});
    }
  }
  return book_.add_final(job);
}

api::JobView JobService::view(const Job& job) const {
  // The run first: when it is gone, the record has its last figures.
  const auto run = job.run();
  api::JobView view = job.record().view;
  if (run && !api::is_final(view.state)) {
    view.progress = progress_of(*run);
    view.peak_bytes = run->peak_bytes();
  }
  if (view.state == JobState::kQueued) {
    view.queue_position = book_.position(view.id);
  }
  return view;
}

core::Result<JobService::Page> JobService::list(const JobQuery& query) {
  JobQuery more = query;
  more.limit = query.limit + 1;
  const auto rows = query.stored ? table_.list(more) : core::Result<std::vector<JobRow>>(std::vector<JobRow>());
  if (!rows) {
    return rows.error();
  }
  std::vector<std::pair<std::int64_t, api::JobView>> found;
  for (const JobRow& row : *rows) {
    if (const auto job = book_.find(row.id)) {
      found.emplace_back(row.sequence, view(*job));
    } else if (auto record = to_record(row)) {
      found.emplace_back(row.sequence, std::move(record->view));
    }
  }
  for (const JobPointer& job : book_.all()) {
    if (query.previews && job->memory_only() && (!query.before || job->sequence() < *query.before)) {
      api::JobView preview = view(*job);
      if (matches(preview, query)) {
        found.emplace_back(job->sequence(), std::move(preview));
      }
    }
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first > b.first; });
  Page page;
  for (auto& [sequence, view] : found) {
    if (static_cast<int>(page.jobs.size()) == query.limit) {
      break;
    }
    page.jobs.push_back(std::move(view));
    page.next = sequence;
  }
  if (found.size() <= page.jobs.size()) {
    page.next.reset();
  }
  return page;
}

bool JobService::matches(const api::JobView& view, const JobQuery& query) {
  if (!query.states.empty() &&
      std::find(query.states.begin(), query.states.end(), api::to_text(view.state)) == query.states.end()) {
    return false;
  }
  // An empty title is part of every one.
  const auto titled = job_title(view.spec.name, view.spec.scene).find(job_title(query.title, ""));
  return titled != std::string::npos && std::all_of(query.labels.begin(), query.labels.end(), [&](const auto& label) {
    const auto found = view.spec.labels.find(label.first);
    return found != view.spec.labels.end() && (!label.second || found->second == *label.second);
  });
}

core::Result<std::vector<EventRow>> JobService::stored_events(const Job& job, std::int64_t stream,
                                                              std::uint64_t seq) {
  if (job.memory_only()) {
    return std::vector<EventRow>();
  }
  return table_.events_after(job.sequence(), stream, seq);
}

bool JobService::any_job() const { return last_sequence_ > 0; }

}  // namespace server
