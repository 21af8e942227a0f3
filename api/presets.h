/// Presets: job templates of a tenant, and images by URL that are made from them.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/job/job_spec.h"
#include "api/requests.h"

namespace api {

/// PUT /v1/presets/{name}.
struct Preset {
  std::string job = "{}";                 ///< JSON of a JobRequest without scene
  int priority = 0;                       ///< that of `job`
  bool is_public = false;                 ///< its images need no signature
  std::vector<std::array<int, 2>> sizes;  ///< of public images besides the film's own, pixels
  double deadline_seconds = 2;            ///< longest wait of the first request of an image
  bool is_turntable = false;              ///< the model has the same size at every theta
};
/// Problems: also those of parse_job(), at "/job/...".
Parsed<Preset> parse_preset(std::string_view body);
/// PUT: also refuses a preset of which no URL has an image, since the job sets what the URL sets,
/// or a size has too many pixels.
Parsed<Preset> parse_new_preset(std::string_view body);
std::string preset_json(std::string_view name, const Preset& preset);
std::string preset_list_json(const std::map<std::string, Preset>& presets);

/// Returns the presets of all tenants by name; one that a tenant stores under the name replaces it.
const std::map<std::string, Preset>& ready_presets();

/// Returns whether the name has 1 to 64 letters, digits, `.`, `_` and `-`, and is not that of a
/// built-in light.
bool is_preset_name(std::string_view text);

/// POST /v1/signing-keys.
struct SigningKeyView {
  std::string id;
  std::string key;
};
std::string signing_key_json(const SigningKeyView& key);
struct SigningKeyRowView {
  std::string id;
  std::string tenant;
  double created_at = 0;  ///< Unix seconds
};
std::string signing_key_list_json(std::span<const SigningKeyRowView> keys);

/// The last part of an image's URL, `30,75.webp`, and its query.
struct PictureUrl {
  std::string scene;  ///< id or built-in name
  std::optional<std::string> variant;
  double theta_degrees = 0;
  double phi_degrees = 0;
  std::string format;  ///< extension
  std::optional<double> width;
  std::optional<double> height;
  double pixel_ratio = 1;
};
/// scene: SCENE[:VARIANT]. view: THETA,PHI.FORMAT.
Parsed<PictureUrl> parse_picture_url(std::string_view scene, std::string_view view,
                                     QueryParams query);
struct PictureJob {
  ParsedJob job;
  bool is_size_listed = false;  ///< the film's own, or one of the preset's sizes
  bool is_view_listed = false;  ///< whole degrees, or the angles of the preset's own orbit
};
/// Problems: of parse_job(), such as 413 for too many pixels.
Parsed<PictureJob> parse_picture_job(const Preset& preset, const PictureUrl& url);

}  // namespace api
