// Members of "camera" for calibrated cameras: shift, pose and distortion.

#include <algorithm>
#include <cstddef>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "api/job/job_rows.h"
#include "api/json/fields.h"
#include "api/json/limits.h"

namespace api {
namespace {

constexpr double kShiftMost = 100;  ///< widths of the film
constexpr double kCoefficientMost = 1e6;

/// Reads an array of `least` to `most` numbers.
std::optional<std::vector<double>> read_numbers(const Json& value, std::size_t least,
                                                std::size_t most, double limit,
                                                const std::string& pointer, Faults& faults) {
  if (!value.is_array() || value.size() < least || value.size() > most) {
    const std::string count = least == most ? std::to_string(most)
                                            : std::to_string(least) + " to " + std::to_string(most);
    faults.add(pointer, "expected an array of " + count + " numbers, got " +
                            (value.is_array() ? std::to_string(value.size()) + " elements"
                                              : std::string(type_text(value))));
    return {};
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const auto number =
        read_number(value[i], {-limit, limit}, join_pointer(pointer, std::to_string(i)), faults);
    if (!number) {
      return {};
    }
    numbers.push_back(*number);
  }
  return numbers;
}

Json numbers_json(std::span<const double> numbers) {
  Json out = Json::array();
  for (const double number : numbers) {
    out.push_back(number_json(number));
  }
  return out;
}

Json numbers_schema(std::string_view doc, std::size_t least, std::size_t most, double limit) {
  Json schema = basic_schema("array", doc);
  schema["items"] = {{"type", "number"}};
  add_range(schema["items"], {-limit, limit});
  schema["minItems"] = least;
  schema["maxItems"] = most;
  return schema;
}

const auto& pose_table() {
  using core::CameraPose;
  static constexpr auto kTable = std::tuple{
      choice("convention", &CameraPose::convention, &core::pose_conventions,
             "Axes of the camera. The world's are always those of the scene, y up."),
      CustomRow<CameraPose>{
          "matrix",
          [](const Json& value, CameraPose& out, const std::string& pointer, Faults& faults) {
            if (const auto numbers =
                    read_numbers(value, 16, 16, limits::kMetres, pointer, faults)) {
              std::copy(numbers->begin(), numbers->end(), out.matrix.begin());
            }
          },
          [](const CameraPose& s, Json& object) { object["matrix"] = numbers_json(s.matrix); },
          [](const CameraPose&) {
            return numbers_schema(
                "4x4, row by row, from the camera's axes to the world, metres (the inverse of "
                "OpenCV's extrinsics): a rotation and the camera's position.",
                16, 16, limits::kMetres);
          },
          true}};
  return kTable;
}

const auto& distortion_table() {
  using core::DistortionSettings;
  static constexpr std::size_t kMost = 12;
  static constexpr auto kTable = std::tuple{
      choice("model", &DistortionSettings::model, &core::distortion_models, "Formula."),
      CustomRow<DistortionSettings>{
          "k",
          [](const Json& value, DistortionSettings& out, const std::string& pointer,
             Faults& faults) {
            if (auto numbers = read_numbers(value, 0, kMost, kCoefficientMost, pointer, faults)) {
              out.k = *std::move(numbers);
            }
          },
          [](const DistortionSettings& s, Json& object) { object["k"] = numbers_json(s.k); },
          [](const DistortionSettings& defaults) {
            Json schema = numbers_schema(
                "Coefficients in OpenCV's order: 4, 5, 8 or 12 for opencv, 4 for fisheye.", 0,
                kMost, kCoefficientMost);
            schema["default"] = numbers_json(defaults.k);
            return schema;
          }}};
  return kTable;
}

}  // namespace

void read_shift(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.camera.shift.reset();
  if (value.is_null()) {
    return;
  }
  if (const auto numbers = read_numbers(value, 2, 2, kShiftMost, pointer, faults)) {
    spec.camera.shift =
        core::Vec2{static_cast<float>((*numbers)[0]), static_cast<float>((*numbers)[1])};
  }
}

void print_shift(const JobSpec& spec, Json& object) {
  const auto& shift = spec.camera.shift;
  object["shift"] =
      shift ? Json::array({number_json(shift->x), number_json(shift->y)}) : Json(nullptr);
}

Json shift_schema(const JobSpec& /*defaults*/) {
  Json schema = numbers_schema(
      "Lens shift of a perspective camera: how far the view moves to the right and up, in widths "
      "and heights of the film. Verticals stay vertical.",
      2, 2, kShiftMost);
  schema["type"] = {"array", "null"};
  schema["default"] = nullptr;
  return schema;
}

void read_pose(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.camera.pose.reset();
  if (!value.is_null()) {
    read_members(pose_table(), value, spec.camera.pose.emplace(), pointer, faults);
  }
}

void print_pose(const JobSpec& spec, Json& object) {
  const auto& pose = spec.camera.pose;
  object["pose"] = pose ? print_members(pose_table(), *pose) : Json(nullptr);
}

Json pose_schema(const JobSpec& /*defaults*/) {
  Json schema = object_schema(pose_table(), core::CameraPose{},
                              "Position and rotation as a matrix, instead of position, target and "
                              "up.");
  schema["type"] = {"object", "null"};
  schema["default"] = nullptr;
  return schema;
}

void read_distortion(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.camera.distortion = {};
  if (!value.is_null()) {
    read_members(distortion_table(), value, spec.camera.distortion, pointer, faults);
  }
}

void print_distortion(const JobSpec& spec, Json& object) {
  object["distortion"] = distortion_json(spec.camera.distortion);
}

Json distortion_json(const core::DistortionSettings& distortion) {
  return print_members(distortion_table(), distortion);
}

Json distortion_shape() {
  return object_schema(distortion_table(), core::DistortionSettings{},
                       "Lens distortion of a pinhole camera.");
}

Json distortion_schema(const JobSpec& /*defaults*/) {
  Json schema = distortion_shape();
  schema["type"] = {"object", "null"};
  return schema;
}

}  // namespace api
