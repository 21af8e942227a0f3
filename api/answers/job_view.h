/// Bodies of GET responses: jobs, scenes, convergence, pixels, comparisons, and the server.
///
/// Every function returns the text of the body. NaN and infinity are printed as null.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/job/job_spec.h"
#include "api/problem.h"
#include "core/base/warning.h"
#include "core/denoise/denoiser.h"
#include "core/denoise/flicker.h"
#include "core/error/error_estimate.h"
#include "core/film/film_merge.h"
#include "core/film/meter_reading.h"
#include "core/render/task/render_task.h"
#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace api {

enum class JobState { kQueued, kLoading, kRendering, kPaused, kFinished, kFailed, kCancelled };

/// "queued" ... "cancelled".
std::string_view to_text(JobState state);
std::optional<JobState> job_state_from_text(std::string_view text);
/// Returns true for finished, failed and cancelled.
bool is_final(JobState state);
/// Reason for a pause. kStorageFull: the server paused the job and will resume it.
enum class PauseReason { kNone, kRequested, kStorageFull };
/// "requested" "storage_full"; "" for kNone.
std::string_view to_text(PauseReason reason);
std::optional<PauseReason> pause_reason_from_text(std::string_view text);
/// "samples_per_pixel" "relative_error" "seconds" "cpu_seconds" "deadline" "limit" "cancelled"
/// "failed"; "" for kNone.
std::string_view to_text(core::StopReason reason);
std::optional<core::StopReason> stop_reason_from_text(std::string_view text);

/// The newest denoised picture of a job.
struct DenoisedView {
  core::DenoiserFacts by;
  std::string note;          ///< why `auto` did not choose the better denoiser; empty: it did
  bool has_features = true;  ///< false: the scene is gone
  core::ErrorInterval mixed;
  core::ErrorInterval full;
  core::ErrorInterval plain;  ///< of the picture before denoising
  std::uint32_t revision = 0;
  double seconds = 0;  ///< duration
  /// Of an image of a video: from those beside it that were there before; empty: none was.
  std::optional<core::Flicker> flicker = {};
};

/// The state of a job at one moment.
struct JobView {
  std::string id;
  JobState state = JobState::kQueued;
  PauseReason pause_reason = PauseReason::kNone;  ///< kNone unless paused
  core::StopReason stop_reason = core::StopReason::kNone;
  double created_at_unix_seconds = 0;
  std::optional<double> started_at_unix_seconds;
  std::optional<double> finished_at_unix_seconds;
  JobSpec spec;
  std::uint32_t spec_version = 1;  ///< number of changes of spec; part of the ETag
  /// Its revision is that of the job. Default: nothing rendered yet (error.relative NaN).
  core::Progress progress = nothing_rendered();
  std::optional<Problem> failure;
  std::optional<int> queue_position;  ///< 0 is next
  std::uint64_t peak_bytes = 0;       ///< 0: unknown
  std::string film_digest;            ///< empty until finished
  std::vector<std::string> warnings;
  std::vector<core::Warning> warning_details;  ///< about the scene's file; texts are in `warnings`
  std::string build;          ///< JSON text: build that rendered the film; empty: unknown
  core::SampleLedger ledger;  ///< of a merged film; empty: follows from the spec
  /// Samples per pixel of the film when its error estimate ended it, unless a count fixed
  /// beforehand is larger; 0: no error did.
  int samples_by_error = 0;
  std::optional<DenoisedView> denoised;
  bool film_is_evicted = false;
  bool is_doubted = false;    ///< a worker with unverified samples in the film returned wrong ones
  bool is_denoising = false;  ///< a denoised picture is being made
  int split_count = 0;  ///< measured for `measured` splitting; 0: not measured, or nothing to split

  static core::Progress nothing_rendered();
};

/// Returns the samples of each pixel, of both halves together, that denoising requires. A half of
/// one sample has no variance, so a preview would take noise for detail.
constexpr int denoising_samples(bool has_ended) { return has_ended ? 2 : 4; }

/// Adds a warning about the scene's file, with its text, unless it is there.
void add_warning(JobView& job, const core::Warning& warning);

/// Returns whether an error estimate chose the job's sample count.
bool is_ended_by_error(const JobView& job);
/// Returns the denoised view as reported for the job: `low` is 0 if an error chose its sample
/// count.
DenoisedView promised(DenoisedView denoised, const JobView& job);

/// Returns "none", "consistent" or "biased": the worst of the job's settings and of the choice of
/// its sample count.
std::string_view bias_of(const JobView& job);
/// The same without a job: is_by_error as is_ended_by_error().
std::string_view bias_of(const core::RenderSettings& render, bool is_by_error);

std::string job_json(const JobView& job);
/// Returns an ETag of state, spec and revision: `"s3-r120-rendering"` with its quotes.
std::string job_etag(const JobView& job);
/// Returns the spec_version in an ETag made by job_etag(), strong or weak; empty for any other
/// text.
std::optional<std::uint32_t> etag_spec_version(std::string_view etag);

/// damaged: ids of jobs whose records cannot be read. next: cursor of the next page; empty: this is
/// the last one.
std::string job_list_json(std::span<const JobView> jobs, std::span<const std::string> damaged,
                          const std::optional<std::string>& next);

std::string scene_json(std::string_view id, const core::SceneSummary& summary);
/// Returns `scene`, a text of scene_json() from an earlier upload, for an upload of the same file
/// by `name`: with a warning if the scene has another name, which it keeps.
std::string known_scene_json(std::string scene, std::string_view name);
/// scenes: texts of scene_json().
std::string scene_list_json(std::span<const std::string> scenes,
                            const std::optional<std::string>& next);

/// {"id", "bytes"} of an asset.
std::string asset_json(std::string_view id, std::uint64_t bytes);

/// {"ticket", "expires_at", "jobs"}.
std::string ticket_json(std::string_view ticket, double ends_unix_seconds,
                        std::span<const std::string> jobs);

/// A line through (log samples_per_pixel, log error.relative) by least squares, with its 95%
/// interval (Student's t, n - 2 degrees). NaN: too few points. Points without an error are omitted.
/// The points of one run are dependent, so the interval is only a guide.
struct Slope {
  double value = 0;
  double low = 0;
  double high = 0;
};
Slope fit_slope(std::span<const core::ConvergencePoint> points);
std::string convergence_json(std::span<const core::ConvergencePoint> points);

/// The member `light_not_found` as JSON, and back; empty: unknown.
std::string light_not_found_json(const std::optional<core::LightNotFound>& light);
std::optional<core::LightNotFound> parse_light_not_found(std::string_view text);
/// A share of the light in percent with two digits, without an exponent: "0.21%", "100%".
std::string share_words(double share);
/// A sentence: whose light is missing, or how much may be.
std::string light_words(const core::LightNotFound& light);

/// The readings of a job's meter.
struct MeterOfJob {
  std::string job;  ///< id
  std::vector<core::MeterReading> readings;
  double outdoor_lux = 0;  ///< core::horizontal_irradiance(); NaN: no environment
};
/// {"bias", "confidence", "uniformity", "daylight_factor", "outdoor_lux", "points"}.
std::string meter_json(const MeterOfJob& meter);
/// Two meters with the same points: a - b at each.
std::string meter_comparison_json(const MeterOfJob& a, const MeterOfJob& b);
/// The readings as CSV (RFC 4180).
std::string meter_csv(std::span<const core::MeterReading> readings);

struct PixelLayer {
  std::string name;
  std::vector<double> mean;            ///< one for each channel of the layer
  std::vector<double> standard_error;  ///< NaN: unknown
  std::vector<double> low;             ///< 95% interval
  std::vector<double> high;
  std::vector<std::vector<double>> halves;  ///< A and B; empty for a layer without halves
};
struct PixelView {
  int x = 0;
  int y = 0;
  std::uint64_t samples = 0;
  std::vector<PixelLayer> layers;
};
std::string pixel_json(const PixelView& pixel);

struct ComparisonView {
  std::string id;
  std::string a;  ///< id of a job or an asset
  std::string b;
  double mse = 0;
  double relmse = 0;
  double flip = 0;
  double bias = 0;
  double bias_low = 0;
  double bias_high = 0;
  double z_mean = 0;
  double z_variance = 0;
  double z_share_above_3 = 0;
};
std::string comparison_json(const ComparisonView& comparison);

}  // namespace api
