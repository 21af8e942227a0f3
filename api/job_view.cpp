#include "api/job_view.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "api/time_text.h"
#include "api/values.h"
#include "api/view_parts.h"
#include "core/render/registry.h"

namespace api {
namespace {

constexpr std::array<std::string_view, 7> kStates = {"queued",   "loading", "rendering", "paused",
                                                     "finished", "failed",  "cancelled"};
constexpr std::array<std::string_view, 8> kReasons = {
    "",      "samples_per_pixel", "relative_error", "seconds", "deadline",
    "limit", "cancelled",         "failed"};

Json time_json(const std::optional<double>& unix_seconds) {
  return unix_seconds ? Json(rfc3339(*unix_seconds)) : Json(nullptr);
}

Json links_json(const JobView& job) {
  const std::string self = "/v1/jobs/" + job.id;
  Json links = {{"self", self}};
  for (const char* part : {"image", "events", "tiles", "convergence", "film", "cancel"}) {
    links[part] = self + "/" + part;
  }
  links["scene"] = "/v1/scenes/" + job.spec.scene;
  return links;
}

template <typename Enum, std::size_t N>
std::optional<Enum> from_text(const std::array<std::string_view, N>& texts, std::string_view text) {
  const auto* found = std::find(texts.begin(), texts.end(), text);
  if (found == texts.end()) {
    return {};
  }
  return static_cast<Enum>(found - texts.begin());
}

}  // namespace

std::string_view to_text(JobState state) { return kStates[static_cast<std::size_t>(state)]; }
std::optional<JobState> job_state_from_text(std::string_view text) {
  return from_text<JobState>(kStates, text);
}
bool is_final(JobState state) {
  return state == JobState::kFinished || state == JobState::kFailed ||
         state == JobState::kCancelled;
}
std::string_view to_text(core::StopReason reason) {
  return kReasons[static_cast<std::size_t>(reason)];
}
std::optional<core::StopReason> stop_reason_from_text(std::string_view text) {
  return from_text<core::StopReason>(kReasons, text);
}

core::Progress JobView::nothing_rendered() {
  core::Progress progress;
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  progress.error.relative_rmse = unknown;
  progress.error.low = unknown;
  progress.error.high = unknown;
  progress.efficiency = unknown;
  return progress;
}

Json progress_part(const JobView& job) {
  const core::Progress& progress = job.progress;
  // Below 1 until the end, also after rounding to the four digits that a bar can show.
  constexpr double kNearlyDone = 0.9999;
  const double fraction =
      job.state == JobState::kFinished ? 1.0 : std::clamp(progress.fraction, 0.0, kNearlyDone);
  return {
      {"fraction", number_json(fraction)},
      {"samples_per_pixel",
       {{"min", progress.samples_min},
        {"mean", number_json(progress.samples_mean)},
        {"max", progress.samples_max}}},
      {"elapsed_seconds", number_json(progress.elapsed_seconds)},
      {"cpu_seconds", number_json(progress.cpu_seconds)},
      {"eta_seconds", progress.eta_seconds ? number_json(*progress.eta_seconds) : Json(nullptr)},
      {"eta_interval_seconds", progress.eta_low_seconds && progress.eta_high_seconds
                                   ? Json::array({number_json(*progress.eta_low_seconds),
                                                  number_json(*progress.eta_high_seconds)})
                                   : Json(nullptr)}};
}

bool is_ended_by_error(const JobView& job) {
  // It stays so when a clock ends the job later: the count is the larger of the two.
  return job.stop_reason == core::StopReason::kRelativeError || job.samples_by_error > 0;
}

std::string_view bias_of(const core::RenderSettings& render, bool is_by_error) {
  const std::string_view bias = core::bias_of(render);
  // A sample count that depends on the error it saw is no longer independent of the picture.
  return bias == "none" && is_by_error ? "consistent" : bias;
}

std::string_view bias_of(const JobView& job) { return bias_of(job.spec.render, is_ended_by_error(job)); }

Json error_part(const JobView& job) {
  const core::ErrorInterval& error = job.progress.error;
  const bool valid = core::errors_are_valid(job.spec.render);
  return {{"relative_rmse", number_json(error.relative_rmse)},
          {"low", valid ? number_json(error.low) : Json(nullptr)},
          {"high", valid ? number_json(error.high) : Json(nullptr)},
          {"confidence", number_json(job.spec.stop.confidence)},
          {"bias", bias_of(job)},
          {"valid", valid},
          {"unreliable", error.unreliable}};
}

Json statistics_part(const JobView& job) {
  const core::Progress& progress = job.progress;
  return {{"rays", progress.rays},
          {"rays_per_second", number_json(progress.rays_per_second)},
          {"efficiency", number_json(progress.efficiency)},
          {"rejected_samples", progress.rejected_samples},
          {"peak_bytes", job.peak_bytes == 0 ? Json(nullptr) : Json(job.peak_bytes)},
          {"split_count", job.split_count == 0 ? Json(nullptr) : Json(job.split_count)}};
}

Json stop_reason_part(const JobView& job) {
  const std::string_view reason = to_text(job.stop_reason);
  return reason.empty() ? Json(nullptr) : Json(reason);
}

Json failure_part(const JobView& job) {
  return job.failure ? Json::parse(problem_json(*job.failure, "")) : Json(nullptr);
}

Json digest_part(const JobView& job) {
  return job.film_digest.empty() ? Json(nullptr) : Json(job.film_digest);
}

Json job_part(const JobView& job) {
  Json body;
  body["id"] = job.id;
  body["state"] = to_text(job.state);
  body["stop_reason"] = stop_reason_part(job);
  body["created_at"] = time_json(job.created_at_unix_seconds);
  body["started_at"] = time_json(job.started_at_unix_seconds);
  body["finished_at"] = time_json(job.finished_at_unix_seconds);
  body["spec"] = to_json(job.spec);
  body["progress"] = progress_part(job);
  body["error"] = error_part(job);
  body["failure"] = failure_part(job);
  body["queue_position"] = job.queue_position ? Json(*job.queue_position) : Json(nullptr);
  body["statistics"] = statistics_part(job);
  body["revision"] = job.progress.revision;
  body["film_digest"] = digest_part(job);
  body["warnings"] = job.warnings;
  body["links"] = links_json(job);
  return body;
}

std::string job_json(const JobView& job) { return dump(job_part(job)); }

std::string job_etag(const JobView& job) {
  return "\"s" + std::to_string(job.spec_version) + "-r" + std::to_string(job.progress.revision) +
         "-" + std::string(to_text(job.state)) + "\"";
}

std::optional<std::uint32_t> etag_spec_version(std::string_view etag) {
  if (etag.starts_with("W/")) {
    etag.remove_prefix(2);
  }
  constexpr std::string_view kStart = "\"s";
  if (!etag.starts_with(kStart)) {
    return {};
  }
  etag.remove_prefix(kStart.size());
  std::uint32_t version = 0;
  const auto read = std::from_chars(etag.data(), etag.data() + etag.size(), version);
  const std::string_view rest(read.ptr,
                              static_cast<std::size_t>(etag.data() + etag.size() - read.ptr));
  if (read.ec != std::errc() || !rest.starts_with("-r") || !rest.ends_with('"')) {
    return {};
  }
  return version;
}

std::string ticket_json(std::string_view ticket, double ends_unix_seconds,
                        std::span<const std::string> jobs) {
  Json list = Json::array();
  for (const std::string& job : jobs) {
    list.push_back(job);
  }
  return dump(
      {{"ticket", ticket}, {"expires_at", rfc3339(ends_unix_seconds)}, {"jobs", std::move(list)}});
}

std::string job_list_json(std::span<const JobView> jobs, const std::optional<std::string>& next) {
  Json list = Json::array();
  for (const JobView& job : jobs) {
    list.push_back(job_part(job));
  }
  return dump({{"jobs", std::move(list)}, {"next", next ? Json(*next) : Json(nullptr)}});
}

}  // namespace api
