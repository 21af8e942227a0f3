/// Views of the responses that several files need: printers and schemas in one
/// (api/json/view_rows.h). The others are in their files.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "api/answers/dry_run.h"
#include "api/answers/events.h"
#include "api/answers/job_view.h"
#include "api/answers/objects_view.h"
#include "api/answers/server_view.h"
#include "api/json/view_rows.h"
#include "api/lab.h"
#include "api/problem.h"
#include "core/integrators/registry.h"

namespace api {

struct JobListView {
  std::span<const JobView> jobs;
  std::span<const std::string> damaged;
  const std::optional<std::string>& next;
};
struct TicketView {
  std::string_view ticket;
  double ends_unix_seconds = 0;
  std::span<const std::string> jobs;
};

// api/json/errors.cpp
const View<FieldError>& field_error_view();
const View<Problem>& problem_view();

// api/answers/job_view.cpp
Json job_state_schema();
const View<JobView>& progress_view();
const View<JobView>& error_view();
const View<JobView>& statistics_view();
const View<DenoisedView>& denoised_view();
const View<core::FlickerInterval>& flicker_view();
/// Null if there is no interval.
Json flicker_json(const std::optional<core::Flicker>& flicker);
const View<core::LightNotFound>& light_not_found_view();
const View<JobView>& job_view();
const View<JobListView>& job_list_view();
/// Of lists of jobs: the ids of those that cannot be read.
Json damaged_shape();
/// Rows shared by the events and the job.
const ViewRow<JobView>& state_row();
const ViewRow<JobView>& pause_reason_row();
const ViewRow<JobView>& stop_reason_row();
const ViewRow<JobView>& queue_position_row();
const ViewRow<JobView>& progress_row();
const ViewRow<JobView>& error_estimate_row();
const ViewRow<JobView>& light_not_found_row();
const ViewRow<JobView>& statistics_row();
const ViewRow<JobView>& failure_row();
const ViewRow<JobView>& revision_row();
const ViewRow<JobView>& available_row();
const ViewRow<JobView>& digest_row();
const ViewRow<JobView>& denoised_row();
const View<DryRunView>& dry_run_view();
const View<TicketView>& ticket_view();

// api/answers/scene_view.cpp
const View<core::Warning>& warning_view();
/// Shape of the member `warning_details`.
Json warning_details_shape();
const View<core::PunctualLightDescription>& light_view();

// api/answers/lab_view.cpp
const View<core::lab::Experiment>& experiment_view();

/// Add the schemas of a file's views to the components of the OpenAPI document.
void add_event_schemas(Json& components);
void add_scene_schemas(Json& components);
void add_result_schemas(Json& components);
void add_meter_schemas(Json& components);
void add_comparison_schemas(Json& components);
void add_object_schemas(Json& components);
void add_server_schemas(Json& components);
void add_lab_schemas(Json& components);

}  // namespace api
