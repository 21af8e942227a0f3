// The irradiance meter of a job: "meter": {"points": [...], "plane": {...}}.

#include <tuple>

#include "api/job/job_rows.h"
#include "api/json/fields.h"
#include "api/json/limits.h"

namespace api {
namespace {

constexpr Range kMetres = {-limits::kMetres, limits::kMetres};

const auto& point_table() {
  static constexpr auto kTable = std::tuple{
      triple("position", &core::MeterPoint::position, kMetres, "World space, metres."),
      triple("normal", &core::MeterPoint::normal, kMetres, "Normal; any length except 0."),
  };
  return kTable;
}

const auto& plane_table() {
  static constexpr auto kTable = std::tuple{
      triple("origin", &core::MeterPlane::origin, kMetres,
             "Corner of the rectangle, world space, metres."),
      triple("edge_u", &core::MeterPlane::edge_u, kMetres,
             "Vector from origin to the next corner; the plane faces along edge_u x edge_v."),
      triple("edge_v", &core::MeterPlane::edge_v, kMetres,
             "Vector from origin to the other adjacent corner."),
      number("columns", &core::MeterPlane::columns, {1, limits::kMeterPoints},
             "Cells along edge_u."),
      number("rows", &core::MeterPlane::rows, {1, limits::kMeterPoints}, "Cells along edge_v."),
  };
  return kTable;
}

/// Requires all members of the table.
template <typename Table, typename S>
void read_whole(const Table& table, const Json& value, S& out, const std::string& pointer,
                Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  for (const std::string_view member : member_names(table)) {
    if (!value.contains(std::string(member))) {
      faults.add(join_pointer(pointer, member), "is required");
    }
  }
  read_members(table, value, out, pointer, faults);
}

template <typename Table, typename S>
Json whole_schema(const Table& table, const S& defaults, std::string_view doc) {
  Json schema = object_schema(table, defaults, doc);
  for (auto& property : schema["properties"]) {
    property.erase("default");
  }
  schema["required"] = member_names(table);
  return schema;
}

bool has_length(core::Vec3 v) { return std::isnormal(dot(v, v)); }

void read_points(const Json& value, core::MeterSettings& out, const std::string& pointer,
                 Faults& faults) {
  if (!value.is_array()) {
    faults.add(pointer, "expected an array of points, got " + std::string(type_text(value)));
    return;
  }
  for (std::size_t i = 0; i < value.size() && faults.empty(); ++i) {
    const std::string place = join_pointer(pointer, std::to_string(i));
    core::MeterPoint point;
    read_whole(point_table(), value[i], point, place, faults);
    if (faults.empty() && !has_length(point.normal)) {
      faults.add(join_pointer(place, "normal"), "is the zero vector");
    }
    out.points.push_back(point);
  }
}

void read_plane(const Json& value, core::MeterSettings& out, const std::string& pointer,
                Faults& faults) {
  out.plane.reset();
  if (value.is_null()) {
    return;
  }
  core::MeterPlane plane;
  read_whole(plane_table(), value, plane, pointer, faults);
  if (faults.empty() && !has_length(cross(plane.edge_u, plane.edge_v))) {
    faults.add(pointer, "edge_u and edge_v do not span a rectangle");
  }
  out.plane = plane;
}

const auto& meter_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<core::MeterSettings>{
          "points", &read_points,
          [](const core::MeterSettings& s, Json& object) {
            object["points"] = Json::array();
            for (const core::MeterPoint& point : s.points) {
              object["points"].push_back(print_members(point_table(), point));
            }
          },
          [](const core::MeterSettings&) {
            Json schema = basic_schema("array", "Points at which irradiance is measured.");
            schema["items"] =
                whole_schema(point_table(), core::MeterPoint{}, "A point with its normal.");
            schema["maxItems"] = limits::kMeterPoints;
            schema["default"] = Json::array();
            return schema;
          }},
      CustomRow<core::MeterSettings>{
          "plane", &read_plane,
          [](const core::MeterSettings& s, Json& object) {
            object["plane"] = s.plane ? print_members(plane_table(), *s.plane) : Json(nullptr);
          },
          [](const core::MeterSettings&) {
            Json schema = whole_schema(plane_table(), core::MeterPlane{},
                                       "Points at the centres of the cells of a rectangle, row by "
                                       "row; they follow the single points.");
            schema["type"] = {"object", "null"};
            schema["default"] = nullptr;
            return schema;
          }},
  };
  return kTable;
}

}  // namespace

void read_meter(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  core::MeterSettings& meter = spec.render.meter;
  meter = {};
  if (value.is_null() || !expect_object(value, pointer, faults)) {
    return;
  }
  Faults own;
  read_members(meter_table(), value, meter, pointer, own);
  if (!own.empty()) {
    faults.append(own);
  } else if (meter.empty()) {
    faults.add(pointer, "has neither points nor a plane");
  } else if (meter.count() > static_cast<std::size_t>(limits::kMeterPoints)) {
    faults.add(pointer, "has " + std::to_string(meter.count()) + " points; at most " +
                            std::to_string(limits::kMeterPoints) + " are allowed");
  }
}

void print_meter(const JobSpec& spec, Json& object) {
  object["meter"] =
      spec.render.meter.empty() ? Json(nullptr) : print_members(meter_table(), spec.render.meter);
}

Json meter_schema(const JobSpec& /*defaults*/) {
  Json schema = object_schema(
      meter_table(), core::MeterSettings{},
      "Points at which irradiance is measured in addition to the image, by path tracing with 16 "
      "paths for each sample of a pixel; see GET /v1/jobs/{id}/meter.");
  schema["type"] = {"object", "null"};
  schema["default"] = nullptr;
  return schema;
}

}  // namespace api
