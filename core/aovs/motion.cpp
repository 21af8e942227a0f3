#include "core/aovs/motion.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace core {
namespace {

std::uint64_t key_of(std::uint32_t instance, std::uint32_t primitive) {
  return std::uint64_t{instance} << 32U | primitive;
}

/// Returns where a vertex of the mesh is, given those of the file; empty if the file has it not.
std::optional<Vec3> position_of(const MeshData& mesh, std::uint32_t vertex,
                                const std::vector<Vec3>& in_file) {
  const std::size_t given = mesh.positions.size() - 1 - mesh.added.size();
  const AddedVertex at = vertex < given ? AddedVertex{{vertex, vertex, vertex}, {1, 0, 0}}
                                        : mesh.added[vertex - given];
  std::array<double, 3> sum = {};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t v =
        mesh.file_vertices.empty() ? at.vertices[k] : mesh.file_vertices[at.vertices[k]];
    if (v >= in_file.size()) {
      return std::nullopt;
    }
    const auto weight = static_cast<double>(at.weights[k]);
    sum[0] += weight * static_cast<double>(in_file[v].x);
    sum[1] += weight * static_cast<double>(in_file[v].y);
    sum[2] += weight * static_cast<double>(in_file[v].z);
  }
  return Vec3{static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

}  // namespace

MotionTarget::MotionTarget(SceneDescription later) : cameras_(std::move(later.cameras)) {
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> primitives;  // id, mesh here
  for (MeshDescription& mesh : later.meshes) {
    auto& here = primitives.emplace_back();
    for (PrimitiveDescription& p : mesh.primitives) {
      here.emplace_back(p.id, static_cast<std::uint32_t>(meshes_.size()));
      meshes_.push_back(std::move(p.positions));
    }
  }
  for (const InstanceDescription& instance : later.instances) {
    for (const auto& [id, mesh] : primitives[static_cast<std::size_t>(instance.mesh)]) {
      placed_[key_of(instance.instance, id)] = {mesh, static_cast<std::uint32_t>(to_world_.size())};
    }
    to_world_.push_back(instance.to_world);
  }
}

std::size_t MotionTarget::bytes() const noexcept {
  std::size_t bytes =
      to_world_.size() * sizeof(Transform) +
      placed_.size() * (sizeof(std::pair<const std::uint64_t, Placed>) + 2 * sizeof(void*));
  for (const auto& positions : meshes_) {
    bytes += positions.capacity() * sizeof(Vec3);
  }
  return bytes;
}

std::optional<Vec3> MotionTarget::position(const SceneData& now, const SurfacePoint& point,
                                           const SceneData::CornerWeights& at) const noexcept {
  if (now.ground == point.placed) {
    return point.position;  // not from the file, so it does not move
  }
  const PlacedMesh& placed = now.placed[point.placed];
  const MeshData& mesh = now.meshes[placed.mesh];
  const auto found = placed_.find(key_of(placed.instance, mesh.primitive));
  if (found == placed_.end()) {
    return std::nullopt;
  }
  const std::vector<Vec3>& positions = meshes_[found->second.mesh];
  const Transform& to_world = to_world_[found->second.instance];
  std::array<Vec3, 3> p;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto corner = position_of(mesh, at.vertices[k], positions);
    if (!corner) {
      return std::nullopt;
    }
    p[k] = to_world.point(*corner);
  }
  return p[0] * at.weights.x + p[1] * at.weights.y + p[2] * at.weights.z;
}

Vec2 Motion::of(const SceneData& scene, const SurfacePoint& point,
                const SceneData::CornerWeights& at) const noexcept {
  constexpr Vec2 kMiddle = {0.5F, 0.5F};
  const auto there = target->position(scene, point, at);
  const auto from = now.project(point.position, kMiddle);
  const auto to = there ? later.project(*there, kMiddle) : std::nullopt;
  if (!from || !to) {
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    return {kUnknown, kUnknown};
  }
  const float right = to->x - from->x;
  return {now.type() == CameraType::kPanorama ? std::remainder(right, width_px) : right,
          from->y - to->y};
}

}  // namespace core
