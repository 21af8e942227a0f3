/// POST /v1/render: a picture by one request. The settings of the query, and the job that they make
/// together with the uploads.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "api/job/job_spec.h"
#include "api/requests.h"
#include "core/scene/scene.h"
#include "core/settings/settings.h"

namespace api {

struct RenderQuery {
  std::string scene;  ///< id or built-in name; empty: uploaded, or named by the job
  std::optional<std::array<int, 2>> size;  ///< width and height, pixels
  std::optional<double> relative_error;
  std::optional<double> seconds;
  std::optional<int> samples;  ///< per pixel
  std::string preset;          ///< a built-in light, or a stored preset; empty: none
  std::optional<core::GroundType> ground;
  std::optional<double> theta_degrees;  ///< of core::CameraOrbit
  std::optional<double> phi_degrees;
  std::optional<std::string> variant;
  std::string format;  ///< extension; empty: by Accept
  std::optional<double> wait_seconds;
  ImageQuery look;
  bool has_exposure = false;  ///< the query names one
};
/// Returns whether the query names a stored preset.
bool names_stored_preset(const RenderQuery& query);
/// tone_maps: as parse_image_query().
Parsed<RenderQuery> parse_render_query(QueryParams query, std::span<const std::string> tone_maps);

/// Uploads of the same request.
struct RenderUploads {
  std::string scene = {};                             ///< id; empty: none
  std::optional<std::string> environment_asset = {};  ///< id
  std::string preset_job = {};                        ///< of the stored preset: JSON; empty: none
};
/// job: JSON of a JobRequest, whose `scene` may be missing; empty: none. The query is merged into
/// it (RFC 7396). Without any stop rule, the job ends at kRenderError or after kRenderSeconds.
/// Problems: as of parse_job(), and 422 at /scene unless there is exactly one.
Parsed<ParsedJob> parse_render_job(std::string_view job, const RenderQuery& query,
                                   const RenderUploads& uploads);

/// Frames the model: where the job has an orbit with an automatic radius and target, or no camera
/// of its own or the file's, the radius becomes the least one that leaves kRenderMargin of the
/// image's width and height free on each side: as much as product pages leave (a judgement).
/// is_turntable: on each side of the image of every theta, so that the model keeps its size.
void frame_model(JobSpec& spec, const core::SceneSummary& scene, bool is_turntable);
inline constexpr float kRenderMargin = 0.08F;

/// An error that few viewers see, and a time that fits into the longest wait of most proxies.
inline constexpr double kRenderError = 0.03;
inline constexpr double kRenderSeconds = 10;

}  // namespace api
