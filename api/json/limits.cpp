#include "api/json/limits.h"

#include <array>

namespace api {
namespace {

constexpr std::array kLimits = {
    LimitRow{"body_bytes", limits::kBodyBytes, "Bytes of a JSON body."},
    LimitRow{"json_depth", limits::kJsonDepth, "Levels of nested JSON."},
    LimitRow{"json_key_bytes", limits::kJsonKeyBytes, "Bytes of a member name."},
    LimitRow{"seed", limits::kSeed, "Largest seed."},
    LimitRow{"priority", limits::kPriority, "Largest priority; the smallest is its negative."},
    LimitRow{"name_characters", limits::kNameCharacters, "Characters of a name."},
    LimitRow{"labels", limits::kLabels, "Labels of a job."},
    LimitRow{"label_key_characters", limits::kLabelKeyCharacters, "Characters of a label's key."},
    LimitRow{"label_value_characters", limits::kLabelValueCharacters,
             "Characters of a label's value."},
    LimitRow{"film_side", limits::kFilmSide, "Width or height in pixels."},
    LimitRow{"film_pixels", limits::kFilmPixels, "Width times height."},
    LimitRow{"filter_radius", limits::kFilterRadius, "Radius of the film filter in pixels."},
    LimitRow{"light_shares", limits::kLightShares,
             "Layers bounce:N, light:NAME, st:S,T and irradiance of a job."},
    LimitRow{"meter_points", limits::kMeterPoints,
             "Points of a job's meter, including those of its plane."},
    LimitRow{"mix_weight", limits::kMixWeight, "Weight of a light share in a mix."},
    LimitRow{"max_depth", limits::kMaxDepth, "Scattering events on a path."},
    LimitRow{"dilation", limits::kDilation,
             "Radius of adaptive sampling's dilation, pixels or tiles."},
    LimitRow{"replicates", limits::kReplicates, "Independent randomisations of a pixel."},
    LimitRow{"split_count", limits::kSplitCount, "Continuations of a split path."},
    LimitRow{"photons", limits::kPhotons, "Particles for each sample of the pixels."},
    LimitRow{"final_gather", limits::kFinalGather, "Directions in which a path gathers photons."},
    LimitRow{"record_rays", limits::kRecordRays, "Paths over the hemisphere of a record."},
    LimitRow{"records", limits::kRecords, "Irradiance records of each replicate."},
    LimitRow{"light_candidates", limits::kLightCandidates,
             "Candidate light samples, of which one is selected."},
    LimitRow{"light_block", limits::kLightBlock,
             "Side, in pixels, of squares that share light samples."},
    LimitRow{"first_replicate", limits::kFirstReplicate, "Largest number of the first replicate."},
    LimitRow{"samples_per_pixel", limits::kSamplesPerPixel,
             "Samples per pixel, all replicates together."},
    LimitRow{"stop_seconds", limits::kStopSeconds, "Rendering seconds that a job may request."},
    LimitRow{"stop_cpu_seconds", limits::kStopCpuSeconds, "CPU seconds that a job may request."},
    LimitRow{"wait_seconds", limits::kWaitSeconds,
             "Seconds of ?wait and of Prefer: wait; the server may respond earlier (--max-wait)."},
    LimitRow{"page_size", limits::kPageSize, "Items of one page of a list."},
    LimitRow{"scene_files", limits::kSceneFiles, "Files of a scene made from assets."},
    LimitRow{"merge_films", limits::kMergeFilms, "Films in one merge."},
    LimitRow{"film_bytes", limits::kFilmBytes, "Bytes of a film that is uploaded or merged."},
    LimitRow{"comparison_pixels", limits::kComparisonPixels, "Pixels of images that are compared."},
    LimitRow{"comparisons", limits::kComparisons,
             "Comparisons that are kept; the oldest are deleted first."},
    LimitRow{"comparison_bytes", limits::kComparisonBytes, "Bytes of all maps that are kept."},
    LimitRow{"exposure_stops", limits::kExposureStops,
             "Largest exposure in stops; the smallest is its negative."},
    LimitRow{"retention_seconds", limits::kRetentionSeconds,
             "Longest retention that a job may request, in seconds."},
    LimitRow{"webhook_url_characters", limits::kWebhookUrlCharacters,
             "Characters of a webhook's address."},
    LimitRow{"watched_jobs", limits::kWatchedJobs, "Jobs of one GET /v1/events or ticket."},
    LimitRow{"batch_jobs", limits::kBatchJobs, "Jobs of one batch."},
    LimitRow{"lab_evaluations", limits::kLabEvaluations,
             "Random vectors of one run of the laboratory."},
    LimitRow{"lab_replicates", limits::kLabReplicates, "Replicates of one run of the laboratory."},
    LimitRow{"errors_shown", limits::kErrorsShown, "Entries of `errors` in one problem."},
};

}  // namespace

std::span<const LimitRow> limit_table() { return kLimits; }

}  // namespace api
