#include "core/scene_io/gltf_origin.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/math/offset_ray.h"

namespace core {
namespace {

/// Coordinates of up to this many radii keep 19 of the 24 bits of a float for the scene itself.
constexpr double kFarRadii = 32;
constexpr double kFloatStep = 0x1p-23;  ///< of a float, relative, at most
/// Steps along the radius of a mesh below which its shape is reported as inexact.
constexpr double kFewSteps = 256;
/// Steps of rays off a triangle along the radius of a mesh on it, below which its contact and its
/// shadow are reported as inexact. A cube of 2 cm, of which a step is .11, .05 or .016, differs by
/// 2 to 50% in blocks of 8x8 pixels from one on small triangles; one with .001 by .3%.
constexpr double kFewRaySteps = 32;
/// A ground is so much wider than it is high: things stand on it, and not within it as in a dome.
constexpr double kFlat = 100;
/// Radii between which areas, densities and their squares stay within the range of floats.
constexpr double kSmallestRadius = 1e-7;
constexpr double kLargestRadius = 1e8;

/// The box of a mesh in its own space.
PlaceBox box_of(const MeshDescription& mesh) {
  Bounds bounds;
  for (const PrimitiveDescription& p : mesh.primitives) {
    for (const Vec3 v : p.positions) {
      bounds.add(v);
    }
  }
  PlaceBox out;
  if (!bounds.empty()) {
    out.add(bounds.min);
    out.add(bounds.max);
  }
  return out;
}

PlaceBox placed(const Affine& to_world, const PlaceBox& box) {
  PlaceBox out;
  for (unsigned corner = 0; !box.empty() && corner < 8; ++corner) {
    const Place at = {(corner & 1U) != 0 ? box.max.x : box.min.x,
                      (corner & 2U) != 0 ? box.max.y : box.min.y,
                      (corner & 4U) != 0 ? box.max.z : box.min.z};
    const auto image = [&](std::size_t r) {
      return to_world.column[0][r] * at.x + to_world.column[1][r] * at.y +
             to_world.column[2][r] * at.z + to_world.column[3][r];
    };
    out.add({image(0), image(1), image(2)});
  }
  return out;
}

/// Returns the largest sum of the taxicab lengths of a triangle's first edges, of which the step of
/// rays off it is a multiple (plane_error_m()).
double edges_of(const MeshDescription& mesh) {
  double most = 0;
  for (const PrimitiveDescription& p : mesh.primitives) {
    for (std::size_t i = 0; i + 2 < p.indices.size(); i += 3) {
      const Vec3 at = p.positions[p.indices[i]];
      most = std::max(most, static_cast<double>(taxicab(p.positions[p.indices[i + 1]] - at)) +
                                static_cast<double>(taxicab(p.positions[p.indices[i + 2]] - at)));
    }
  }
  return most;
}

bool is_flat(const PlaceBox& box) {
  const Place size = box.max - box.min;
  return std::min({size.x, size.y, size.z}) * kFlat <= std::max({size.x, size.y, size.z});
}

bool touches(const PlaceBox& a, const PlaceBox& b, double room) {
  return a.min.x <= b.max.x + room && b.min.x <= a.max.x + room && a.min.y <= b.max.y + room &&
         b.min.y <= a.max.y + room && a.min.z <= b.max.z + room && b.min.z <= a.max.z + room;
}

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

void PlaceBox::add(Place p) noexcept {
  min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
  max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
}

double PlaceBox::radius() const noexcept {
  return empty() ? 0 : 0.5 * std::hypot(max.x - min.x, max.y - min.y, max.z - min.z);
}

double PlaceBox::reach(Place from) const noexcept {
  const Place low = min - from;
  const Place high = max - from;
  return empty() ? 0
                 : std::max({std::fabs(low.x), std::fabs(low.y), std::fabs(low.z),
                             std::fabs(high.x), std::fabs(high.y), std::fabs(high.z)});
}

Place far_origin(const PlaceBox& box) noexcept {
  const double radius = box.radius();
  if (!(radius > 0) || !(box.reach({}) > kFarRadii * radius)) {
    return {};
  }
  const double step = std::exp2(std::floor(std::log2(radius)));
  const auto near = [step](double low, double high) {
    return std::round(0.5 * (low + high) / step) * step;
  };
  return {near(box.min.x, box.max.x), near(box.min.y, box.max.y), near(box.min.z, box.max.z)};
}

namespace {

/// Warns of the first mesh that is too small for the triangles of a flat one that it stands on.
/// boxes: of the instances, in the world; own: of the meshes, in their space.
void warn_of_large_triangles(const SceneDescription& scene, const std::vector<PlaceBox>& boxes,
                             const std::vector<PlaceBox>& own, std::vector<Warning>& warnings) {
  std::vector<double> edges;
  for (const MeshDescription& mesh : scene.meshes) {
    edges.push_back(edges_of(mesh));
  }
  std::size_t ground = boxes.size();
  double most = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const auto mesh = static_cast<std::size_t>(scene.instances[i].mesh);
    const double edge_m =
        own[mesh].radius() > 0 ? edges[mesh] * boxes[i].radius() / own[mesh].radius() : 0;
    if (edge_m > most && is_flat(boxes[i])) {
      most = edge_m;
      ground = i;
    }
  }
  const double step_m = static_cast<double>(kPlaneError) * most;
  for (std::size_t i = 0; i < boxes.size() && ground < boxes.size(); ++i) {
    const double radius_m = boxes[i].radius();
    if (i != ground && radius_m > 0 && radius_m < kFewRaySteps * step_m &&
        touches(boxes[i], boxes[ground], radius_m)) {
      warnings.emplace_back("size", "/nodes/" + std::to_string(scene.instances[i].object - 1),
                            "the mesh is " + text_of(2 * radius_m) +
                                " m large and stands on a triangle of " + text_of(most / 2) +
                                " m, which rays leave by " + text_of(step_m) +
                                " m because of 32-bit floats: contact and shadow are inexact. "
                                "Divide the large triangle, or make it smaller.");
      return;
    }
  }
}

}  // namespace

Place find_origin(const SceneDescription& scene, std::span<const Affine> to_world,
                  std::vector<Warning>& warnings) {
  std::vector<PlaceBox> own;
  for (const MeshDescription& mesh : scene.meshes) {
    own.push_back(box_of(mesh));
  }
  const auto mesh_of = [&](std::size_t i) -> const PlaceBox& {
    return own[static_cast<std::size_t>(scene.instances[i].mesh)];
  };
  PlaceBox all;
  std::vector<PlaceBox> boxes;
  for (std::size_t i = 0; i < to_world.size(); ++i) {
    boxes.push_back(placed(to_world[i], mesh_of(i)));
    if (const PlaceBox& box = boxes.back(); !box.empty()) {
      all.add(box.min);
      all.add(box.max);
    }
  }
  const Place origin = far_origin(all);
  const double radius = all.radius();
  if (radius > kLargestRadius || (radius > 0 && radius < kSmallestRadius)) {
    warnings.emplace_back(
        "size", "",
        "The scene has a radius of " + text_of(radius) + " m; outside of " +
            text_of(kSmallestRadius) + " to " + text_of(kLargestRadius) +
            " m light may be lost, because 32-bit floats cannot hold its areas: scale the scene.");
  }
  for (std::size_t i = 0; i < to_world.size(); ++i) {
    const PlaceBox& box = boxes[i];
    if (!(box.radius() > 0)) {
      continue;
    }
    const double stored = mesh_of(i).reach({}) * box.radius() / mesh_of(i).radius();
    const double step = kFloatStep * std::max(box.reach(origin), stored);
    if (box.radius() < kFewSteps * step) {
      warnings.emplace_back("size", "/nodes/" + std::to_string(scene.instances[i].object - 1),
                            "the mesh is " + text_of(2 * box.radius()) +
                                " m large, but so far from its origin or the rest of the scene "
                                "32-bit floats place its vertices in steps of " +
                                text_of(step) + " m.");
      break;  // for all
    }
  }
  warn_of_large_triangles(scene, boxes, own, warnings);
  return origin;
}

}  // namespace core
