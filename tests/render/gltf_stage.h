/// A stage for one glTF feature: a scene made in code goes through a GLB file and the real loader,
/// and is rendered small.
///
/// The patch lies in the plane z = 0 and fills [-1, 1] x [-1, 1], facing +z, u to the right, v
/// downwards; the camera looks along -z, orthographic, and sees exactly the patch.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/scene_io/glb_writer.h"
#include "core/scene_io/gltf_load.h"
#include "tests/support/scenes.h"

namespace test_support {

core::PrimitiveDescription patch(float z = 0, int material = 0);
/// The patch with one material, and the camera.
core::SceneDescription stage(const core::MaterialDescription& material);
/// An orthographic camera at z = 10 that sees [-half, half] in height.
core::CameraDescription front_camera(float half_m = 1);
/// From the direction wi (unit), `lux` W/m^2 across it.
core::PunctualLightDescription sun(core::Vec3 wi, core::Rgb lux);
/// Unit vector at polar angle theta from +z, azimuth phi; degrees.
core::Vec3 towards(double theta, double phi = 0);

/// An 8-bit picture, row 0 on top; its index in scene.images.
int add_image(core::SceneDescription& scene, int width, int height, int channels,
              const std::vector<int>& values);

/// Loads a file; stops the test program when it is refused.
core::SceneDescription load(const core::Bytes& glb, const core::GltfOptions& options = {});

struct Shot {
  int width = 8;
  int height = 8;
  int samples = 16;
  int depth = 1;  ///< scattering events
  std::shared_ptr<const core::Environment> sky = nullptr;
  bool depth_layer = false;
  bool spectral = false;
};
/// Renders a description as it is.
Picture shoot(core::SceneDescription scene, const Shot& shot);
/// Writes it as a GLB, loads that and renders it.
Picture shoot_glb(const core::SceneDescription& scene, const Shot& shot);

core::Rgb pixel(const Picture& picture, int x, int y);
/// Mean depth of the pixel's hits, metres.
float depth_at(const Picture& picture, int x, int y);

double srgb_to_linear(double byte);

}  // namespace test_support
