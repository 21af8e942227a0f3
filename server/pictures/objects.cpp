#include "server/pictures/objects.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/aovs/object_boxes.h"
#include "core/camera/camera.h"
#include "core/scene/matte_names.h"
#include "core/scene/scene.h"

namespace server {
namespace {

/// Bounds of the pixels that show an object.
struct PixelBounds {
  std::uint32_t object = 0;
  int left = 0;
  int top = 0;
  int right = 0;  ///< last column
  int bottom = 0;
  std::uint64_t pixels = 0;
};

struct VisibleIds {
  std::map<std::uint32_t, PixelBounds> objects;
  std::map<std::uint32_t, PixelBounds> instances;
};

void add(std::map<std::uint32_t, PixelBounds>& to, std::uint32_t id, std::uint32_t object, int x,
         int y) {
  const auto [at, is_new] = to.try_emplace(id, PixelBounds{object, x, y, x, y, 0});
  PixelBounds& seen = at->second;
  seen.left = std::min(seen.left, x);
  seen.top = std::min(seen.top, y);
  seen.right = std::max(seen.right, x);
  seen.bottom = std::max(seen.bottom, y);
  ++seen.pixels;
}

VisibleIds seen_ids(const core::Film& film) {
  VisibleIds out;
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const core::TileState state = film.tile(tile);
    auto hit = state.first_hits.begin();
    for (int y = state.rect.y; y < state.rect.y + state.rect.height; ++y) {
      for (int x = state.rect.x; x < state.rect.x + state.rect.width; ++x, ++hit) {
        if (hit->object != 0) {
          add(out.objects, hit->object, hit->object, x, y);
          add(out.instances, hit->instance, hit->object, x, y);
        }
      }
    }
  }
  return out;
}

api::PlaceView place_of(std::uint32_t id, const std::map<std::uint32_t, core::ObjectBox>& boxes,
                        const std::map<std::uint32_t, PixelBounds>& seen, core::Place origin) {
  api::PlaceView out = {.origin = origin, .bounds = {}, .visible = {}, .amodal = {}};
  if (const auto box = boxes.find(id); box != boxes.end()) {
    out.bounds = box->second.bounds;
    if (const auto& in_view = box->second.in_view) {
      const auto x = static_cast<double>(in_view->min.x);
      const auto y = static_cast<double>(in_view->min.y);
      out.amodal = {x, y, static_cast<double>(in_view->max.x) - x,
                    static_cast<double>(in_view->max.y) - y, 0};
    }
  }
  if (const auto found = seen.find(id); found != seen.end()) {
    const PixelBounds& s = found->second;
    out.visible = {static_cast<double>(s.left), static_cast<double>(s.top),
                   static_cast<double>(s.right - s.left + 1),
                   static_cast<double>(s.bottom - s.top + 1), s.pixels};
  }
  return out;
}

api::ViewpointView viewpoint_of(const core::Camera& camera,
                                const core::DistortionSettings& distortion, int width, int height) {
  api::ViewpointView out;
  out.type = camera.type();
  out.width = width;
  out.height = height;
  const core::Intrinsics film = camera.intrinsics();
  out.scale_px = {film.fx, film.fy};
  out.center_px = {film.cx, film.cy};
  out.distortion = distortion;
  out.to_world = {camera.right(), camera.up(), -camera.forward(), camera.eye()};
  return out;
}

}  // namespace

core::Result<api::ObjectsView> ObjectsMaker::make(const core::Film& film, const core::View& view,
                                                  const api::JobSpec& spec) {
  const core::SceneSummary& summary = view.scene->summary();
  const int width = film.full_width();
  const int height = film.full_height();
  const auto camera =
      core::Camera::create(view.camera, summary.cameras, summary.bounds, width, height);
  if (!camera) {
    return camera.error();
  }
  api::ObjectsView out;
  out.camera = viewpoint_of(*camera, view.camera.distortion, width, height);
  out.camera.origin = summary.origin;
  out.has_ids = film.has_first_hits();
  const VisibleIds seen = out.has_ids ? seen_ids(film) : VisibleIds{};
  std::set<std::uint32_t> instances;
  std::string key = api::sight_key(spec);
  for (const auto& [id, where] : seen.instances) {
    instances.insert(id);
    key += " " + std::to_string(id);
  }
  using Made = SingleFlightCache<core::ObjectBoxes>::Made;
  const auto kept = boxes_.get(key, [&]() -> core::Result<Made> {
    auto made = std::make_shared<const core::ObjectBoxes>(
        core::object_boxes(*view.scene, *camera, width, height, instances));
    constexpr std::uint64_t kNodeBytes = 48;  // of a map node, besides its value
    const std::uint64_t each = sizeof(core::ObjectBox) + kNodeBytes;
    return Made{.value = made,
                .bytes = 2 * key.size() + (made->objects.size() + made->instances.size()) * each};
  });
  if (!kept) {
    return kept.error();
  }
  const core::ObjectBoxes& boxes = **kept;
  const std::vector<std::string> names = core::object_names(summary.objects);
  for (std::size_t i = 0; i < summary.objects.size(); ++i) {
    const core::ObjectDescription& object = summary.objects[i];
    out.objects.push_back(
        {.id = object.id,
         .pointer = "/nodes/" + std::to_string(object.id - 1),
         .name = names[i],
         .first_instance = object.first_instance,
         .instances = object.instances,
         .place = place_of(object.id, boxes.objects, seen.objects, summary.origin)});
  }
  for (const auto& [id, where] : seen.instances) {
    out.instances.push_back(
        {id, where.object, place_of(id, boxes.instances, seen.instances, summary.origin)});
  }
  std::vector<std::string> materials = summary.materials;
  materials.emplace_back("default");
  const std::vector<std::string> unlike = core::material_names(materials);
  for (std::uint32_t i = 0; i < unlike.size(); ++i) {
    const bool is_default = i == summary.materials.size();
    out.materials.push_back(
        {i + 1, is_default ? "" : "/materials/" + std::to_string(i), unlike[i]});
  }
  std::uint32_t id = 1;
  for (std::size_t m = 0; m < summary.mesh_primitives.size(); ++m) {
    for (std::uint32_t p = 0; p < summary.mesh_primitives[m]; ++p) {
      out.primitives.push_back(
          {id++, "/meshes/" + std::to_string(m) + "/primitives/" + std::to_string(p), ""});
    }
  }
  return out;
}

}  // namespace server
