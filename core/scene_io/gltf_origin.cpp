#include "core/scene_io/gltf_origin.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace core {
namespace {

constexpr double kFloatStep = 0x1p-23;  ///< of a float, relative, at most
/// Steps along the radius of a mesh below which its shape is reported as inexact.
constexpr double kFewSteps = 256;
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

Place far_origin(const PlaceBox& box, double radii) noexcept {
  const double radius = box.radius();
  if (!(radius > 0) || !(box.reach({}) > radii * radius)) {
    return {};
  }
  const double step = std::exp2(std::floor(std::log2(radius)));
  const auto near = [step](double low, double high) {
    return std::round(0.5 * (low + high) / step) * step;
  };
  return {near(box.min.x, box.max.x), near(box.min.y, box.max.y), near(box.min.z, box.max.z)};
}

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
  const double radius = all.radius();
  if (radius > kLargestRadius || (radius > 0 && radius < kSmallestRadius)) {
    warnings.emplace_back(
        "size", "",
        "The scene has a radius of " + text_of(radius) + " m; outside of " +
            text_of(kSmallestRadius) + " to " + text_of(kLargestRadius) +
            " m light may be lost, because 32-bit floats cannot hold its areas: scale the scene.");
  }
  // Returns the first instance of which floats, counted from there, cannot hold the shape, and
  // their steps.
  const auto first_inexact = [&](Place origin) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const double stored = mesh_of(i).reach({}) * boxes[i].radius() / mesh_of(i).radius();
      const double step = kFloatStep * std::max(boxes[i].reach(origin), stored);
      if (boxes[i].radius() > 0 && boxes[i].radius() < kFewSteps * step) {
        return std::pair(i, step);
      }
    }
    return std::pair(boxes.size(), 0.0);
  };
  const bool is_exact = first_inexact({}).first == boxes.size();
  const Place origin = far_origin(all, is_exact ? kFarRadii : 1);
  if (const auto [i, step] = first_inexact(origin); i < boxes.size()) {
    warnings.emplace_back("size", "/nodes/" + std::to_string(scene.instances[i].object - 1),
                          "the mesh is " + text_of(2 * boxes[i].radius()) +
                              " m large, but so far from its origin or the rest of the scene "
                              "32-bit floats place its vertices in steps of " +
                              text_of(step) + " m.");
  }
  return origin;
}

}  // namespace core
