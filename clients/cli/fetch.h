/// Download of a job's image.
#pragma once

#include <string>

#include "clients/cli/api_client.h"
#include "clients/cli/look_flags.h"

namespace cli {

struct PictureQuery {
  std::string layer;      ///< empty: the beauty image (EXR: every layer)
  std::string exposure;   ///< stops or auto; empty: 0
  std::string tone_map;   ///< empty: the server's default
  std::string denoise;    ///< off, mixed, full; empty: off
  std::string fireflies;  ///< set_aside, keep; empty: by the format
  LookFlags look = {};
};

/// Writes the image of the job at `path` to `output`, whose extension is the format ("-": PNG to
/// stdout).
core::Status fetch_picture(ApiClient& client, const std::string& path, const PictureQuery& query,
                           const std::string& output);
/// Refuses exposure, tone map and look where the format cannot honour them, unless they have no
/// effect.
core::Status check_look(const PictureQuery& query, const std::string& output);
/// Returns an error if the extension is not that of an image format.
core::Status check_picture_name(const std::string& output);

}  // namespace cli
