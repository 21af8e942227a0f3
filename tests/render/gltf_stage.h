/// Renders one glTF feature: a scene made in code is written to a GLB file, loaded by the real
/// loader, and rendered at a small size.
///
/// The patch lies in the plane z = 0 and fills [-1, 1] x [-1, 1], facing +z, u to the right, v
/// downwards; an orthographic camera looks along -z and sees exactly the patch.
#pragma once

#include <memory>
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
/// A sun in the direction wi (unit) with irradiance `lux` on a plane perpendicular to it.
core::PunctualLightDescription sun(core::Vec3 wi, core::Rgb lux);
/// Unit vector at polar angle theta from +z, azimuth phi; degrees.
core::Vec3 towards(double theta, double phi = 0);

/// Adds an 8-bit image, row 0 at the top; returns its index in scene.images.
int add_image(core::SceneDescription& scene, int width, int height, int channels,
              const std::vector<int>& values);

/// Loads a file; stops the test program if it is refused.
core::SceneDescription load(const core::Bytes& glb, const core::GltfOptions& options = {});

struct Shot {
  int width = 8;
  int height = 8;
  int samples = 16;
  int depth = 1;  ///< maximum number of scattering events
  std::shared_ptr<const core::Environment> sky = nullptr;
  bool depth_layer = false;
  bool spectral = false;
};
/// Renders a description without writing it.
Picture shoot(core::SceneDescription scene, const Shot& shot);
/// Writes the scene as a GLB, loads and renders it.
Picture shoot_glb(const core::SceneDescription& scene, const Shot& shot);

core::Rgb pixel(const Picture& picture, int x, int y);
/// Mean depth of the pixel's hits, metres.
float depth_at(const Picture& picture, int x, int y);

double srgb_to_linear(double byte);

}  // namespace test_support
