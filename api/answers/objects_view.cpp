#include "api/answers/objects_view.h"

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/job/job_rows.h"
#include "api/json/json.h"
#include "api/json/values.h"
#include "core/settings/choices.h"

namespace api {
namespace {

Json triple_of(core::Place p) { return Json::array({p.x, p.y, p.z}); }

Json box_shape(std::string_view doc, bool has_pixels) {
  Json shape = shape::object(doc);
  for (const char* name : {"x", "y", "width", "height"}) {
    shape["properties"][name] = shape::real();
    shape["required"].push_back(name);
  }
  if (has_pixels) {
    shape["properties"]["pixels"] = shape::count("Number of pixels that show it.");
    shape["required"].push_back("pixels");
  }
  shape["additionalProperties"] = false;
  return shape::nullable(std::move(shape));
}

Json box_json(const std::optional<BoxView>& box, bool has_pixels) {
  if (!box) {
    return nullptr;
  }
  Json out = {{"x", box->x}, {"y", box->y}, {"width", box->width}, {"height", box->height}};
  if (has_pixels) {
    out["pixels"] = box->pixels;
  }
  return out;
}

Json bounds_shape() {
  Json shape = shape::object("Bounding box in world space, metres; null: not in this view.");
  for (const char* name : {"min", "max"}) {
    shape["properties"][name] = shape::triple();
    shape["required"].push_back(name);
  }
  shape["additionalProperties"] = false;
  return shape::nullable(std::move(shape));
}

Json bounds_json(const PlaceView& place) {
  const core::Bounds& bounds = place.bounds;
  return bounds.empty() ? Json(nullptr)
                        : Json{{"min", triple_of(place.origin + bounds.min)},
                               {"max", triple_of(place.origin + bounds.max)}};
}

template <typename S>
std::vector<ViewRow<S>> place_rows() {
  return {{"bounds", bounds_shape(), [](const S& s) { return bounds_json(s.place); }},
          {"visible",
           box_shape("Bounding box of the pixels whose centre shows it, on the full film; null: "
                     "none, or the job did not record ids.",
                     true),
           [](const S& s) { return box_json(s.place.visible, true); }},
          {"amodal",
           box_shape(
               "Bounding box of its part within the film, hidden or not, in pixels; null: nothing.",
               false),
           [](const S& s) { return box_json(s.place.amodal, false); }}};
}

template <typename S>
std::vector<ViewRow<S>> with_place(std::vector<ViewRow<S>> rows) {
  for (ViewRow<S>& row : place_rows<S>()) {
    rows.push_back(std::move(row));
  }
  return rows;
}

Json matrix_json(const ViewpointView& c) {
  Json rows = Json::array();
  for (const core::Place column : {core::Place(c.to_world.x), core::Place(c.to_world.y),
                                   core::Place(c.to_world.z), c.origin + c.to_world.t}) {
    for (const double v : {column.x, column.y, column.z}) {
      rows.push_back(v);
    }
    rows.push_back(rows.size() == 15 ? 1 : 0);
  }
  return rows;
}

/// Returns the inverse of to_world, with y down and z forward.
Json world_to_camera(const ViewpointView& c) {
  Json rows = Json::array();
  for (const core::Vec3 axis : {c.to_world.x, -c.to_world.y, -c.to_world.z}) {
    double along = 0;  // component of the camera's position
    for (int i = 0; i < 3; ++i) {
      along += static_cast<double>(axis[i]) * (c.origin + c.to_world.t)[i];
      rows.push_back(static_cast<double>(axis[i]));
    }
    rows.push_back(0 - along);  // 0 - x is never -0
  }
  for (const int v : {0, 0, 0, 1}) {
    rows.push_back(v);
  }
  return rows;
}

std::vector<std::string_view> camera_type_names() {
  std::vector<std::string_view> names;
  for (const auto& row : core::camera_types()) {
    names.push_back(row.name);
  }
  return names;
}

const View<ViewpointView>& viewpoint_view() {
  static const View<ViewpointView> kView = {
      "",
      "The camera without its lens. With (x, y, z) = world_to_camera (X, Y, Z, 1) the point is "
      "seen at the pixel (cx + fx x / z, cy + fy y / z) of a perspective or pinhole image, where z "
      "> 0, after the lens's distortion has moved (x / z, y / z); at (cx + fx x, cy + fy y) of an "
      "orthographic one; and at (cx + fx atan2(x, z), cy + fy atan2(y, hypot(x, z))) of a "
      "panorama. Pixel i goes from i to i + 1; for tools that count from its centre, subtract 0.5.",
      {{"type", shape::one_of(camera_type_names()),
        [](const ViewpointView& c) -> Json {
          return core::row_of(core::camera_types(), c.type).name;
        }},
       {"width", shape::count(), Member<&ViewpointView::width>::json},
       {"height", shape::count(), Member<&ViewpointView::height>::json},
       {"fx",
        shape::real(
            "Focal length in pixels; orthographic: pixels per metre; panorama: pixels per radian."),
        [](const ViewpointView& c) -> Json { return c.scale_px[0]; }},
       {"fy", shape::real(), [](const ViewpointView& c) -> Json { return c.scale_px[1]; }},
       {"cx", shape::real("Principal point; the centre of pixel 0 is at 0.5."),
        [](const ViewpointView& c) -> Json { return c.center_px[0]; }},
       {"cy", shape::real(), [](const ViewpointView& c) -> Json { return c.center_px[1]; }},
       {"distortion", distortion_shape(),
        [](const ViewpointView& c) { return distortion_json(c.distortion); }},
       {"world_to_camera",
        shape::reals(
            "16 numbers, row by row; x to the right, y down, z forward, as in OpenCV and COCO."),
        &world_to_camera},
       {"to_world",
        shape::reals("16 numbers, column by column; x to the right, y up, -z forward, as in glTF."),
        &matrix_json}}};
  return kView;
}

const View<ObjectView>& object_view() {
  using Object = ObjectView;
  static const View<Object> kView = {
      "SceneObject", "A node of the file that shows a mesh.",
      with_place<Object>(
          {{"id", shape::count("Id in the layer object: 1 + the node's index."),
            Member<&Object::id>::json},
           {"pointer", shape::text("JSON pointer into the glTF document."),
            Member<&Object::pointer>::json},
           {"name", shape::text("Name of the node or its mesh, made unique; used by Cryptomatte."),
            Member<&Object::name>::json},
           {"first_instance", shape::count("Id in the layer instance."),
            Member<&Object::first_instance>::json},
           {"instances", shape::count("Number of consecutive ids in the layer instance."),
            Member<&Object::instances>::json}})};
  return kView;
}

const View<InstanceView>& instance_view() {
  using Instance = InstanceView;
  static const View<Instance> kView = {
      "ObjectInstance", "An instance of an object that the image shows.",
      with_place<Instance>(
          {{"id", shape::count("Id in the layer instance."), Member<&Instance::id>::json},
           {"object", shape::count("Id of its object."), Member<&Instance::object>::json}})};
  return kView;
}

const View<LabelView>& label_view() {
  static const View<LabelView> kView = {
      "Label",
      "Meaning of an id in the layers material and primitive.",
      {{"id", shape::count(), Member<&LabelView::id>::json},
       {"pointer", shape::nullable(shape::text("Null: glTF's default material.")),
        [](const LabelView& l) { return text_or_null(l.pointer); }},
       {"name", shape::text(), Member<&LabelView::name>::json}}};
  return kView;
}

const View<ObjectsView>& objects_view() {
  using Objects = ObjectsView;
  static const View<Objects> kView = {
      "SceneObjects",
      "Meaning of the ids in an image's layers. They follow from the file alone: all views, "
      "variants and times of a scene have the same ids.",
      {{"camera", viewpoint_view().shape(),
        [](const Objects& o) { return viewpoint_view().print(o.camera); }},
       {"has_ids", shape::flag("Whether the job recorded ids, so that `visible` is known."),
        Member<&Objects::has_ids>::json},
       {"objects", shape::list(object_view().shape(), "All objects of the file."),
        [](const Objects& o) { return print_list(object_view(), o.objects); }},
       {"instances", shape::list(instance_view().shape(), "Instances that are visible."),
        [](const Objects& o) { return print_list(instance_view(), o.instances); }},
       {"materials", shape::list(label_view().shape()),
        [](const Objects& o) { return print_list(label_view(), o.materials); }},
       {"primitives", shape::list(label_view().shape()),
        [](const Objects& o) { return print_list(label_view(), o.primitives); }}}};
  return kView;
}

}  // namespace

std::string objects_json(const ObjectsView& objects) { return dump(objects_view().print(objects)); }

void add_object_schemas(Json& components) {
  object_view().add_to(components);
  instance_view().add_to(components);
  label_view().add_to(components);
  objects_view().add_to(components);
}

}  // namespace api
