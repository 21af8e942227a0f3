#include "core/scene/crowding.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/math/bounds.h"

namespace core {
namespace {

double box_area(const Bounds& box) {
  const Vec3 d = box.empty() ? Vec3{} : box.diagonal();
  const auto x = static_cast<double>(d.x);
  const auto y = static_cast<double>(d.y);
  const auto z = static_cast<double>(d.z);
  return 2 * (x * y + y * z + z * x);
}

/// Boxes of triangles, for each mesh in its own frame.
struct Crowd {
  Bounds box;
  double area = 0;  ///< sum over the boxes
};

Crowd crowd_of(const MeshData& mesh) {
  Crowd crowd;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    Bounds box;
    for (std::size_t k = 0; k < 3; ++k) {
      box.add(mesh.positions[mesh.indices[i + k]]);
    }
    crowd.area += box_area(box);
    crowd.box.add(box);
  }
  return crowd;
}

Bounds moved(const Bounds& box, const Transform& to_world) {
  Bounds out;
  for (int corner = 0; corner < 8 && !box.empty(); ++corner) {
    out.add(to_world.point({(corner & 1) != 0 ? box.max.x : box.min.x,
                            (corner & 2) != 0 ? box.max.y : box.min.y,
                            (corner & 4) != 0 ? box.max.z : box.min.z}));
  }
  return out;
}

}  // namespace

double boxes_met(const SceneData& scene) {
  std::vector<Crowd> crowds;
  for (const MeshData& mesh : scene.meshes) {
    crowds.push_back(crowd_of(mesh));
  }
  const std::size_t top_level =
      scene.instances.empty() ? scene.placed.size() : scene.instances.front().first_placed;
  Bounds whole;
  double area = 0;
  for (std::size_t i = 0; i < top_level; ++i) {
    const Crowd& crowd = crowds[scene.placed[i].mesh];
    whole.add(crowd.box);
    area += crowd.area;
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const std::size_t end =
        i + 1 < scene.instances.size() ? scene.instances[i + 1].first_placed : scene.placed.size();
    Crowd inside;
    for (std::size_t k = scene.instances[i].first_placed; k < end; ++k) {
      const Crowd& crowd = crowds[scene.placed[k].mesh];
      inside.box.add(crowd.box);
      inside.area += crowd.area;
    }
    const Bounds box = moved(inside.box, scene.instances[i].to_world);
    const double own = box_area(inside.box);
    whole.add(box);
    area += box_area(box) * (own > 0 ? inside.area / own : 1);
  }
  const double all = box_area(whole);
  return all > 0 ? area / all : 0;
}

std::string crowding_warning(double boxes_met) {
  return "Much of the geometry is in the same place: a ray through the scene passes the boxes of " +
         std::to_string(std::llround(boxes_met)) +
         " triangles on average, so rendering takes long. Remove duplicates of objects and faces.";
}

}  // namespace core
