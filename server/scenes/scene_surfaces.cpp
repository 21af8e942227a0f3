// Scenes that are seen once: first surfaces, from trees of meshes that are kept.

#include <utility>

#include "core/base/sha256.h"
#include "core/camera/camera.h"
#include "core/scene/drawn.h"
#include "server/scenes/scene_service.h"

namespace server {
namespace {

std::string content_key(const core::PrimitiveDescription& mesh) {
  core::Sha256 hash;
  hash.add(mesh.positions.data(), mesh.positions.size() * sizeof(core::Vec3));
  hash.add(mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
  // Vertices and indices together say where the former end.
  return hash.hex() + " " + std::to_string(mesh.indices.size());
}

}  // namespace

core::Result<SceneService::VisibleSurfaces> SceneService::first_surfaces(
    const core::SplitGltf& gltf, const core::CameraSettings& camera, const core::FilmSettings& film,
    const SceneOrigin& origin) {
  const auto turn = uploads_.take(origin.access.tenant, origin.stop, std::nullopt);
  if (!turn) {
    return turn.error();
  }
  constexpr std::uint64_t kPixelBytes = sizeof(core::FirstSurface) + sizeof(float);
  auto lease = memory_.take({.bytes = static_cast<std::uint64_t>(film.width) *
                                      static_cast<std::uint64_t>(film.height) * kPixelBytes,
                             .tenant = origin.access.tenant},
                            "the scene");
  if (!lease) {
    return lease.error();
  }
  core::GltfOptions options;
  options.geometry_only = true;
  options.limits.admit = [&lease](std::uint64_t bytes) { return lease->grow(bytes); };
  const Document document = {.bytes = std::make_shared<const core::Bytes>(gltf.document),
                             .files = gltf.files};
  const auto scene = describe(document, std::move(options), origin.stop);
  if (!scene) {
    return scene.error();
  }
  const auto made = core::Camera::create(camera, scene->cameras, core::bounds_of(*scene),
                                         film.width, film.height);
  if (!made) {
    return made.error();
  }
  using Made = SingleFlightCache<core::MeshTree>::Made;
  const auto find = [&](const core::PrimitiveDescription& mesh) {
    const std::string key = content_key(mesh);
    const auto make = [&]() -> core::Result<Made> {
      auto tree = core::MeshTree::build(mesh, options_.threads, options_.isa, origin.stop);
      if (!tree) {
        return tree.error();
      }
      const std::uint64_t bytes = (*tree)->bytes();
      auto held = memory_.note({.shared = {{"tree " + key, bytes}}}, MemoryGate::Kind::kIdle);
      return Made{.value = with_lease(*std::move(tree), std::move(held)), .bytes = bytes};
    };
    return trees_.get(key, make, origin.stop);
  };
  auto surfaces = core::first_surfaces(*scene, *made, film.width, film.height, find, origin.stop);
  if (!surfaces) {
    return surfaces.error();
  }
  VisibleSurfaces seen{.surfaces = *std::move(surfaces), .base_colors = {}};
  for (const core::MaterialDescription& material : scene->materials) {
    seen.base_colors.push_back(material.base_color);
  }
  return seen;
}

}  // namespace server
