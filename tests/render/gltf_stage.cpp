#include "tests/render/gltf_stage.h"

#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/math/frame.h"

namespace test_support {

using core::Rgb;
using core::Vec3;

core::PrimitiveDescription patch(float z, int material) {
  core::PrimitiveDescription p;
  p.material = material;
  p.positions = {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
  p.normals.assign(4, {0, 0, 1});
  p.uv[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  p.indices = {0, 1, 2, 0, 2, 3};
  return p;
}

core::SceneDescription stage(const core::MaterialDescription& material) {
  core::SceneDescription scene = scene_of({material}, {patch()});
  scene.cameras.push_back(front_camera());
  return scene;
}

core::CameraDescription front_camera(float half_m) {
  core::CameraDescription camera;
  camera.name = "front";
  camera.orthographic = true;
  camera.x_magnification = half_m;
  camera.y_magnification = half_m;
  camera.to_world.t = {0, 0, 10};
  return camera;
}

core::PunctualLightDescription sun(Vec3 wi, Rgb lux) {
  const core::Frame frame = core::frame_from_normal(wi);
  core::PunctualLightDescription light = directional({frame.s, frame.t, frame.n, {0, 0, 0}}, lux);
  light.name = "sun";
  return light;
}

Vec3 towards(double theta, double phi) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const double s = std::sin(theta * kDegree);
  return {static_cast<float>(s * std::cos(phi * kDegree)),
          static_cast<float>(s * std::sin(phi * kDegree)),
          static_cast<float>(std::cos(theta * kDegree))};
}

int add_image(core::SceneDescription& scene, int width, int height, int channels,
              const std::vector<int>& values) {
  core::Image image{width, height, channels, core::PixelType::kU8, {}};
  for (const int value : values) {
    image.bytes.push_back(static_cast<std::byte>(value));
  }
  CHECK(image.bytes.size() == image.value_count());
  scene.images.push_back(std::make_shared<const core::Image>(std::move(image)));
  return static_cast<int>(scene.images.size()) - 1;
}

core::SceneDescription load(const core::Bytes& glb, const core::GltfOptions& options) {
  auto scene = core::load_gltf(
      glb, [](std::string_view) { return core::SharedBytes(); }, options);
  CHECK(scene);
  return *std::move(scene);
}

Picture shoot(core::SceneDescription scene, const Shot& shot) {
  core::View view = view_of(std::move(scene), shot.width, shot.height);
  view.environment = shot.sky;
  view.settings.max_depth = shot.depth;
  view.settings.film.depth = shot.depth_layer;
  view.settings.spectral = shot.spectral;
  view.settings.estimator.roulette =
      core::RouletteType::kNone;  // only the tested feature is random
  return render(view, shot.samples);
}

Picture shoot_glb(const core::SceneDescription& scene, const Shot& shot) {
  return shoot(load(core::write_glb(scene)), shot);
}

Rgb pixel(const Picture& picture, int x, int y) {
  const auto at = static_cast<std::size_t>(y * picture.snapshot.rect.width + x);
  return core::pixel_value(picture.snapshot, at).mean;
}

float depth_at(const Picture& picture, int x, int y) {
  return picture.snapshot.aux[static_cast<std::size_t>(y * picture.snapshot.rect.width + x)]
      .depth_m;
}

double srgb_to_linear(double byte) {
  const double c = byte / 255;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

}  // namespace test_support
