#include "server/jobs/batch_service.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "api/json/errors.h"
#include "server/jobs/job_record.h"
#include "server/observe/clock.h"
#include "server/store/key_table.h"
#include "server/store/uuid.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

/// Returns the key in the table of idempotency keys, which also holds the keys of jobs.
std::string stored_key(const Access& access, const std::string& key) {
  return "batch of " + access.tenant + " " + key;
}

}  // namespace

BatchService::BatchService(JobService& jobs, JobTable& keys, BatchTable& table, Log& log)
    : jobs_(jobs), keys_(keys), table_(table), log_(log) {
  jobs_.journal().on_state([this](const Job& job, api::JobState state) {
    if (api::is_final(state)) {
      report_ends(job.id());
    }
  });
}

BatchService::~BatchService() {
  jobs_.stop();  // Jobs still run if the server failed to start.
  jobs_.journal().forget_listeners();
}

std::optional<api::Problem> BatchService::check(const api::BatchRequest& request,
                                                const Access& access) {
  for (const api::BatchJob& job : request.jobs) {
    const auto checked = jobs_.check(job.job, access);
    if (!checked) {
      return api::batch_problem(checked.problem(), job);
    }
  }
  return std::nullopt;
}

core::Result<std::optional<BatchRow>> BatchService::find_replay(const std::string& key,
                                                                const std::string& body_hash,
                                                                const Access& access) {
  const auto row = keys_.find_key(stored_key(access, key));
  if (!row) {
    return row.error();
  }
  if (!*row || (*row)->created_at < unix_now() - kKeySeconds) {
    return std::optional<BatchRow>();
  }
  auto batch = table_.find((*row)->job, access);
  if (!batch) {
    return batch.error().code == ErrorCode::kNotFound
               ? core::Result<std::optional<BatchRow>>(std::optional<BatchRow>())
               : batch.error();
  }
  if ((*row)->body_hash != body_hash) {
    return Error{ErrorCode::kConflict,
                 "this Idempotency-Key was used with another body, for batch " + batch->id, ""};
  }
  return std::optional<BatchRow>(*std::move(batch));
}

api::Parsed<BatchService::Submitted> BatchService::submit(api::BatchRequest request,
                                                          const Access& access,
                                                          const std::string& key,
                                                          const std::string& body_hash) {
  std::unique_lock<core::Mutex> keyed;
  if (!key.empty()) {
    keyed = std::unique_lock<core::Mutex>(keyed_mutex_);
    const auto replay = find_replay(key, body_hash, access);
    if (!replay) {
      return api::from_error(replay.error());
    }
    if (*replay) {
      auto made = view_of(**replay);
      return made ? api::Parsed<Submitted>(Submitted{*std::move(made), true})
                  : api::from_error(made.error());
    }
  }
  if (auto refused = check(request, access)) {
    return *std::move(refused);
  }
  const BatchRow row{.id = make_uuid(),
                     .tenant = access.tenant,
                     .name = request.name,
                     .webhook = request.webhook ? request.webhook->url : "",
                     .created_at = unix_now()};
  std::vector<std::string> values;
  std::vector<api::ParsedJob> jobs;
  for (api::BatchJob& job : request.jobs) {
    values.push_back(std::move(job.values));
    jobs.push_back(std::move(job.job));
  }
  JobService::Together together;
  together.access = access;
  if (!key.empty()) {
    together.key = IdempotencyRow{.key = stored_key(access, key),
                                  .body_hash = body_hash,
                                  .job = row.id,
                                  .created_at = row.created_at};
  }
  together.beside = [&](Database::Session& session, const std::vector<std::int64_t>& sequences) {
    return BatchTable::insert(session, row, sequences, values);
  };
  if (auto made = jobs_.submit_together(std::move(jobs), together); !made) {
    return made.problem();
  }
  auto made = view(row.id, access);
  return made ? api::Parsed<Submitted>(Submitted{*std::move(made), false})
              : api::from_error(made.error());
}

core::Result<std::vector<JobPointer>> BatchService::jobs_of(const BatchRow& batch) {
  const auto rows = table_.jobs(batch);
  if (!rows) {
    return rows.error();
  }
  std::vector<JobPointer> jobs;
  for (const BatchJobRow& row : *rows) {
    auto job = jobs_.index().find(row.id);
    if (job) {
      jobs.push_back(*std::move(job));
    } else if (job.error().code != ErrorCode::kNotFound && !is_damaged(job.error(), row.id)) {
      return job.error();
    }
  }
  return jobs;
}

core::Result<api::BatchView> BatchService::view_of(const BatchRow& batch) {
  const auto rows = table_.jobs(batch);
  if (!rows) {
    return rows.error();
  }
  api::BatchView view{
      .id = batch.id, .name = batch.name, .created_at_unix_seconds = batch.created_at, .jobs = {}};
  for (const BatchJobRow& row : *rows) {
    const auto job = jobs_.index().find(row.id);
    if (!job && job.error().code == ErrorCode::kNotFound) {
      continue;  // Deleted in the meantime.
    }
    if (!job && !is_damaged(job.error(), row.id)) {
      return job.error();
    }
    if (!job) {
      view.damaged.push_back(row.id);
      view.jobs.push_back(
          {.id = row.id, .name = "", .values = row.values, .state = api::JobState::kFailed});
      continue;
    }
    const api::JobView now = jobs_.view(**job);
    view.jobs.push_back({.id = row.id,
                         .name = now.spec.name,
                         .values = row.values,
                         .state = now.state,
                         .fraction = now.progress.fraction,
                         .revision = now.progress.revision,
                         .cpu_seconds = now.progress.cpu_seconds,
                         .flicker = now.denoised ? now.denoised->flicker : std::nullopt});
  }
  return view;
}

core::Result<api::BatchView> BatchService::view(std::string_view id, const Access& access) {
  const auto batch = table_.find(id, access);
  return batch ? view_of(*batch) : batch.error();
}

core::Result<std::vector<JobPointer>> BatchService::jobs(std::string_view id,
                                                         const Access& access) {
  const auto batch = table_.find(id, access);
  return batch ? jobs_of(*batch) : batch.error();
}

core::Result<BatchService::Page> BatchService::list(std::optional<std::int64_t> before, int limit,
                                                    const Access& access) {
  const auto rows = table_.list(before, limit + 1, access);
  if (!rows) {
    return rows.error();
  }
  Page page;
  for (const BatchRow& row : *rows) {
    if (static_cast<int>(page.batches.size()) == limit) {
      page.next = (*rows)[static_cast<std::size_t>(limit) - 1].sequence;
      break;
    }
    auto view = view_of(row);
    if (!view) {
      return view.error();
    }
    page.batches.push_back(*std::move(view));
  }
  return page;
}

Verdict BatchService::cancel(std::string_view id, const Access& access) {
  const auto found = jobs(id, access);
  if (!found) {
    return found.error();
  }
  // Cancels in reverse order: otherwise queued jobs would start one after another.
  for (auto job = found->rbegin(); job != found->rend(); ++job) {
    if (auto cancelled = jobs_.cancel(*job); !cancelled && !cancelled.is(ErrorCode::kNotFound)) {
      return cancelled;
    }
  }
  return {};
}

Verdict BatchService::retry(std::string_view id, const Access& access) {
  const auto batch = table_.find(id, access);
  if (!batch) {
    return batch.error();
  }
  const auto found = jobs_of(*batch);
  if (!found) {
    return found.error();
  }
  bool any = false;
  for (const JobPointer& job : *found) {
    const api::JobView view = job->record().view;
    if (view.state != api::JobState::kFailed && !can_begin_again(view)) {
      continue;
    }
    if (const auto reopened = table_.reopen(*batch); !reopened) {
      return reopened.error();
    }
    if (auto retried = jobs_.retry(job); !retried) {
      return retried;
    }
    any = true;
  }
  return any ? Verdict()
             : Error{ErrorCode::kConflict, "no job of the batch has failed or is doubted", ""};
}

Verdict BatchService::remove(std::string_view id, const Access& access) {
  const auto batch = table_.find(id, access);
  const auto rows =
      batch ? table_.jobs(*batch) : core::Result<std::vector<BatchJobRow>>(batch.error());
  if (!rows) {
    return rows.error();
  }
  for (const BatchJobRow& row : *rows) {
    const auto job = jobs_.index().find(row.id);
    if (job && !api::is_final((*job)->state())) {
      return Error{ErrorCode::kConflict, "job " + row.id + " has not ended: cancel the batch first",
                   ""};
    }
  }
  for (const BatchJobRow& row : *rows) {
    if (auto removed = jobs_.remove(row.id, Access::operators());
        !removed && !removed.is(ErrorCode::kNotFound)) {
      return removed;
    }
  }
  return {};
}

void BatchService::report_ends(const std::optional<std::string>& job) {
  const auto ended = table_.ended(job);
  for (const BatchRow& batch : ended ? *ended : std::vector<BatchRow>()) {
    const auto view = view_of(batch);
    // A job whose end is stored but not published yet reports the batch itself.
    if (view &&
        !std::all_of(view->jobs.begin(), view->jobs.end(),
                     [](const api::BatchMember& each) { return api::is_final(each.state); })) {
      continue;
    }
    const double now = unix_now();
    const core::Status reported =
        view ? table_.report_end(batch, DeliveryRow{.id = "msg_" + random_hex(12),
                                                    .tenant = batch.tenant,
                                                    .job = batch.id,
                                                    .event = "end",
                                                    .url = batch.webhook,
                                                    .body = api::batch_webhook_body(now, *view),
                                                    .created_at = now,
                                                    .next_at = now})
             : core::Status(view.error());
    if (!reported) {
      log_.write(LogLevel::kError, "store_failed",
                 {{"batch", batch.id}, {"detail", reported.error().message}});
    }
  }
}

}  // namespace server
