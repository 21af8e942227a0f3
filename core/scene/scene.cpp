#include "core/scene/scene.h"

#include <utility>

#include "core/lights/environment.h"
#include "core/scene/crowding.h"
#include "core/scene/scene_builder.h"
#include "core/scene/scene_data.h"

namespace core {
namespace {

std::size_t memory_of(const SceneData& data) {
  std::size_t bytes = data.accel->bytes() + data.light_tree.bytes() +
                      data.triangle_lights.size() * sizeof(TriangleLight) +
                      data.placed.size() * sizeof(PlacedMesh) +
                      data.instances.size() * sizeof(PlacedInstance);
  for (const MeshData& mesh : data.meshes) {
    bytes += mesh.bytes();
  }
  for (const NearPlanes& near : data.near_planes) {
    bytes +=
        near.first.size() * sizeof(near.first[0]) + near.planes.size() * sizeof(near.planes[0]);
  }
  for (const auto& texture : data.textures) {
    bytes += texture->bytes();
  }
  for (const auto& profile : data.profiles) {
    bytes += profile != nullptr ? profile->bytes() : 0;
  }
  return bytes;
}

/// Returns the memory per texel that Environment uses for colours and their distribution.
std::size_t environment_bytes(const Image* map) {
  return map == nullptr ? 0 : map->value_count() / 3 * (sizeof(Rgb) + 2 * sizeof(float));
}

}  // namespace

std::size_t MeshData::bytes() const noexcept {
  std::size_t moved = 0;
  for (const MovedVertices& vertices : later) {
    moved += (vertices.positions.capacity() + vertices.normals.capacity()) * sizeof(Vec3);
  }
  return moved + positions.capacity() * sizeof(Vec3) + indices.capacity() * sizeof(std::uint32_t) +
         normals.capacity() * sizeof(Vec3) + tangents.capacity() * sizeof(Vec4) +
         (uv[0].capacity() + uv[1].capacity()) * sizeof(Vec2) + colors.capacity() * sizeof(Vec4) +
         file_vertices.capacity() * sizeof(std::uint32_t) + added.capacity() * sizeof(AddedVertex) +
         round_sides.capacity();
}

Scene::Scene() : data_(std::make_unique<SceneData>()) {}
Scene::~Scene() = default;

Result<std::shared_ptr<const Scene>> Scene::build(SceneDescription description, int threads,
                                                  std::string_view isa,
                                                  const std::stop_token& stop) {
  std::shared_ptr<Scene> scene(new Scene());
  SceneSummary& summary = scene->summary_;
  summary.name = description.name;
  for (const MaterialDescription& m : description.materials) {
    summary.materials.push_back(m.name);
  }
  const auto placed = build_scene_data(description, *scene->data_, threads, isa, stop);
  if (!placed) {
    return placed.error();
  }
  summary.objects = std::move(description.objects);
  summary.mesh_primitives = std::move(description.mesh_primitives);
  if (description.environment != nullptr) {
    auto environment = Environment::create(description.environment.get(), {});
    if (!environment) {
      return Error{environment.error().code, environment.error().message, "/environment"};
    }
    scene->environment_ = *std::move(environment);
    summary.has_environment = true;
  }
  summary.origin = description.origin;
  summary.bounds = placed->bounds;
  summary.extremes = placed->extremes;
  summary.triangles = placed->triangles;
  summary.instances = description.instances.size();
  summary.bytes = memory_of(*scene->data_) + environment_bytes(description.environment.get());
  summary.emissive_triangles = scene->data_->triangle_lights.size();
  summary.cameras = std::move(description.cameras);
  summary.lights = std::move(description.lights);
  summary.light_groups = scene->data_->light_groups;
  summary.variants = std::move(description.variants);
  summary.animations = std::move(description.animations);
  summary.extensions = std::move(description.extensions);
  summary.warnings = std::move(description.warnings);
  if (summary.extremes.empty()) {
    summary.warnings.emplace_back("empty", "", "The scene has no triangle that is drawn.");
  }
  if (const double met = boxes_met(*scene->data_); met > kBoxesMetMost) {
    summary.warnings.emplace_back("crowded", "", crowding_warning(met));
  }
  summary.has_emissive_strength = description.has_emissive_strength;
  summary.has_scattering = scene->data_->has_scattering;
  for (const Material& m : scene->data_->materials) {
    summary.has_dispersion = summary.has_dispersion || m.factors.dispersion > 0;
    scene->data_->has_alpha = scene->data_->has_alpha || m.has_alpha;
  }
  return std::shared_ptr<const Scene>(scene);
}

}  // namespace core
