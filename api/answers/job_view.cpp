#include "api/answers/job_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/json/time_text.h"
#include "api/json/values.h"
#include "core/integrators/maps/photon_rules.h"
#include "core/integrators/registry.h"

namespace api {
namespace {

constexpr std::array<std::string_view, 7> kStates = {"queued",   "loading", "rendering", "paused",
                                                     "finished", "failed",  "cancelled"};
constexpr std::array<std::string_view, 3> kPauseReasons = {"", "requested", "storage_full"};
constexpr std::array<std::string_view, 12> kReasons = {"",
                                                       "samples_per_pixel",
                                                       "relative_error",
                                                       "denoised_error",
                                                       "seconds",
                                                       "cpu_seconds",
                                                       "deadline",
                                                       "meter_error",
                                                       "light_not_found",
                                                       "limit",
                                                       "cancelled",
                                                       "failed"};

Json time_json(const std::optional<double>& unix_seconds) {
  return unix_seconds ? Json(rfc3339(*unix_seconds)) : Json(nullptr);
}

Json links_json(const JobView& job) {
  const std::string self = "/v1/jobs/" + job.id;
  Json links = {{"self", self}};
  for (const char* part : {"image", "tiles", "objects"}) {
    if (job.spec.has_image) {
      links[part] = self + "/" + part;
    }
  }
  for (const char* part : {"events", "convergence", "film", "cancel"}) {
    links[part] = self + "/" + part;
  }
  if (!job.spec.render.meter.empty()) {
    links["meter"] = self + "/meter";
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

double shown_fraction(const JobView& job) {
  // Stays below 1 until the end, even after rounding to the four digits of a progress bar.
  constexpr double kNearlyDone = 0.9999;
  return job.state == JobState::kFinished ? 1.0
                                          : std::clamp(job.progress.fraction, 0.0, kNearlyDone);
}

Json eta_interval(const JobView& job) {
  const auto& low = job.progress.eta_low_seconds;
  const auto& high = job.progress.eta_high_seconds;
  return low && high ? Json::array({number_json(*low), number_json(*high)}) : Json(nullptr);
}

Json stop_reason_shape() {
  return shape::nullable(shape::one_of({kReasons.begin() + 1, kReasons.end()},
                                       "Why the job ended; null until it has ended."));
}

const View<JobView>& samples_view() {
  static const View<JobView> kView = {
      "",
      "Samples per pixel, over the pixels of the crop.",
      {{"min", shape::count(), [](const JobView& j) -> Json { return j.progress.samples_min; }},
       {"mean", shape::real(),
        [](const JobView& j) { return number_json(j.progress.samples_mean); }},
       {"max", shape::count(), [](const JobView& j) -> Json { return j.progress.samples_max; }}}};
  return kView;
}

core::ErrorInterval image_error(const JobView& job) {
  return job.spec.has_image ? job.progress.error : core::unknown_error();
}

bool has_interval(const JobView& job) {
  return core::error_is_valid(job.progress.error, job.spec.render);
}

Json interval_end(const JobView& job, double value) {
  return has_interval(job) ? number_json(value) : Json(nullptr);
}

Json radius_ratio_json(const JobView& job) {
  const core::RenderSettings& render = job.spec.render;
  const int samples = job.progress.samples_max;
  return samples > 0 && core::radius_shrinks(render)
             ? number_json(core::radius_ratio(render, samples))
             : Json(nullptr);
}

bool can_be_denoised(const JobView& job) {
  const bool has_ended = is_final(job.state);
  return job.spec.denoise.type != core::DenoiserType::kNone &&
         (has_ended || job.spec.denoise.preview) &&
         job.progress.samples_min >= denoising_samples(has_ended);
}

Json available_parts(const JobView& job) {
  Json parts = Json::array();
  if (job.film_is_evicted) {
    return parts;
  }
  if (job.spec.has_image && job.progress.revision > 0) {
    parts.push_back("image");
    if (can_be_denoised(job)) {
      parts.push_back("denoised");
    }
  }
  if (job.progress.has_meter_readings) {
    parts.push_back("meter");
  }
  return parts;
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
std::string_view to_text(PauseReason reason) {
  return kPauseReasons[static_cast<std::size_t>(reason)];
}
std::optional<PauseReason> pause_reason_from_text(std::string_view text) {
  return from_text<PauseReason>(kPauseReasons, text);
}
std::string_view to_text(core::StopReason reason) {
  return kReasons[static_cast<std::size_t>(reason)];
}
std::optional<core::StopReason> stop_reason_from_text(std::string_view text) {
  return from_text<core::StopReason>(kReasons, text);
}

core::Progress JobView::nothing_rendered() {
  core::Progress progress;
  progress.error = core::unknown_error();
  return progress;
}

Json job_state_schema() {
  return shape::one_of({kStates.begin(), kStates.end()}, "The state of a job.");
}

const View<JobView>& progress_view() {
  static const View<JobView> kView = {
      "Progress",
      "Progress of the job.",
      {{"fraction", shape::real("From 0 to 1; 1 only at the end."),
        [](const JobView& j) { return number_json(shown_fraction(j)); }},
       {"samples_per_pixel", samples_view().shape(),
        [](const JobView& j) { return samples_view().print(j); }},
       {"elapsed_seconds", shape::real("Rendering time without pauses and downtime."),
        [](const JobView& j) { return number_json(j.progress.elapsed_seconds); }},
       {"cpu_seconds", shape::real("CPU time summed over all threads."),
        [](const JobView& j) { return number_json(j.progress.cpu_seconds); }},
       {"eta_seconds", shape::nullable(shape::real("Time until the end; null: unknown.")),
        [](const JobView& j) {
          return j.progress.eta_seconds ? number_json(*j.progress.eta_seconds) : Json(nullptr);
        }},
       {"eta_interval_seconds",
        shape::nullable(shape::interval(
            "Lower and upper bound of eta_seconds at the current speed; null: unknown.")),
        &eta_interval}}};
  return kView;
}

bool is_ended_by_error(const JobView& job) {
  // Remains true if a time limit ends the job later: the count is the larger of the two.
  return core::is_by_error(job.stop_reason) || job.samples_by_error > 0;
}

DenoisedView promised(DenoisedView denoised, const JobView& job) {
  // Errors that ended the job were selected by their value: only their upper bound holds.
  for (core::ErrorInterval* error : {&denoised.mixed, &denoised.full}) {
    error->low = is_ended_by_error(job) && std::isfinite(error->low) ? 0 : error->low;
    if (!core::halves_show_error(job.spec.render)) {
      error->low = error->high = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return denoised;
}

std::string_view bias_of(const core::RenderSettings& render, bool is_by_error) {
  const std::string_view bias = core::bias_of(render);
  // A sample count that depends on the error estimate is not independent of the picture.
  return bias == "none" && is_by_error ? "consistent" : bias;
}

std::string_view bias_of(const JobView& job) {
  return bias_of(job.spec.render, is_ended_by_error(job));
}

const View<JobView>& error_view() {
  static const View<JobView> kView = {
      "ErrorEstimate",
      "Error estimate of the current image I against the truth mu: the mean over pixels of (sum "
      "over channels of |I - mu|) / (sum of max(I, mu) + F), F = 0.05 (mean root of the "
      "luminance)^2.",
      {{"relative",
        shape::nullable(shape::real("grain + doubt / 2: the average pixel is off by this share of "
                                    "its brightness, 0 to 1; null: unknown.")),
        [](const JobView& j) { return number_json(image_error(j).relative); }},
       {"low",
        shape::nullable(shape::real("Lower end of the interval; null: unknown, or not valid.")),
        [](const JobView& j) { return interval_end(j, image_error(j).low); }},
       {"high", shape::nullable(shape::real("Upper end of the interval.")),
        [](const JobView& j) { return interval_end(j, image_error(j).high); }},
       {"grain",
        shape::nullable(
            shape::real("Mean over pixels of r = sum |A - B| / sum (|A| + |B| + 2 F). By "
                        "comparison: 0.8 times the mean root of (I - U)(I - V), relative, for two "
                        "unbiased images U and V; `relative` is then the same.")),
        [](const JobView& j) { return number_json(image_error(j).grain); }},
       {"doubt",
        shape::nullable(shape::real("Light that only one half has found: mean over squares of 16 "
                                    "pixels of sum (|A - B| r) / sum (|A| + |B| + 2 F).")),
        [](const JobView& j) { return number_json(image_error(j).doubt); }},
       {"confidence", shape::real("Confidence level of the interval."),
        [](const JobView& j) { return number_json(j.spec.stop.confidence); }},
       {"bias", shape::bias(), [](const JobView& j) -> Json { return bias_of(j); }},
       {"valid",
        shape::flag("False: the error is unknown, since no unbiased integrator can render the "
                    "image to compare it with."),
        [](const JobView& j) -> Json { return has_interval(j); }},
       {"unreliable",
        shape::flag("More light is in doubt than is visible as grain (doubt above grain): rare "
                    "bright paths are still being found, and the interval may miss."),
        [](const JobView& j) -> Json { return image_error(j).unreliable; }},
       {"relative_rmse",
        shape::nullable(shape::real("Deprecated: the same as `relative`; removed in version 2.")),
        [](const JobView& j) { return number_json(image_error(j).relative); }}}};
  return kView;
}

const View<JobView>& statistics_view() {
  static const View<JobView> kView = {
      "Statistics",
      "Cost of the job.",
      {{"rays", shape::count(), [](const JobView& j) -> Json { return j.progress.rays; }},
       {"rays_per_second", shape::nullable(shape::real()),
        [](const JobView& j) { return number_json(j.progress.rays_per_second); }},
       {"efficiency", shape::nullable(shape::real("1 / (relative error^2 * CPU seconds).")),
        [](const JobView& j) {
          return j.spec.has_image ? number_json(j.progress.efficiency()) : Json(nullptr);
        }},
       {"efficiency_low", shape::nullable(shape::real("From the interval of `error`.")),
        [](const JobView& j) { return interval_end(j, j.progress.efficiency_low()); }},
       {"efficiency_high", shape::nullable(shape::real("Null also if `error.low` is 0.")),
        [](const JobView& j) { return interval_end(j, j.progress.efficiency_high()); }},
       {"rejected_samples", shape::count("Samples that were not finite, counted as zero."),
        [](const JobView& j) -> Json { return j.progress.rejected_samples; }},
       {"peak_bytes", shape::nullable(shape::count("Memory; null: unknown.")),
        [](const JobView& j) { return j.peak_bytes == 0 ? Json(nullptr) : Json(j.peak_bytes); }},
       {"split_count",
        shape::nullable(shape::count("Number of continuations that splitting 'measured' has found; "
                                     "null: not yet known, or another type.")),
        [](const JobView& j) { return j.split_count == 0 ? Json(nullptr) : Json(j.split_count); }},
       {"radius_ratio",
        shape::nullable(
            shape::real("sppm, vcm: radius of the newest sample's disks relative to the first "
                        "sample's; null: no sample yet, or another integrator.")),
        &radius_ratio_json}}};
  return kView;
}

const ViewRow<JobView>& state_row() {
  static const ViewRow<JobView> kRow = {"state", shape::reference("JobState"),
                                        [](const JobView& j) -> Json { return to_text(j.state); }};
  return kRow;
}

const ViewRow<JobView>& pause_reason_row() {
  static const ViewRow<JobView> kRow = {
      "pause_reason",
      shape::nullable(shape::one_of({kPauseReasons.begin() + 1, kPauseReasons.end()},
                                    "Why the job is paused; null: it is not. `storage_full`: it "
                                    "resumes by itself when the disk has space.")),
      [](const JobView& j) { return text_or_null(to_text(j.pause_reason)); }};
  return kRow;
}

const ViewRow<JobView>& stop_reason_row() {
  static const ViewRow<JobView> kRow = {"stop_reason", stop_reason_shape(), [](const JobView& j) {
                                          return text_or_null(to_text(j.stop_reason));
                                        }};
  return kRow;
}

const ViewRow<JobView>& queue_position_row() {
  static const ViewRow<JobView> kRow = {
      "queue_position", shape::nullable(shape::count("0: the next job; null: not waiting.")),
      [](const JobView& j) { return or_null(j.queue_position); }};
  return kRow;
}

const ViewRow<JobView>& progress_row() {
  static const ViewRow<JobView> kRow = {"progress", progress_view().shape(),
                                        [](const JobView& j) { return progress_view().print(j); }};
  return kRow;
}

const ViewRow<JobView>& error_estimate_row() {
  static const ViewRow<JobView> kRow = {"error", error_view().shape(),
                                        [](const JobView& j) { return error_view().print(j); }};
  return kRow;
}

const ViewRow<JobView>& statistics_row() {
  static const ViewRow<JobView> kRow = {
      "statistics", statistics_view().shape(),
      [](const JobView& j) { return statistics_view().print(j); }};
  return kRow;
}

const ViewRow<JobView>& failure_row() {
  static const ViewRow<JobView> kRow = {
      "failure", shape::nullable(problem_view().shape()), [](const JobView& j) {
        return j.failure ? problem_view().print(*j.failure) : Json(nullptr);
      }};
  return kRow;
}

const ViewRow<JobView>& revision_row() {
  static const ViewRow<JobView> kRow = {
      "revision", shape::count("Number of changes of the image."),
      [](const JobView& j) -> Json { return j.progress.revision; }};
  return kRow;
}

const ViewRow<JobView>& available_row() {
  static const ViewRow<JobView> kRow = {
      "available",
      shape::list(shape::one_of({"image", "denoised", "meter"}, ""),
                  "Parts that can be requested now: `image`, which includes pixels; `denoised`, "
                  "the image with ?denoise=mixed or full; `meter`. Requests for others are a 409."),
      &available_parts};
  return kRow;
}

const ViewRow<JobView>& digest_row() {
  static const ViewRow<JobView> kRow = {
      "film_digest",
      shape::nullable(shape::text("SHA-256 of the film's exact content, once finished.")),
      [](const JobView& j) { return text_or_null(j.film_digest); }};
  return kRow;
}

const View<core::FlickerInterval>& flicker_view() {
  static const View<core::FlickerInterval> kView = {
      "Flicker",
      "By how much the error of images of a video changes from one frame to the next, relative to "
      "their light, along the motion of the surfaces.",
      {{"relative", shape::real("Root of its mean square."),
        Member<&core::FlickerInterval::relative>::number},
       {"low", shape::real("Lower end of its 95% interval."),
        Member<&core::FlickerInterval::low>::number},
       {"high", shape::real(), Member<&core::FlickerInterval::high>::number}}};
  return kView;
}

Json flicker_json(const std::optional<core::Flicker>& flicker) {
  const auto interval = flicker ? core::interval(*flicker, 0.95) : std::nullopt;
  return interval ? flicker_view().print(*interval) : Json(nullptr);
}

const View<DenoisedView>& denoised_view() {
  static const View<DenoisedView> kView = {
      "Denoised",
      "The newest denoised image, with the error of `mixed`.",
      {{"type", shape::text("The denoiser."),
        [](const DenoisedView& d) -> Json { return d.by.type; }},
       {"version", shape::text(), [](const DenoisedView& d) -> Json { return d.by.version; }},
       {"sha256",
        shape::nullable(shape::text("Hash of the file with its weights; null: it has none.")),
        [](const DenoisedView& d) { return text_or_null(d.by.sha256); }},
       {"quality", shape::nullable(shape::text("null: the denoiser has no quality settings.")),
        [](const DenoisedView& d) { return text_or_null(d.by.quality); }},
       {"note", shape::nullable(shape::text("Why `auto` did not choose the better denoiser.")),
        [](const DenoisedView& d) { return text_or_null(d.note); }},
       {"features",
        shape::flag("Uses albedo, normal, depth and emission; false: the scene was deleted."),
        Member<&DenoisedView::has_features>::json},
       {"relative",
        shape::nullable(shape::real("As in `error`, bias included; 0 if it is too small to be "
                                    "measured.")),
        [](const DenoisedView& d) { return number_json(d.mixed.relative); }},
       {"low",
        shape::nullable(shape::real("Lower end of its 95% interval; null: not valid; 0 if an error "
                                    "target ended the job, because only `high` holds then.")),
        [](const DenoisedView& d) { return number_json(d.mixed.low); }},
       {"high", shape::nullable(shape::real()),
        [](const DenoisedView& d) { return number_json(d.mixed.high); }},
       {"grain", shape::nullable(shape::real("What remains wrong in the average pixel.")),
        [](const DenoisedView& d) { return number_json(d.mixed.grain); }},
       {"doubt", shape::nullable(shape::real("That of the image before denoising.")),
        [](const DenoisedView& d) { return number_json(d.mixed.doubt); }},
       {"unreliable", shape::flag("Doubt is above grain."),
        [](const DenoisedView& d) -> Json { return d.mixed.unreliable; }},
       {"full_relative", shape::nullable(shape::real("Error of `full`, the denoiser's own image.")),
        [](const DenoisedView& d) { return number_json(d.full.relative); }},
       {"relative_rmse",
        shape::nullable(shape::real("Deprecated: the same as `relative`; removed in version 2.")),
        [](const DenoisedView& d) { return number_json(d.mixed.relative); }},
       {"full_relative_rmse",
        shape::nullable(shape::real("Deprecated: the same as `full_relative`.")),
        [](const DenoisedView& d) { return number_json(d.full.relative); }},
       {"gain",
        shape::nullable(shape::real("(plain error / this one)^2: factor of samples that the plain "
                                    "image would need for the same error.")),
        [](const DenoisedView& d) {
          const double ratio = d.plain.relative / d.mixed.relative;
          return number_json(ratio * ratio);
        }},
       {"revision", shape::count("Revision of the image that was denoised."),
        Member<&DenoisedView::revision>::json},
       {"seconds", shape::real("Time that denoising took."),
        Member<&DenoisedView::seconds>::number},
       {"frames",
        shape::count("Frames beside it in the batch that it was averaged with: of `video`."),
        [](const DenoisedView& d) -> Json { return d.by.frames; }},
       {"flicker", shape::nullable(flicker_view().shape()),
        [](const DenoisedView& d) { return flicker_json(d.flicker); }}}};
  return kView;
}

const ViewRow<JobView>& denoised_row() {
  static const ViewRow<JobView> kRow = {
      "denoised", shape::nullable(denoised_view().shape()), [](const JobView& j) {
        return j.denoised ? denoised_view().print(promised(*j.denoised, j)) : Json(nullptr);
      }};
  return kRow;
}

const View<JobView>& job_view() {
  static const View<JobView> kView = {
      "Job",
      "A job.",
      {{"id", shape::text("UUID."), Member<&JobView::id>::json},
       state_row(),
       pause_reason_row(),
       stop_reason_row(),
       {"created_at", shape::time(),
        [](const JobView& j) -> Json { return rfc3339(j.created_at_unix_seconds); }},
       {"started_at", shape::nullable(shape::time()),
        [](const JobView& j) { return time_json(j.started_at_unix_seconds); }},
       {"finished_at", shape::nullable(shape::time()),
        [](const JobView& j) { return time_json(j.finished_at_unix_seconds); }},
       {"spec", shape::reference("JobSpec"), [](const JobView& j) { return to_json(j.spec); }},
       progress_row(),
       error_estimate_row(),
       light_not_found_row(),
       failure_row(),
       queue_position_row(),
       statistics_row(),
       revision_row(),
       available_row(),
       digest_row(),
       denoised_row(),
       {"denoising",
        shape::flag("A denoised image is being made: on request, while it renders or afterwards."),
        Member<&JobView::is_denoising>::json},
       {"doubted",
        shape::flag("A worker that rendered parts of the image unchecked returned wrong results "
                    "later: the image may be wrong. A warning says what helps."),
        Member<&JobView::is_doubted>::json},
       {"merged",
        shape::flag("The film was merged from samples that no single job renders: the job cannot "
                    "be extended or retried."),
        [](const JobView& j) -> Json { return !j.ledger.empty(); }},
       {"warnings", shape::texts("Adjustments made to the request, and other warnings."),
        Member<&JobView::warnings>::json},
       {"warning_details", warning_details_shape(),
        [](const JobView& j) { return print_list(warning_view(), j.warning_details); }},
       {"links", shape::map(shape::text(), "URLs of related resources."), &links_json}}};
  return kView;
}

}  // namespace api
