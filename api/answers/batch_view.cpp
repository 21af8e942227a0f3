#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/batch.h"
#include "api/json/schemas.h"
#include "api/json/time_text.h"
#include "api/json/values.h"
#include "api/json/view_rows.h"

namespace api {
namespace {

constexpr std::array kStates = {JobState::kQueued,  JobState::kLoading, JobState::kRendering,
                                JobState::kPaused,  JobState::kFailed,  JobState::kCancelled,
                                JobState::kFinished};

int count(const BatchView& batch, JobState state) {
  return static_cast<int>(std::count_if(batch.jobs.begin(), batch.jobs.end(),
                                        [state](const auto& job) { return job.state == state; }));
}

Json counts_json(const BatchView& batch) {
  Json counts = Json::object();
  for (const JobState state : kStates) {
    counts[std::string(to_text(state))] = count(batch, state);
  }
  return counts;
}

Json counts_shape() {
  Json shape = basic_schema("object", "Jobs in each state.");
  for (const JobState state : kStates) {
    shape["properties"][std::string(to_text(state))] = shape::count();
    shape["required"].push_back(to_text(state));
  }
  shape["additionalProperties"] = false;
  return shape;
}

double fraction(const BatchView& batch) {
  double sum = 0;
  for (const BatchMember& job : batch.jobs) {
    sum += is_final(job.state) ? 1 : job.fraction;
  }
  return batch.jobs.empty() ? 1 : sum / static_cast<double>(batch.jobs.size());
}

Json progress_json(const BatchView& batch) {
  double cpu_seconds = 0;
  for (const BatchMember& job : batch.jobs) {
    cpu_seconds += job.cpu_seconds;
  }
  return {{"fraction", number_json(fraction(batch))}, {"cpu_seconds", number_json(cpu_seconds)}};
}

Json progress_shape() {
  Json shape = basic_schema("object", "Progress of all jobs together.");
  shape["properties"] = {
      {"fraction", shape::real("Mean over the jobs; 1 for jobs that have ended.")},
      {"cpu_seconds", shape::real()}};
  shape["required"] = {"fraction", "cpu_seconds"};
  shape["additionalProperties"] = false;
  return shape;
}

/// Of all pairs of frames whose images were made.
Json flicker_of(const BatchView& batch) {
  std::optional<core::Flicker> sum;
  for (const BatchMember& job : batch.jobs) {
    if (job.flicker) {
      sum = sum.value_or(core::Flicker());
      *sum += *job.flicker;
    }
  }
  return flicker_json(sum);
}

Json links_json(const BatchView& batch) {
  const std::string self = "/v1/batches/" + batch.id;
  return {{"self", self},
          {"archive", self + "/archive.zip"},
          {"sheet", self + "/sheet.png"},
          {"events", "/v1/events?batch=" + batch.id}};
}

const View<BatchMember>& member_view() {
  static const View<BatchMember> kView = {
      "BatchJob",
      "A job of a batch.",
      {{"id", shape::text("Id of the job."), Member<&BatchMember::id>::json},
       {"name", shape::text(), Member<&BatchMember::name>::json},
       {"state", shape::text("State of the job."),
        [](const BatchMember& m) -> Json { return to_text(m.state); }},
       {"fraction", shape::real(),
        [](const BatchMember& m) -> Json { return number_json(m.fraction); }},
       {"revision", shape::count("Number of changes of its image; 0: there is no image yet."),
        Member<&BatchMember::revision>::json},
       {"values", shape::object("Values that the matrix assigned to it."),
        [](const BatchMember& m) { return Json::parse(m.values); }}}};
  return kView;
}

std::vector<ViewRow<BatchView>> common_rows() {
  return {{"id", shape::text(), Member<&BatchView::id>::json},
          {"name", shape::text("The pattern of the jobs' names."), Member<&BatchView::name>::json},
          {"state",
           shape::one_of({"queued", "rendering", "paused", "failed", "cancelled", "finished"},
                         "Once all jobs have ended: failed if any failed or is damaged, otherwise "
                         "cancelled if any was cancelled."),
           [](const BatchView& b) -> Json { return batch_state(b); }},
          {"created_at", shape::time(),
           [](const BatchView& b) -> Json { return rfc3339(b.created_at_unix_seconds); }},
          {"progress", progress_shape(), &progress_json},
          {"counts", counts_shape(), &counts_json},
          {"flicker", shape::nullable(flicker_view().shape()), &flicker_of},
          {"damaged", damaged_shape(), Member<&BatchView::damaged>::json},
          {"links", shape::map(shape::text(), "Paths of related resources."), &links_json}};
}

const View<BatchView>& summary_view() {
  static const View<BatchView> kView = {"BatchSummary", "A batch without its jobs.", common_rows()};
  return kView;
}

const View<BatchView>& batch_view() {
  static const View<BatchView> kView = [] {
    View<BatchView> view = {"Batch", "Jobs that were submitted together.", common_rows()};
    view.rows.push_back({"jobs", shape::list(member_view().shape(), "In the order of the matrix."),
                         [](const BatchView& b) { return print_list(member_view(), b.jobs); }});
    return view;
  }();
  return kView;
}

struct ListView {
  std::span<const BatchView> batches;
  const std::optional<std::string>& next;
};

const View<ListView>& list_view() {
  static const View<ListView> kView = {
      "BatchList",
      "A page of batches.",
      {{"batches", shape::list(summary_view().shape(), "Newest first."),
        [](const ListView& l) { return print_list(summary_view(), l.batches); }},
       {"next", shape::nullable(shape::text("Cursor of the next page; null: the last one.")),
        [](const ListView& l) { return or_null(l.next); }}}};
  return kView;
}

const View<BatchRequest>& plan_view() {
  static const View<BatchRequest> kView = {
      "BatchDryRun",
      "The jobs that a batch would create.",
      {{"names", shape::texts("Names of the jobs, in their order."),
        [](const BatchRequest& request) {
          Json names = Json::array();
          for (const BatchJob& job : request.jobs) {
            names.push_back(job.name);
          }
          return names;
        }}}};
  return kView;
}

}  // namespace

std::string_view batch_state(const BatchView& batch) {
  const auto jobs = static_cast<int>(batch.jobs.size());
  const auto ended = static_cast<int>(std::count_if(
      batch.jobs.begin(), batch.jobs.end(), [](const auto& job) { return is_final(job.state); }));
  if (count(batch, JobState::kQueued) == jobs) {
    return to_text(JobState::kQueued);
  }
  if (ended < jobs) {
    return to_text(count(batch, JobState::kPaused) == jobs - ended ? JobState::kPaused
                                                                   : JobState::kRendering);
  }
  for (const JobState worst : {JobState::kFailed, JobState::kCancelled}) {
    if (count(batch, worst) > 0) {
      return to_text(worst);
    }
  }
  return to_text(JobState::kFinished);
}

std::string batch_json(const BatchView& batch) { return dump(batch_view().print(batch)); }

std::string batch_list_json(std::span<const BatchView> batches,
                            const std::optional<std::string>& next) {
  return dump(list_view().print({batches, next}));
}

std::string batch_dry_run_json(const BatchRequest& request) {
  return dump(plan_view().print(request));
}

std::string batch_webhook_body(double unix_seconds, const BatchView& batch) {
  return dump({{"type", "batch.end"},
               {"timestamp", rfc3339(unix_seconds)},
               {"data", batch_view().print(batch)}});
}

void add_batch_schemas(Json& components) {
  components["BatchRequest"] = as_request(batch_request_schema());
  components["BatchJob"] = member_view().schema();
  components["Batch"] = batch_view().schema();
  components["BatchSummary"] = summary_view().schema();
  components["BatchList"] = list_view().schema();
  components["BatchDryRun"] = plan_view().schema();
}

}  // namespace api
