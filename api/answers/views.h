/// Views of the responses: printers and schemas in one (api/json/view_rows.h). Those with a
/// component name are listed in api/answers/view_schemas.cpp.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

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
struct TileEventView {
  std::string_view job_id;
  const TileEvent& tile;
};
struct WebhookView {
  EventType type = EventType::kEnd;
  double unix_seconds = 0;
  const JobView& job;
};
struct OverloadedView {
  int retry_after_seconds = 0;
};
struct CameraView {
  std::size_t index = 0;
  const core::CameraDescription& camera;
  core::Place origin;  ///< of the scene
};
struct SceneView {
  std::string_view id;
  const core::SceneSummary& summary;
};
struct SceneListView {
  std::span<const std::string> scenes;  ///< texts of scene_json()
  const std::optional<std::string>& next;
};
struct AssetView {
  std::string_view id;
  std::uint64_t bytes = 0;
};
struct ConvergenceView {
  std::span<const core::ConvergencePoint> points;
};
/// A point of two meters.
struct MeterPairView {
  const core::MeterReading& a;
  const core::MeterReading& b;
};
struct MeterComparisonView {
  const MeterOfJob& a;
  const MeterOfJob& b;
};
/// A name from a registry that requests may use.
struct TypeView {
  std::string_view type;
  std::string_view bias;
  std::string_view summary;
  std::vector<std::string> accepts;  ///< JSON pointers of the job request that it supports
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

// api/answers/events.cpp
const View<JobView>& state_event_view();
const View<JobView>& progress_event_view();
const View<JobView>& end_event_view();
const View<TileEventView>& tile_event_view();
const View<std::string_view>& warning_event_view();
const View<std::string_view>& reset_event_view();
const View<OverloadedView>& overloaded_event_view();
const View<WebhookView>& webhook_view();

// api/answers/scene_view.cpp
const View<core::Warning>& warning_view();
/// Shape of the member `warning_details`.
Json warning_details_shape();
const View<CameraView>& camera_view();
const View<core::PunctualLightDescription>& light_view();
const View<SceneView>& scene_view();
const View<SceneListView>& scene_list_view();
const View<AssetView>& asset_view();

// api/answers/result_view.cpp
const View<core::ConvergencePoint>& curve_point_view();
const View<PixelLayer>& pixel_layer_view();
const View<ConvergenceView>& convergence_view();
const View<PixelView>& pixel_view();
const View<core::MeterReading>& meter_reading_view();
const View<MeterOfJob>& meter_view();
const View<MeterOfJob>& meter_figures_view();
const View<MeterPairView>& meter_pair_view();
const View<MeterComparisonView>& meter_comparison_view();
const View<ComparisonView>& comparison_view();

// api/answers/objects_view.cpp
const View<ObjectView>& object_view();
const View<InstanceView>& instance_view();
const View<LabelView>& label_view();
const View<ObjectsView>& objects_view();

// api/answers/lab_view.cpp
const View<core::lab::Point>& lab_point_view();
const View<LabOutcomeView>& lab_outcome_view();
const View<std::monostate>& lab_cancelled_view();
const View<core::lab::Experiment>& experiment_view();

// api/answers/server_view.cpp
const View<TypeView>& type_info_view();
const View<core::IntegratorEntry>& integrator_view();
const View<OptionRow>& option_view();
const View<DrainView>& drain_view();
const View<ServerView>& server_view();

}  // namespace api
