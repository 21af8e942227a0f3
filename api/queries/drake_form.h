/// The form of Drake's glTF render protocol (Drake, geometry/render_gltf_client): a scene, the
/// intrinsics of a camera that the scene places, and the kind of image.
#pragma once

#include <optional>
#include <string>

#include "api/problem.h"
#include "api/requests.h"

namespace api {

struct DrakeForm {
  std::string scene_sha256;  ///< of the part `scene`
  std::string image_type;    ///< color, depth or label
  int width = 0;
  int height = 0;
  std::optional<double> focal_x;  ///< pixels, as the next three
  std::optional<double> focal_y;
  std::optional<double> center_x;
  std::optional<double> center_y;
  std::optional<double> min_depth;  ///< metres; of depth images, as the next
  std::optional<double> max_depth;
};
/// fields: of text. The protocol's other fields, and unknown ones, are not read.
Parsed<DrakeForm> parse_drake_form(QueryParams fields);

/// Returns a JobRequest without its scene: film and camera.
std::string drake_job(const DrakeForm& form);

}  // namespace api
