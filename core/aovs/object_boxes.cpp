#include "core/aovs/object_boxes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/scene/scene_data.h"

namespace core {
namespace {

/// Triangles that extend behind the camera are clipped this close to its plane, relative to the
/// depth of the vertex in front. The clipped part is outside any film narrower than 2 / kNear focal
/// lengths.
constexpr float kNear = 1e-5F;

class Projector {
 public:
  Projector(const Camera& camera, int width, int height)
      : camera_(camera), size_px_{static_cast<float>(width), static_cast<float>(height)} {
    eye_ = camera.eye();
  }

  void add(ObjectBox& box, const std::array<Vec3, 3>& corners) const {
    for (const Vec3& p : corners) {
      box.bounds.add(p);
    }
    const PixelBox here = camera_.type() == CameraType::kPanorama ? all_around(corners)
                          : camera_.is_distorted()                ? bent(corners)
                                                                  : ahead(corners);
    if (here.min.x < size_px_.x && here.min.y < size_px_.y && here.max.x > 0 && here.max.y > 0) {
      PixelBox& all = box.in_view ? *box.in_view : box.in_view.emplace(here);
      all.min = {std::max(std::min(all.min.x, here.min.x), 0.0F),
                 std::max(std::min(all.min.y, here.min.y), 0.0F)};
      all.max = {std::min(std::max(all.max.x, here.max.x), size_px_.x),
                 std::min(std::max(all.max.y, here.max.y), size_px_.y)};
    }
  }

 private:
  static constexpr float kInf = Bounds::kInf;
  static constexpr PixelBox kEmpty = {{kInf, kInf}, {-kInf, -kInf}};

  PixelBox ahead(const std::array<Vec3, 3>& corners) const {
    std::array<float, 3> depth{};
    for (std::size_t k = 0; k < 3; ++k) {
      depth[k] = dot(corners[k] - eye_, camera_.forward());
    }
    PixelBox here = kEmpty;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (depth[k] > 0) {
        add(here, corners[k]);
      }
      if ((depth[k] > 0) != (depth[next] > 0)) {
        const std::size_t front = depth[k] > 0 ? k : next;
        const std::size_t back = depth[k] > 0 ? next : k;
        const float way = (1 - kNear) * depth[front] / (depth[front] - depth[back]);
        add(here, corners[front] + (corners[back] - corners[front]) * way);
      }
    }
    return here;
  }

  /// Returns the box in an image that bends lines: of points of the triangle whose neighbours are
  /// less than kStepRad apart as seen from the camera, or kStepsMost of a triangle that is near.
  PixelBox bent(const std::array<Vec3, 3>& corners) const {
    constexpr float kStepRad = 1.0F / 32;
    constexpr float kStepsMost = 64;
    const float nearest =
        std::min({length(corners[0] - eye_), length(corners[1] - eye_), length(corners[2] - eye_)});
    const float longest =
        std::max({length(corners[1] - corners[0]), length(corners[2] - corners[1]),
                  length(corners[0] - corners[2])});
    const float needed = longest / (kStepRad * std::max(nearest - longest, 0.0F));
    const int steps =
        needed < kStepsMost ? 1 + static_cast<int>(needed) : static_cast<int>(kStepsMost);
    PixelBox here = kEmpty;
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const float u = static_cast<float>(i) / static_cast<float>(steps);
        const float v = static_cast<float>(j) / static_cast<float>(steps);
        add(here, corners[0] * (1 - u - v) + corners[1] * u + corners[2] * v);
      }
    }
    return here;
  }

  /// Returns the box on a panorama. Straight edges are great circles, whose highest and lowest
  /// points may lie between their ends. A triangle that crosses the half-plane behind the camera
  /// reaches both sides of the film; one that contains a pole reaches all of one side.
  PixelBox all_around(const std::array<Vec3, 3>& corners) const {
    std::array<Vec3, 3> seen;  // right, up and forward of the camera
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 d = corners[k] - eye_;
      seen[k] = {dot(d, camera_.right()), dot(d, camera_.up()), dot(d, camera_.forward())};
    }
    PixelBox here = kEmpty;
    int turns = 0;  // around the vertical axis
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = seen[k];
      const Vec3 b = seen[(k + 1) % 3];
      add(here, on_panorama(a));
      const Vec3 axis = cross(a, b);
      const Vec3 highest = {-axis.x * axis.y, square(axis.x) + square(axis.z), -axis.y * axis.z};
      for (const Vec3 p : {highest, -highest}) {
        if (dot(cross(a, p), axis) > 0 && dot(cross(p, b), axis) > 0) {
          add(here, on_panorama(p));
        }
      }
      if ((a.x < 0) != (b.x < 0)) {
        const Vec3 middle = a + (b - a) * (a.x / (a.x - b.x));
        if (middle.z < 0) {
          const float y = on_panorama(middle).y;
          add(here, Vec2{0, y});
          add(here, Vec2{size_px_.x, y});
        }
      }
      turns += axis.y > 0 ? 1 : -1;
    }
    if (std::abs(turns) == 3) {
      const Vec3 normal = cross(seen[1] - seen[0], seen[2] - seen[0]);
      const float y = dot(normal, seen[0]) * normal.y > 0 ? 0 : size_px_.y;
      add(here, Vec2{0, y});
      add(here, Vec2{size_px_.x, y});
    }
    return here;
  }

  Vec2 on_panorama(Vec3 p) const {
    constexpr float kPi = std::numbers::pi_v<float>;
    return {size_px_.x * (0.5F + 0.5F * std::atan2(p.x, p.z) / kPi),
            size_px_.y * (0.5F - std::atan2(p.y, std::hypot(p.x, p.z)) / kPi)};
  }

  static void add(PixelBox& box, Vec2 at) {
    box.min = {std::min(box.min.x, at.x), std::min(box.min.y, at.y)};
    box.max = {std::max(box.max.x, at.x), std::max(box.max.y, at.y)};
  }
  void add(PixelBox& box, Vec3 p) const {
    if (const auto at = camera_.project(p, {0.5F, 0.5F})) {
      add(box, *at);
    }
  }

  const Camera& camera_;
  Vec2 size_px_;
  Vec3 eye_;
};

void add(ObjectBox& to, const ObjectBox& more) {
  to.bounds.add(more.bounds);
  if (more.in_view && to.in_view) {
    to.in_view->min = {std::min(to.in_view->min.x, more.in_view->min.x),
                       std::min(to.in_view->min.y, more.in_view->min.y)};
    to.in_view->max = {std::max(to.in_view->max.x, more.in_view->max.x),
                       std::max(to.in_view->max.y, more.in_view->max.y)};
  } else if (more.in_view) {
    to.in_view = more.in_view;
  }
}

}  // namespace

ObjectBoxes object_boxes(const Scene& scene, const Camera& camera, int width, int height,
                         const std::set<std::uint32_t>& instances) {
  const SceneData& data = scene.data();
  const Projector projector(camera, width, height);
  ObjectBoxes out;
  const auto visit = [&](std::size_t begin, std::size_t end, const Transform* to_world) {
    for (std::size_t i = begin; i < end; ++i) {
      const PlacedMesh& placed = data.placed[i];
      const MeshData& mesh = data.meshes[placed.mesh];
      ObjectBox box;
      for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
        std::array<Vec3, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 p = mesh.positions[mesh.indices[3 * t + k]];
          corners[k] = to_world == nullptr ? p : to_world->point(p);
        }
        projector.add(box, corners);
      }
      add(out.objects[placed.object], box);
      if (instances.contains(placed.instance)) {
        add(out.instances[placed.instance], box);
      }
    }
  };
  visit(0, data.instances.empty() ? data.placed.size() : data.instances.front().first_placed,
        nullptr);
  for (std::size_t i = 0; i < data.instances.size(); ++i) {
    const std::size_t end =
        i + 1 < data.instances.size() ? data.instances[i + 1].first_placed : data.placed.size();
    visit(data.instances[i].first_placed, end, &data.instances[i].to_world);
  }
  return out;
}

}  // namespace core
