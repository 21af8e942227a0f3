/// GET /v1/jobs/{id}/objects: the objects, materials and camera to which the ids in the layers
/// refer.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/math/bounds.h"
#include "core/math/place.h"
#include "core/math/transform.h"
#include "core/settings/settings.h"

namespace api {

struct BoxView {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;
  std::uint64_t pixels = 0;  ///< number of pixels that show it
};

struct PlaceView {
  core::Place origin;              ///< of the scene
  core::Bounds bounds;             ///< from the origin; empty: not in the scene
  std::optional<BoxView> visible;  ///< of pixels whose centre shows it
  std::optional<BoxView> amodal;   ///< of its part within the film, hidden or not
};

struct ObjectView {
  std::uint32_t id = 0;
  std::string pointer;  ///< JSON pointer into the glTF document
  std::string name;     ///< unique
  std::uint32_t first_instance = 0;
  std::uint32_t instances = 1;
  PlaceView place;
};
struct InstanceView {
  std::uint32_t id = 0;
  std::uint32_t object = 0;
  PlaceView place;
};
struct LabelView {
  std::uint32_t id = 0;
  std::string pointer;  ///< "": the default material, which is in no document
  std::string name;     ///< "" for primitives
};
struct ViewpointView {
  core::CameraType type = core::CameraType::kPerspective;
  int width = 0;
  int height = 0;
  std::array<double, 2> scale_px{};   ///< fx and fy
  std::array<double, 2> center_px{};  ///< cx and cy
  core::DistortionSettings distortion;
  core::Place origin;        ///< of the scene
  core::Transform to_world;  ///< from the origin; x to the right, y up, looks along -z
};
struct ObjectsView {
  ViewpointView camera;
  bool has_ids = false;  ///< whether the job recorded the layers
  std::vector<ObjectView> objects;
  std::vector<InstanceView> instances;
  std::vector<LabelView> materials;
  std::vector<LabelView> primitives;
};
std::string objects_json(const ObjectsView& objects);

}  // namespace api
