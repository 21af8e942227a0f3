// A camera position on an orbit: "camera": {"orbit": {...}}.

#include <tuple>

#include "api/job/job_rows.h"
#include "api/json/fields.h"
#include "api/json/limits.h"

namespace api {
namespace {

/// Reads a member that is "auto" (empty) or a value of read_value.
bool is_automatic(const Json& value) {
  return value.is_string() && value.get_ref<const std::string&>() == "auto";
}

void read_orbit_radius(const Json& value, core::CameraOrbit& out, const std::string& pointer,
                       Faults& faults) {
  out.radius_m.reset();
  if (is_automatic(value)) {
    return;
  }
  if (!value.is_number()) {
    faults.add(pointer, "expected 'auto' or a number, got " + std::string(type_text(value)));
  } else if (const auto metres = read_number(value, {0, limits::kMetres, true}, pointer, faults)) {
    out.radius_m = static_cast<float>(*metres);
  }
}

void read_orbit_target(const Json& value, core::CameraOrbit& out, const std::string& pointer,
                       Faults& faults) {
  out.target.reset();
  if (is_automatic(value)) {
    return;
  }
  if (!value.is_array()) {
    faults.add(pointer, "expected 'auto' or an array of three numbers, got " +
                            std::string(type_text(value)));
  } else if (const auto point =
                 read_triple(value, {-limits::kMetres, limits::kMetres}, pointer, faults)) {
    out.target = *point;
  }
}

/// Returns the schema of `other` or the word "auto".
Json automatic_or(Json other, std::string_view doc) {
  return {{"description", doc},
          {"anyOf", Json::array({Json{{"type", "string"}, {"enum", Json::array({"auto"})}},
                                 std::move(other)})},
          {"default", "auto"}};
}

const auto& orbit_table() {
  static constexpr auto kTable = std::tuple{
      number(
          "theta_degrees", &core::CameraOrbit::theta_degrees,
          {-limits::kAngleDegrees, limits::kAngleDegrees},
          "Angle of the camera about +y, counter-clockwise seen from above; 0 is in front (+z)."),
      number("phi_degrees", &core::CameraOrbit::phi_degrees, {0, limits::kPhiDegrees},
             "Angle from +y: 0 looks down from above, 90 is level."),
      CustomRow<core::CameraOrbit>{
          "radius", &read_orbit_radius,
          [](const core::CameraOrbit& s, Json& object) {
            object["radius"] = s.radius_m ? number_json(*s.radius_m) : Json("auto");
          },
          [](const core::CameraOrbit&) {
            Json metres = {{"type", "number"}};
            add_range(metres, {0, limits::kMetres, true});
            return automatic_or(
                std::move(metres),
                "Distance from the target, metres; 'auto': the whole scene is in view.");
          }},
      CustomRow<core::CameraOrbit>{
          "target", &read_orbit_target,
          [](const core::CameraOrbit& s, Json& object) {
            object["target"] = s.target ? triple_json(*s.target) : Json("auto");
          },
          [](const core::CameraOrbit&) {
            return automatic_or(triple_schema("", {-limits::kMetres, limits::kMetres}, false),
                                "Point that the camera looks at, metres; 'auto': the centre of the "
                                "scene's box.");
          }},
  };
  return kTable;
}

}  // namespace

void read_orbit(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.orbit.reset();
  if (!value.is_null()) {
    read_members(orbit_table(), value, spec.orbit.emplace(), pointer, faults);
  }
}

void print_orbit(const JobSpec& spec, Json& object) {
  object["orbit"] = spec.orbit ? print_members(orbit_table(), *spec.orbit) : Json(nullptr);
}

Json orbit_schema(const JobSpec& /*defaults*/) {
  Json schema =
      object_schema(orbit_table(), core::CameraOrbit{},
                    "Position on a sphere around the target, instead of position and target.");
  schema["type"] = {"object", "null"};
  schema["default"] = nullptr;
  return schema;
}

}  // namespace api
