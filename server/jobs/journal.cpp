#include "server/jobs/journal.h"

#include <algorithm>

#include "api/answers/events.h"
#include "server/observe/clock.h"
#include "server/store/key_table.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

std::vector<Journal::News> Journal::news_between(const Job& job, const JobRecord& before,
                                                 const JobRecord& after) const {
  std::vector<News> news;
  api::JobView view = after.view;
  view.queue_position = book_.position(job);
  if (before.view.state != view.state || before.view.spec_version != view.spec_version ||
      before.view.created_at_unix_seconds == 0) {
    news.push_back({api::EventType::kState, api::state_event(view)});
  }
  for (const std::string& warning : new_warnings(before.view, view)) {
    news.push_back({api::EventType::kWarning, api::warning_event(warning)});
  }
  if (api::is_final(view.state) && !api::is_final(before.view.state)) {
    news.push_back({api::EventType::kEnd, api::end_event(view)});
  }
  return news;
}

std::uint64_t Journal::reserve(Job& job, const std::vector<News>& news,
                               std::vector<EventRow>& rows) const {
  const std::uint64_t first = job.log().reserve(static_cast<int>(news.size()));
  for (std::size_t i = 0; i < news.size(); ++i) {
    rows.push_back(EventRow{.stream = run_,
                            .seq = first + i,
                            .type = std::string(api::to_text(news[i].type)),
                            .data = news[i].data});
  }
  return first;
}

void Journal::publish(Job& job, std::uint64_t first, std::vector<News> news) {
  std::vector<LoggedEvent> events;
  for (std::size_t i = 0; i < news.size(); ++i) {
    LoggedEvent event;
    event.seq = first + i;
    event.type = news[i].type;
    event.data = std::move(news[i].data);
    events.push_back(std::move(event));
  }
  job.log().publish(std::move(events));
}

std::vector<DeliveryRow> Journal::deliveries_of(const JobRecord& record,
                                                const std::vector<News>& news) {
  const api::JobView& view = record.view;
  std::vector<DeliveryRow> deliveries;
  if (!view.spec.webhook) {
    return deliveries;
  }
  const std::vector<std::string>& wanted = view.spec.webhook->events;
  for (const News& event : news) {
    if (std::find(wanted.begin(), wanted.end(), api::to_text(event.type)) != wanted.end()) {
      const double now = unix_now();
      deliveries.push_back(DeliveryRow{.id = "msg_" + random_hex(12),
                                       .tenant = record.tenant,
                                       .job = view.id,
                                       .event = std::string(api::to_text(event.type)),
                                       .url = view.spec.webhook->url,
                                       .body = api::webhook_body(event.type, now, view),
                                       .created_at = now,
                                       .next_at = now});
    }
  }
  return deliveries;
}

void Journal::note_end(Job& job, std::uint64_t first, const std::vector<News>& news) const {
  if (!news.empty() && news.back().type == api::EventType::kEnd) {
    job.set_end_mark(EndMark{.stream = run_, .seq = first + news.size() - 1});
  }
}

Journal::Journal(JobTable& table, const JobBook& book, Log& log, Metrics& metrics, std::int64_t run)
    : table_(table), book_(book), log_(log), metrics_(metrics), run_(run) {
  for (int reason = 1; reason <= static_cast<int>(core::StopReason::kFailed); ++reason) {
    metrics_.expect_job_end(api::to_text(static_cast<core::StopReason>(reason)));
  }
}

Verdict Journal::change(Job& job, const Modify& modify, const Options& options) {
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
  std::vector<News> news = news_between(job, before, after);
  std::vector<EventRow> rows;
  const std::uint64_t first = reserve(job, news, rows);
  if (!job.memory_only()) {
    const Status stored = table_.update(to_row(after), rows, deliveries_of(after, news));
    if (!stored) {
      log_.write(LogLevel::kError, "store_failed",
                 {{"job", job.id()}, {"detail", stored.error().message}});
      const bool is_full = stored.error().code == ErrorCode::kNoSpace;
      if (options.unstored == Unstored::kRefused ||
          (options.unstored == Unstored::kRefusedIfFull && is_full)) {
        job.log().drop(first, static_cast<int>(news.size()));
        return stored.error();
      }
    }
  }
  note_end(job, first, news);
  if (api::is_final(after.view.state) && !api::is_final(before.view.state)) {
    metrics_.count_job_end(api::to_text(after.view.stop_reason));
  }
  job.set_record(after);
  if (options.before_publishing) {
    options.before_publishing(after);
  }
  if (before.view.state != after.view.state) {
    log_.write(LogLevel::kInfo, "job_state",
               {{"job", job.id()},
                {"state", api::to_text(after.view.state)},
                {"pause_reason", api::to_text(after.view.pause_reason)},
                {"stop_reason", api::to_text(after.view.stop_reason)}});
  }
  publish(job, first, std::move(news));
  if (before.view.state != after.view.state) {
    for (const auto& listener : on_state_) {
      listener(job, after.view.state);
    }
  }
  return {};
}

void Journal::change_together(std::vector<std::pair<JobPointer, JobRecord>> changes) {
  std::vector<JobTable::Change> rows;
  std::vector<std::pair<std::uint64_t, std::vector<News>>> told;
  for (auto& [job, after] : changes) {
    std::vector<News> news = news_between(*job, job->record(), after);
    std::vector<EventRow> events;
    const std::uint64_t first = reserve(*job, news, events);
    rows.push_back({.row = to_row(after),
                    .events = std::move(events),
                    .deliveries = deliveries_of(after, news)});
    told.emplace_back(first, std::move(news));
    job->set_record(std::move(after));
  }
  if (const Status stored = table_.update(rows); !stored) {
    log_.write(LogLevel::kError, "store_failed", {{"detail", stored.error().message}});
  }
  for (std::size_t i = 0; i < changes.size(); ++i) {
    publish(*changes[i].first, told[i].first, std::move(told[i].second));
  }
}

Status Journal::enter(Job& job, const Beside& beside) {
  const JobRecord record = job.record();
  std::vector<News> news = news_between(job, JobRecord{}, record);
  std::vector<EventRow> events;
  const std::uint64_t first = reserve(job, news, events);
  Status stored = core::ok_status();
  if (!job.memory_only()) {
    JobRow row = to_row(record);
    row.reserved_bytes = beside.reserved_bytes;
    stored = table_.insert(row, events, beside.key, deliveries_of(record, news));
  } else if (beside.key) {
    stored = table_.insert_key(*beside.key);
  }
  if (!stored) {
    return stored;
  }
  note_end(job, first, news);
  publish(job, first, std::move(news));
  return core::ok_status();
}

Status Journal::enter_together(const std::vector<JobPointer>& jobs,
                               const std::vector<std::uint64_t>& reserved_bytes,
                               const std::optional<IdempotencyRow>& key,
                               const JobTable::Beside& beside) {
  std::vector<JobTable::Insertion> rows;
  std::vector<std::pair<std::uint64_t, std::vector<News>>> told;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const JobRecord record = jobs[i]->record();
    std::vector<News> news = news_between(*jobs[i], JobRecord{}, record);
    JobTable::Insertion& row = rows.emplace_back();
    row.row = to_row(record);
    row.row.reserved_bytes = reserved_bytes[i];
    row.deliveries = deliveries_of(record, news);
    const std::uint64_t first = reserve(*jobs[i], news, row.events);
    told.emplace_back(first, std::move(news));
  }
  if (Status stored = table_.insert(rows, key, beside); !stored) {
    return stored;
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    publish(*jobs[i], told[i].first, std::move(told[i].second));
  }
  return core::ok_status();
}

core::Result<std::vector<EventRow>> Journal::events_after(const Job& job, std::int64_t stream,
                                                          std::uint64_t seq) {
  if (job.memory_only()) {
    return std::vector<EventRow>();
  }
  return table_.events_after(job.sequence(), stream, seq);
}

}  // namespace server
