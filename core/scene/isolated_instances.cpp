#include "core/scene/isolated_instances.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "core/math/bounds.h"
#include "core/math/stretch.h"
#include "core/scene/placed_meshes.h"

namespace core {
namespace {

float longest_edge(const MeshData& mesh) {
  float out = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
    out =
        std::max(out, length(mesh.positions[mesh.indices[i]] - mesh.positions[mesh.indices[next]]));
  }
  return out;
}

/// The axis along which the boxes are spread most.
int widest_axis(const std::vector<Bounds>& boxes) {
  Bounds centers;
  for (const Bounds& box : boxes) {
    centers.add(box.center());
  }
  const Vec3 d = centers.diagonal();
  return d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
}

/// Returns for each box whether it meets another one, by sweeping: those that begin later along the
/// axis, then those that began before and have not ended.
std::vector<bool> find_meeting(const std::vector<Bounds>& boxes, const std::stop_token& stop) {
  const int axis = widest_axis(boxes);
  std::vector<std::size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return boxes[a].min[axis] < boxes[b].min[axis]; });
  std::vector<bool> out(boxes.size(), false);
  std::vector<std::size_t> open;  // and some that have ended
  std::size_t full = 64;
  for (std::size_t k = 0; k < order.size() && !stop.stop_requested(); ++k) {
    const Bounds& box = boxes[order[k]];
    const auto meets = [&](std::size_t other) { return meet(box, boxes[other]); };
    if (open.size() >= full) {
      std::erase_if(open,
                    [&](std::size_t other) { return boxes[other].max[axis] < box.min[axis]; });
      full = std::max(full, 2 * open.size());
    }
    bool found = std::any_of(open.begin(), open.end(), meets);
    for (std::size_t l = k + 1;
         !found && l < order.size() && boxes[order[l]].min[axis] <= box.max[axis]; ++l) {
      found = meets(order[l]);
    }
    out[order[k]] = found;
    open.push_back(order[k]);
  }
  return out;
}

}  // namespace

std::span<const PlacedMesh> placed_of(const SceneData& scene, std::size_t instance) noexcept {
  const std::size_t first = scene.instances[instance].first_placed;
  const std::size_t end = instance + 1 < scene.instances.size()
                              ? scene.instances[instance + 1].first_placed
                              : scene.placed.size();
  return std::span(scene.placed).subspan(first, end - first);
}

std::vector<bool> find_isolated_instances(const SceneData& scene, float edges,
                                          const std::stop_token& stop) {
  if (scene.instances.empty()) {
    return {};
  }
  std::vector<float> longest(scene.meshes.size());
  std::vector<Bounds> bounds(scene.meshes.size());
  for (std::size_t m = 0; m < scene.meshes.size() && !stop.stop_requested(); ++m) {
    longest[m] = longest_edge(scene.meshes[m]);
    bounds[m] = bounds_of(scene.meshes[m]);
  }
  std::vector<Bounds> boxes(scene.instances.size());
  for (std::size_t i = 0; i < scene.instances.size() && !stop.stop_requested(); ++i) {
    const Transform& to_world = scene.instances[i].to_world;
    float edge = 0;
    for (const PlacedMesh& placed : placed_of(scene, i)) {
      boxes[i].add(image_of(bounds[placed.mesh], to_world));
      edge = std::max(edge, longest[placed.mesh]);
    }
    const float margin = edges * edge * stretch_bound(to_world);
    boxes[i].min = boxes[i].min - Vec3{margin, margin, margin};
    boxes[i].max = boxes[i].max + Vec3{margin, margin, margin};
  }
  for (std::size_t p = 0; p < scene.instances[0].first_placed; ++p) {
    boxes.push_back(bounds[scene.placed[p].mesh]);
  }
  std::vector<bool> out = find_meeting(boxes, stop);
  out.resize(scene.instances.size());
  out.flip();
  return out;
}

}  // namespace core
