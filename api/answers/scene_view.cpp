#include <nlohmann/json.hpp>

#include "api/answers/job_view.h"
#include "api/answers/views.h"
#include "api/json/values.h"

namespace api {
namespace {

struct CameraView {
  std::size_t index = 0;
  const core::CameraDescription& camera;
  core::Place origin;  ///< of the scene
};
struct SceneView {
  std::string_view id;
  const core::SceneSummary& summary;
};
struct SceneListView {
  std::span<const std::string> scenes;  ///< texts of scene_json()
  const std::optional<std::string>& next;
};
struct AssetView {
  std::string_view id;
  std::uint64_t bytes = 0;
};

constexpr double kDegreesPerRadian = 57.29577951308232;

// Returns the axis; `otherwise` for a node that is scaled to zero, whose camera looks along -z of
// the world.
Json axis_json(core::Vec3 axis, core::Vec3 otherwise) {
  return triple_json(core::length(axis) > 0 ? core::normalize(axis) : otherwise);
}

const View<core::SceneSummary>& bounds_view() {
  using Summary = core::SceneSummary;
  static const View<Summary> kView = {
      "",
      "Axis-aligned box, metres; null: empty.",
      {{"min", shape::triple(),
        [](const Summary& s) { return place_json(s.bounds.min, s.origin); }},
       {"max", shape::triple(),
        [](const Summary& s) { return place_json(s.bounds.max, s.origin); }}}};
  return kView;
}

Json fov_json(const CameraView& view) {
  return view.camera.orthographic
             ? Json(nullptr)
             : number_json(static_cast<float>(static_cast<double>(view.camera.vertical_fov_rad) *
                                              kDegreesPerRadian));
}

const View<CameraView>& camera_view() {
  static const View<CameraView> kView = {
      "SceneCamera",
      "A camera of the file.",
      {{"index", shape::count(), Member<&CameraView::index>::json},
       {"name", shape::text(), [](const CameraView& c) -> Json { return c.camera.name; }},
       {"type", shape::one_of({"perspective", "orthographic"}),
        [](const CameraView& c) -> Json {
          return c.camera.orthographic ? "orthographic" : "perspective";
        }},
       {"vertical_fov_degrees", shape::nullable(shape::real("Null: orthographic.")), &fov_json},
       {"position", shape::triple("Metres."),
        [](const CameraView& c) { return place_json(c.camera.to_world.t, c.origin); }},
       {"direction", shape::triple("Viewing direction, unit vector."),
        [](const CameraView& c) {
          return axis_json(-c.camera.to_world.z, {0, 0, -1});
        }},
       {"up", shape::triple("Unit vector."), [](const CameraView& c) {
          return axis_json(c.camera.to_world.y, {0, 1, 0});
        }}}};
  return kView;
}

Json cameras_json(const SceneView& view) {
  Json cameras = Json::array();
  for (const core::CameraDescription& camera : view.summary.cameras) {
    cameras.push_back(camera_view().print({cameras.size(), camera, view.summary.origin}));
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
    case core::PunctualType::kProfile:
      return "profile";
  }
  return "";
}

const View<SceneView>& scene_view() {
  static const View<SceneView> kView = {
      "Scene",
      "A loaded scene.",
      {{"id", shape::text("Value of `scene` in a job request."), Member<&SceneView::id>::json},
       {"name", shape::text(), [](const SceneView& s) -> Json { return s.summary.name; }},
       {"bytes", shape::count("Memory of geometry, acceleration structure and textures."),
        [](const SceneView& s) -> Json { return s.summary.bytes; }},
       {"bounds", shape::nullable(bounds_view().shape()),
        [](const SceneView& s) {
          return s.summary.bounds.empty() ? Json(nullptr) : bounds_view().print(s.summary);
        }},
       {"triangles", shape::count("Counted per use: a mesh used twice counts twice."),
        [](const SceneView& s) -> Json { return s.summary.triangles; }},
       {"instances", shape::count(),
        [](const SceneView& s) -> Json { return s.summary.instances; }},
       {"cameras", shape::list(camera_view().shape()), &cameras_json},
       {"lights", shape::list(light_view().shape(), "Punctual lights."),
        [](const SceneView& s) { return print_list(light_view(), s.summary.lights); }},
       {"light_groups", shape::texts("Names for the layers light:NAME."),
        [](const SceneView& s) -> Json { return s.summary.light_groups; }},
       {"materials", shape::texts("Names."),
        [](const SceneView& s) -> Json { return s.summary.materials; }},
       {"variants", shape::texts("Names."),
        [](const SceneView& s) -> Json { return s.summary.variants; }},
       {"animations", shape::texts("Names."),
        [](const SceneView& s) -> Json { return s.summary.animations; }},
       {"extensions", shape::texts("Extensions that the file uses."),
        [](const SceneView& s) -> Json { return s.summary.extensions; }},
       {"warnings", shape::texts(),
        [](const SceneView& s) {
          Json texts = Json::array();
          for (const core::Warning& warning : s.summary.warnings) {
            texts.push_back(warning.text());
          }
          return texts;
        }},
       {"warning_details", warning_details_shape(),
        [](const SceneView& s) { return print_list(warning_view(), s.summary.warnings); }}}};
  return kView;
}

const View<SceneListView>& scene_list_view() {
  static const View<SceneListView> kView = {
      "SceneList",
      "A page of scenes.",
      {{"scenes", shape::list(scene_view().shape(), "Newest first."),
        [](const SceneListView& l) {
          Json list = Json::array();
          for (const std::string& scene : l.scenes) {
            list.push_back(Json::parse(scene));
          }
          return list;
        }},
       {"next", shape::nullable(shape::text("Cursor of the next page; null: the last one.")),
        [](const SceneListView& l) { return or_null(l.next); }}}};
  return kView;
}

const View<AssetView>& asset_view() {
  static const View<AssetView> kView = {
      "Asset",
      "A stored file.",
      {{"id", shape::text("sha256, hex."), Member<&AssetView::id>::json},
       {"bytes", shape::count(), Member<&AssetView::bytes>::json}}};
  return kView;
}

}  // namespace

const View<core::Warning>& warning_view() {
  using core::Warning;
  static const View<Warning> kView = {
      "Warning",
      "What was read otherwise than the file says, or not at all. Its text in `warnings` is "
      "`pointer: detail`.",
      {{"code",
        shape::text("Kind: `clamped`, `normalized`, `missing`, `padding`, `left_out`, `not_drawn`, "
                    "`animation_ignored`, `extension_ignored`, ... Further kinds may be added."),
        Member<&Warning::code>::json},
       {"pointer", shape::text("JSON pointer into the glTF document; empty: none."),
        Member<&Warning::pointer>::json},
       {"detail", shape::text("What was seen, and what was done."),
        Member<&Warning::detail>::json}}};
  return kView;
}

Json warning_details_shape() {
  return shape::list(warning_view().shape(),
                     "Those of `warnings` that are about the scene's file, for programs.");
}

const View<core::PunctualLightDescription>& light_view() {
  using Light = core::PunctualLightDescription;
  static const View<Light> kView = {
      "SceneLight",
      "A punctual light of the file.",
      {{"name", shape::text(), Member<&Light::name>::json},
       {"type", shape::one_of({"directional", "point", "spot", "profile"}),
        [](const Light& l) -> Json { return light_type(l.type); }},
       {"intensity",
        shape::triple("W/sr, or W/m2 if directional, or a factor of a light profile; linear RGB."),
        [](const Light& l) {
          return triple_json(core::Vec3{l.intensity.r, l.intensity.g, l.intensity.b});
        }}}};
  return kView;
}

std::string scene_json(std::string_view id, const core::SceneSummary& summary) {
  return dump(scene_view().print({id, summary}));
}

std::string known_scene_json(std::string scene, std::string_view name) {
  Json body = Json::parse(scene, nullptr, false);
  if (!body.is_object() || body.value("name", "") == name) {
    return scene;
  }
  const core::Warning warning(
      "name", "", "the file is known as \"" + body.value("name", "") + "\", and keeps this name");
  body["warnings"].push_back(warning.text());
  body["warning_details"].push_back(warning_view().print(warning));
  return dump(body);
}

std::string scene_list_json(std::span<const std::string> scenes,
                            const std::optional<std::string>& next) {
  return dump(scene_list_view().print({scenes, next}));
}

std::string asset_json(std::string_view id, std::uint64_t bytes) {
  return dump(asset_view().print({id, bytes}));
}

void add_scene_schemas(Json& components) {
  asset_view().add_to(components);
  warning_view().add_to(components);
  camera_view().add_to(components);
  light_view().add_to(components);
  scene_view().add_to(components);
  scene_list_view().add_to(components);
}

}  // namespace api
