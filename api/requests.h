/// Requests other than the job itself: bodies and query strings.
///
/// Problems of bodies: 400 invalid JSON, 413 too large, 422 with pointers. Query strings are
/// decoded already; repeated and unknown parameters are refused. A query parameter `limit` has the
/// pointer "/limit".
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/answers/job_view.h"
#include "api/job/job_spec.h"
#include "api/json/faults.h"
#include "api/problem.h"
#include "core/settings/choices.h"
#include "core/settings/settings.h"

namespace api {

/// PATCH /v1/jobs/{id}: priority, labels, name, stop, paused. An RFC 7396 merge patch: labels and
/// rules that are not mentioned are kept, null removes one.
struct JobPatch {
  JobSpec spec;                ///< the current spec with the changes
  std::optional<bool> paused;  ///< as requested; empty: not mentioned
  bool stop_named = false;     ///< whether the body has `stop` (409 on a final job)
  std::vector<std::string> warnings;
};
Parsed<JobPatch> parse_job_patch(std::string_view body, const JobSpec& current);

/// POST /v1/jobs/{id}/extend: {"stop": {...}}. The rules replace the old ones.
struct ExtendRequest {
  core::StopRules stop;
  std::vector<std::string> warnings;
};
Parsed<ExtendRequest> parse_extend(std::string_view body, const JobSpec& current);

/// POST /v1/scenes with application/json.
struct SceneFromAssets {
  std::string gltf;                          ///< asset id
  std::map<std::string, std::string> files;  ///< uri in the glTF -> asset id
};
Parsed<SceneFromAssets> parse_scene_from_assets(std::string_view body);

/// Which picture of a job is compared or shown.
enum class DenoiseShow { kOff, kMixed, kFull, kVideo };
/// Returns whether it is the denoiser's own image, without the plain one.
constexpr bool is_full(DenoiseShow show) {
  return show == DenoiseShow::kFull || show == DenoiseShow::kVideo;
}
std::span<const core::NamedValue<DenoiseShow>> denoise_shows();

/// POST /v1/comparisons: ids of a job (UUID) or an asset (sha256).
struct ComparisonRequest {
  std::string a;
  std::string b;
  DenoiseShow a_denoise = DenoiseShow::kOff;  ///< kOff for assets
  DenoiseShow b_denoise = DenoiseShow::kOff;
};
Parsed<ComparisonRequest> parse_comparison(std::string_view body);

/// POST /v1/films/merge: at least one id of a job or asset, each at most once.
struct MergeRequest {
  std::vector<std::string> films;
};
Parsed<MergeRequest> parse_merge(std::string_view body);

/// POST /v1/stream-tickets: {"jobs": [ids]}.
struct TicketRequest {
  std::vector<std::string> jobs;  ///< UUIDs, each at most once
};
Parsed<TicketRequest> parse_ticket(std::string_view body);

/// Decoded, in order of appearance.
using QueryParams = std::span<const std::pair<std::string, std::string>>;

/// GET /v1/jobs?state=&label=&name=&class=&cursor=&limit=. state and label may be repeated; state
/// may be a comma-separated list. Selects jobs with any of the states and all of the labels. label:
/// `key=value`, or `key` for any value. name: a part of the job's title. Invalid values give 400.
struct LabelFilter {
  std::string key;
  std::optional<std::string> value;
};
struct ListQuery {
  std::vector<JobState> states;  ///< empty: all
  std::vector<LabelFilter> labels;
  std::string name;  ///< empty: all
  enum class Class : std::uint8_t { kNormal, kPreview, kAll };
  Class job_class = Class::kNormal;
  std::string cursor;  ///< empty: from the newest; [A-Za-z0-9_-], at most 256
  int limit = 50;
};
Parsed<ListQuery> parse_job_list_query(QueryParams query);
/// GET /v1/scenes?cursor=&limit=.
Parsed<ListQuery> parse_scene_list_query(QueryParams query);

/// POST /v1/jobs?dry_run=1.
struct SubmitQuery {
  bool dry_run = false;
  bool from_image = false;  ///< the body is an image that contains the request of its job
};
Parsed<SubmitQuery> parse_submit_query(QueryParams query);

/// GET /v1/jobs/{id}?wait=20. Seconds, 0 to 60; otherwise 422.
struct WaitQuery {
  double wait_seconds = 0;
};
Parsed<WaitQuery> parse_wait_query(QueryParams query);

/// Returns the seconds of `Prefer: wait=N` (RFC 7240), at most 60; empty if the header has no wait.
std::optional<int> prefer_wait_seconds(std::string_view prefer_header);

enum class TilePlanes { kAll, kMean };

/// GET /v1/jobs/{id}/tiles?after=REVISION&planes=&denoise=.
/// What happens to fireflies (core/film/set_aside.h).
enum class Fireflies { kKeep, kSetAside };
std::span<const core::NamedValue<Fireflies>> fireflies_choices();

struct TilesQuery {
  std::uint32_t after = 0;
  TilePlanes planes = TilePlanes::kAll;
  DenoiseShow denoise = DenoiseShow::kOff;
  Fireflies fireflies = Fireflies::kKeep;
};
Parsed<TilesQuery> parse_tiles_query(QueryParams query);

/// GET /v1/events?jobs=ID,ID or ?batch=ID. 422 for an invalid id, for too many ids, and unless
/// exactly one of them is given.
struct EventsQuery {
  std::vector<std::string> jobs;
  std::string batch;
};
Parsed<EventsQuery> parse_events_query(QueryParams query);

/// Values of a data layer that are shown as black and white; empty: the range in the picture.
struct ImageRange {
  std::optional<std::array<float, 2>> ends;  ///< finite, in ascending order
};

/// GET
/// /v1/jobs/{id}/image?layer=&exposure=&curve=&background=&range=&revision=&x=&y=&width=&height=
/// &max_size=&mix=&stream=. 422 for invalid values. The server handles the extension of the path.
struct ImageQuery {
  std::optional<std::string> layer;  ///< empty: beauty, or all layers for EXR
  float exposure_stops = 0;
  bool auto_exposure = false;  ///< instead of exposure_stops (core/layers/exposure.h)
  std::optional<core::Rgb>
      background;  ///< display values, each in [0,1]; null: depends on the format
  std::string tone_map = "khronos-neutral";  ///< name of core::tone_maps()
  std::optional<double> white_balance_k;     ///< of the light that is shown as white
  double contrast = 1;                       ///< slope in stops about middle grey
  int bits = 8;                              ///< of each channel; 16 only in png
  std::optional<ImageRange> range;
  std::optional<std::uint32_t> revision;  ///< at least this one
  std::optional<core::PixelRect> rect;    ///< pixels of the full film
  std::optional<int> max_size;            ///< longest side of the image
  DenoiseShow denoise = DenoiseShow::kOff;
  std::vector<float> mix;  ///< weights of the shares of the image, in the job's order; empty: none
  std::optional<Fireflies> fireflies;  ///< empty: set aside in display formats
  bool parts = false;                  ///< EXR of all layers: one part per layer
  bool stream = false;                 ///< sends every new revision, as multipart/x-mixed-replace
};
/// Returns a text that is equal for queries of equal images of one revision.
std::string image_key(const ImageQuery& query);
/// tone_maps: the allowed names.
Parsed<ImageQuery> parse_image_query(QueryParams query, std::span<const std::string> tone_maps);

/// For paths without parameters: any parameter gives 422.
Parsed<std::monostate> parse_no_query(QueryParams query);

/// 8-4-4-4-12 hex digits, any case.
bool is_uuid(std::string_view text);
/// Returns is_uuid(); if not, adds a fault. kind: "job", "batch".
bool expect_uuid(const std::string& text, std::string_view kind, const std::string& pointer,
                 Faults& faults);
/// 64 lower-case hex digits.
bool is_sha256(std::string_view text);

}  // namespace api
