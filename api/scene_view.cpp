#include <nlohmann/json.hpp>

#include "api/job_view.h"
#include "api/values.h"

namespace api {
namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;

Json bounds_json(const core::Bounds& bounds) {
  if (bounds.empty()) {
    return nullptr;
  }
  return {{"min", triple_json(bounds.min)}, {"max", triple_json(bounds.max)}};
}

// A node may be scaled to nothing: such a camera looks along -z of the world.
Json axis_json(core::Vec3 axis, core::Vec3 otherwise) {
  return triple_json(core::length(axis) > 0 ? core::normalize(axis) : otherwise);
}

Json cameras_json(const core::SceneSummary& summary) {
  Json cameras = Json::array();
  for (const core::CameraDescription& camera : summary.cameras) {
    Json row = {{"index", cameras.size()},
                {"name", camera.name},
                {"type", camera.orthographic ? "orthographic" : "perspective"}};
    row["vertical_fov_degrees"] =
        camera.orthographic
            ? Json(nullptr)
            : number_json(static_cast<float>(static_cast<double>(camera.vertical_fov_rad) *
                                             kDegreesPerRadian));
    row["position"] = triple_json(camera.to_world.t);
    row["direction"] = axis_json(-camera.to_world.z, {0, 0, -1});
    row["up"] = axis_json(camera.to_world.y, {0, 1, 0});
    cameras.push_back(std::move(row));
  }
  return cameras;
}

std::string_view light_type(core::PunctualType type) {
  switch (type) {
    case core::PunctualType::kDirectional:
      return "directional";
    case core::PunctualType::kPoint:
      return "point";
    case core::PunctualType::kSpot:
      return "spot";
  }
  return "";
}

Json lights_json(const core::SceneSummary& summary) {
  Json lights = Json::array();
  for (const core::PunctualLightDescription& light : summary.lights) {
    const core::Rgb intensity = light.intensity;
    lights.push_back({{"name", light.name},
                      {"type", light_type(light.type)},
                      {"intensity", triple_json({intensity.r, intensity.g, intensity.b})}});
  }
  return lights;
}

}  // namespace

std::string scene_json(std::string_view id, const core::SceneSummary& summary) {
  Json body;
  body["id"] = id;
  body["name"] = summary.name;
  body["bytes"] = summary.bytes;
  body["bounds"] = bounds_json(summary.bounds);
  body["triangles"] = summary.triangles;
  body["instances"] = summary.instances;
  body["cameras"] = cameras_json(summary);
  body["lights"] = lights_json(summary);
  body["materials"] = summary.materials;
  body["variants"] = summary.variants;
  body["animations"] = summary.animations;
  body["extensions"] = summary.extensions;
  body["warnings"] = summary.warnings;
  return dump(body);
}

std::string scene_list_json(std::span<const std::string> scenes,
                            const std::optional<std::string>& next) {
  std::string body = R"({"scenes":[)";
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    body += (i == 0 ? "" : ",") + scenes[i];
  }
  return body + R"(],"next":)" + dump(next ? Json(*next) : Json(nullptr)) + "}";
}

std::string asset_json(std::string_view id, std::uint64_t bytes) {
  return dump({{"id", id}, {"bytes", bytes}});
}

}  // namespace api
