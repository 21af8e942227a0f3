#include "server/jobs/job_index.h"

#include <algorithm>
#include <utility>

#include "api/json/values.h"
#include "api/requests.h"
#include "server/jobs/job_record.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;

namespace {

Error unknown_job(const std::string& id) {
  return Error{ErrorCode::kNotFound, "no job has the id \"" + id + "\"", ""};
}

bool matches(const api::JobView& view, const JobQuery& query) {
  if (!query.states.empty() && std::find(query.states.begin(), query.states.end(),
                                         api::to_text(view.state)) == query.states.end()) {
    return false;
  }
  // Every title contains an empty one.
  const auto titled = job_title(view.spec.name, view.spec.scene).find(job_title(query.title, ""));
  return titled != std::string::npos &&
         std::all_of(query.labels.begin(), query.labels.end(), [&](const auto& label) {
           const auto found = view.spec.labels.find(label.first);
           return found != view.spec.labels.end() &&
                  (!label.second || found->second == *label.second);
         });
}

}  // namespace

core::Result<JobPointer> JobIndex::find(const std::string& id, const Access& access) {
  auto job = find(id);
  if (!job && is_damaged(job.error(), id)) {
    const auto row = table_.find(id);
    const bool is_seen = !row || !*row || access.sees((*row)->tenant);
    return is_seen ? job : core::Result<JobPointer>(unknown_job(id));
  }
  const bool is_hidden = job && ((*job)->is_removed() || !access.sees((*job)->tenant()));
  return is_hidden ? core::Result<JobPointer>(unknown_job(id)) : job;
}

core::Result<JobPointer> JobIndex::find(const std::string& id) {
  if (!api::is_uuid(id)) {
    return unknown_job(id);
  }
  if (auto job = book_.find(id)) {
    return job;
  }
  const auto row = table_.find(id);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_job(id);
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
  JobPointer kept = book_.add_final(job);
  if (kept == job) {
    // Another request may have deleted the job since it was read.
    const auto still = table_.find(id);
    if (!still || !*still || (*still)->sequence != job->sequence()) {
      book_.forget(*job);
      return still ? unknown_job(id) : still.error();
    }
  }
  return kept;
}

api::JobView JobIndex::view(const Job& job) const {
  // Reads the run first: once it is gone, the record has its final figures.
  const auto run = job.run();
  const JobRecord record = job.record();
  api::JobView view = record.view;
  view.film_is_evicted = record.film == FilmPlace::kEvicted;
  if (run && !api::is_final(view.state)) {
    view.progress = run->task().progress();
    view.peak_bytes = run->peak_bytes();
  }
  view.denoised = job.denoised();
  view.is_denoising = job.is_denoising();
  if (view.state == JobState::kQueued) {
    view.queue_position = book_.position(job);
  }
  return view;
}

core::Result<JobIndex::Page> JobIndex::list(JobQuery query, const Access& access) {
  if (!access.sees_all()) {
    query.tenant = access.tenant;
  }
  JobQuery more = query;
  more.limit = query.limit + 1;
  const auto rows =
      query.stored ? table_.list(more) : core::Result<std::vector<JobRow>>(std::vector<JobRow>());
  if (!rows) {
    return rows.error();
  }
  struct Found {
    std::int64_t sequence = 0;
    std::string id;
    std::optional<api::JobView> view;  ///< Empty: its record is damaged.
    bool is_listed = true;             ///< False: it has changed since it was stored.
  };
  std::vector<Found> found;
  for (const JobRow& row : *rows) {
    if (const auto job = book_.find(row.id)) {
      api::JobView now = view(*job);
      const bool is_listed = matches(now, query);
      found.push_back({row.sequence, row.id, std::move(now), is_listed});
    } else if (auto record = to_record(row)) {
      record->view.film_is_evicted = record->film == FilmPlace::kEvicted;
      found.push_back({row.sequence, row.id, std::move(record->view)});
    } else {
      found.push_back({row.sequence, row.id, std::nullopt});
    }
  }
  for (const JobPointer& job : book_.all()) {
    if (query.previews && job->memory_only() && access.sees(job->tenant()) &&
        (!query.before || job->sequence() < *query.before)) {
      api::JobView preview = view(*job);
      if (matches(preview, query)) {
        found.push_back({job->sequence(), job->id(), std::move(preview)});
      }
    }
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.sequence > b.sequence; });
  Page page;
  if (static_cast<int>(found.size()) > query.limit) {
    found.resize(static_cast<std::size_t>(query.limit));
    page.next = found.back().sequence;
  }
  for (Found& each : found) {
    if (!each.is_listed) {
      continue;
    }
    if (each.view) {
      page.jobs.push_back(*std::move(each.view));
    } else {
      page.damaged.push_back(std::move(each.id));
    }
  }
  return page;
}

core::Result<bool> JobIndex::needs_scene(const std::string& scene,
                                         const std::optional<std::string>& tenant) {
  for (const JobPointer& job : book_.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && (!tenant || *tenant == job->tenant()) &&
        record.view.spec.scene == scene && !api::is_final(record.view.state)) {
      return true;
    }
  }
  return table_.scene_in_use(scene, tenant);
}

core::Result<bool> JobIndex::needs_asset(const std::string& asset,
                                         const std::optional<std::string>& tenant) {
  for (const JobPointer& job : book_.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && (!tenant || *tenant == job->tenant()) &&
        record.view.spec.environment_asset == asset && !api::is_final(record.view.state)) {
      return true;
    }
  }
  return table_.environment_in_use(asset, tenant);
}

}  // namespace server
