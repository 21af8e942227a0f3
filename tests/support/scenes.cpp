#include "tests/support/scenes.h"

#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

#include "core/base/check.h"
#include "core/integrators/registry.h"
#include "core/math/numbers.h"
#include "core/render/task/settle.h"

namespace test_support {

using core::Rgb;
using core::Vec3;

core::PrimitiveDescription sphere(Vec3 center, float radius_m, int stacks, bool inward,
                                  int material) {
  core::PrimitiveDescription p;
  p.material = material;
  const int slices = 2 * stacks;
  for (int i = 0; i <= stacks; ++i) {
    const float theta = core::kPi * static_cast<float>(i) / static_cast<float>(stacks);
    for (int k = 0; k <= slices; ++k) {
      const float phi = core::kTwoPi * static_cast<float>(k % slices) / static_cast<float>(slices);
      const float s = i == 0 || i == stacks ? 0.0F : std::sin(theta);
      const Vec3 n = {s * std::cos(phi), std::cos(theta), s * std::sin(phi)};
      p.positions.push_back(center + n * radius_m);
      p.normals.push_back(inward ? -n : n);
    }
  }
  const auto at = [slices](int i, int k) {
    return static_cast<std::uint32_t>(i * (slices + 1) + k);
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    p.indices.insert(p.indices.end(), {a, inward ? c : b, inward ? b : c});
  };
  for (int i = 0; i < stacks; ++i) {
    for (int k = 0; k < slices; ++k) {
      if (i > 0) {
        add(at(i, k), at(i, k + 1), at(i + 1, k));
      }
      if (i + 1 < stacks) {
        add(at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
      }
    }
  }
  return p;
}

core::PrimitiveDescription quad(Vec3 corner, Vec3 edge1, Vec3 edge2, int material) {
  core::PrimitiveDescription p;
  p.material = material;
  p.positions = {corner, corner + edge1, corner + edge1 + edge2, corner + edge2};
  p.uv[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  p.indices = {0, 1, 2, 0, 2, 3};
  return p;
}

core::PrimitiveDescription box(Vec3 center, Vec3 half, float angle_rad, int material) {
  core::PrimitiveDescription p;
  p.material = material;
  const Vec3 x = Vec3{std::cos(angle_rad), 0, std::sin(angle_rad)} * half.x;
  const Vec3 y = {0, half.y, 0};
  const Vec3 z = Vec3{-std::sin(angle_rad), 0, std::cos(angle_rad)} * half.z;
  for (int i = 0; i < 8; ++i) {
    const auto sign = [i](int bit) { return (i >> bit & 1) != 0 ? 1.0F : -1.0F; };
    p.positions.push_back(center + x * sign(0) + y * sign(1) + z * sign(2));
  }
  p.indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
               2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return p;
}

core::PrimitiveDescription disk(Vec3 center, float radius_m, int material) {
  core::PrimitiveDescription p;
  p.material = material;
  constexpr std::uint32_t kSides = 512;
  p.positions.push_back(center);
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const float phi = core::kTwoPi * static_cast<float>(i) / kSides;
    p.positions.push_back(center + Vec3{radius_m * std::cos(phi), 0, radius_m * std::sin(phi)});
    p.indices.insert(p.indices.end(), {0, 1 + i, 1 + (i + 1) % kSides});
  }
  return p;
}

core::MaterialDescription lambert(Rgb albedo) {
  core::MaterialDescription m;
  m.base_color = albedo;
  m.metallic = 0;
  m.roughness = 1;
  m.specular = 0;
  return m;
}

core::MaterialDescription emitter(Rgb radiance) {
  core::MaterialDescription m = lambert({0, 0, 0});
  m.emissive = radiance;
  return m;
}

core::MaterialDescription mirror() {
  core::MaterialDescription m;
  m.metallic = 1;
  m.roughness = 0;
  return m;
}

core::MaterialDescription glass(float ior, float thickness) {
  core::MaterialDescription m;
  m.metallic = 0;
  m.roughness = 0;
  m.transmission = 1;
  m.ior = ior;
  m.thickness = thickness;
  return m;
}

core::PunctualLightDescription directional(const core::Transform& to_world, Rgb irradiance) {
  core::PunctualLightDescription light;
  light.type = core::PunctualType::kDirectional;
  light.intensity = irradiance;
  light.to_world = to_world;
  return light;
}

core::SceneDescription scene_of(std::vector<core::MaterialDescription> materials,
                                std::vector<core::PrimitiveDescription> primitives) {
  core::SceneDescription scene;
  scene.materials = std::move(materials);
  scene.meshes.emplace_back();
  scene.meshes.back().primitives = std::move(primitives);
  scene.instances.push_back({0, {}});
  return scene;
}

core::SceneDescription cornell() {
  std::vector<core::PrimitiveDescription> p;
  p.push_back(quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0));                     // floor
  p.push_back(quad({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, 0));                     // ceiling
  p.push_back(quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0));                     // back
  p.push_back(quad({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1));                     // left
  p.push_back(quad({1, 0, 0}, {0, 0, 1}, {0, 1, 0}, 2));                     // right
  p.push_back(quad({0.35F, 0.999F, 0.35F}, {0.3F, 0, 0}, {0, 0, 0.3F}, 3));  // light, faces down
  const auto box = [&p](Vec3 at, Vec3 size) {
    p.push_back(quad(at, {0, size.y, 0}, {size.x, 0, 0}, 0));
    p.push_back(quad(at + Vec3{0, 0, size.z}, {size.x, 0, 0}, {0, size.y, 0}, 0));
    p.push_back(quad(at, {0, 0, size.z}, {0, size.y, 0}, 0));
    p.push_back(quad(at + Vec3{size.x, 0, 0}, {0, size.y, 0}, {0, 0, size.z}, 0));
    p.push_back(quad(at + Vec3{0, size.y, 0}, {0, 0, size.z}, {size.x, 0, 0}, 0));
  };
  box({0.15F, 0, 0.15F}, {0.3F, 0.6F, 0.3F});
  box({0.55F, 0, 0.5F}, {0.3F, 0.3F, 0.3F});
  return scene_of({lambert({0.73F, 0.73F, 0.73F}), lambert({0.65F, 0.05F, 0.05F}),
                   lambert({0.12F, 0.45F, 0.15F}), emitter({15, 15, 15})},
                  std::move(p));
}

std::shared_ptr<const core::Scene> build(core::SceneDescription description) {
  auto scene = core::Scene::build(std::move(description), 1);
  CHECK(scene);
  return *scene;
}

std::shared_ptr<const core::Environment> constant_sky(Rgb radiance) {
  core::EnvironmentSettings settings;
  settings.color = radiance;
  auto sky = core::Environment::create(nullptr, settings);
  CHECK(sky);
  return *sky;
}

std::shared_ptr<const core::Environment> sky_map(int width, int height,
                                                 const std::function<Rgb(int, int)>& value,
                                                 float rotation_degrees) {
  core::Image image;
  image.width = width;
  image.height = height;
  image.channels = 3;
  image.type = core::PixelType::kF32;
  std::vector<float> values;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Rgb c = value(x, y);
      values.insert(values.end(), {c.r, c.g, c.b});
    }
  }
  image.bytes.resize(values.size() * sizeof(float));
  std::memcpy(image.bytes.data(), values.data(), image.bytes.size());
  core::EnvironmentSettings settings;
  settings.rotation_degrees = rotation_degrees;
  auto sky = core::Environment::create(&image, settings);
  CHECK(sky);
  return *sky;
}

core::View view_of(std::shared_ptr<const core::Scene> scene, int width, int height) {
  core::View view;
  view.scene = std::move(scene);
  view.settings.film.width = width;
  view.settings.film.height = height;
  view.settings.film.filter = {core::FilterType::kBox, 0.5F};
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = false;
  return view;
}

core::View view_of(core::SceneDescription scene, int width, int height) {
  return view_of(build(std::move(scene)), width, height);
}

void look_at(core::View& view, Vec3 from, Vec3 to, float fov_degrees) {
  view.camera.position = from;
  view.camera.target = to;
  view.camera.vertical_fov_degrees = fov_degrees;
}

core::View cornell_view(int width, int height, float fov_degrees, float height_m) {
  core::View view = view_of(cornell(), width, height);
  look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, height_m, 0}, fov_degrees);
  return view;
}

Rgb Picture::mean() const {
  double sum[3] = {};
  for (std::size_t i = 0; i < snapshot.pixel_count(); ++i) {
    const Rgb c = core::pixel_value(snapshot, i).mean;
    for (int k = 0; k < 3; ++k) {
      sum[k] += static_cast<double>(c[k]);
    }
  }
  const auto n = static_cast<double>(snapshot.pixel_count());
  return {static_cast<float>(sum[0] / n), static_cast<float>(sum[1] / n),
          static_cast<float>(sum[2] / n)};
}

Rgb Picture::standard_error() const {
  double sum[3] = {};
  for (std::size_t i = 0; i < snapshot.pixel_count(); ++i) {
    const Rgb d = core::half_value(snapshot, i, 0).mean - core::half_value(snapshot, i, 1).mean;
    for (int k = 0; k < 3; ++k) {
      sum[k] += static_cast<double>(d[k]) * static_cast<double>(d[k]) / 4;
    }
  }
  const auto n = static_cast<double>(snapshot.pixel_count());
  return {static_cast<float>(std::sqrt(sum[0]) / n), static_cast<float>(std::sqrt(sum[1]) / n),
          static_cast<float>(std::sqrt(sum[2]) / n)};
}

core::RenderSettings accepted(const core::RenderSettings& settings) {
  core::RenderSettings out = settings;
  const core::RenderSettings usual = core::default_settings(settings.integrator);
  const core::IntegratorEntry& row = core::row_of(core::integrators(), settings.integrator);
  const auto keep = [&](std::string_view option, auto member) {
    if (!core::accepts(row, option)) {
      member(out) = member(usual);
    }
  };
  keep(
      "/integrator/max_depth", [](auto& s) -> auto& { return s.max_depth; });
  keep(
      "/integrator/photons", [](auto& s) -> auto& { return s.photons.paths; });
  keep(
      "/integrator/radius_m", [](auto& s) -> auto& { return s.photons.radius_m; });
  keep(
      "/integrator/alpha", [](auto& s) -> auto& { return s.photons.alpha; });
  keep(
      "/integrator/final_gather", [](auto& s) -> auto& { return s.photons.final_gather; });
  keep(
      "/integrator/rays", [](auto& s) -> auto& { return s.cache; });
  keep(
      "/estimator/mis", [](auto& s) -> auto& { return s.estimator.mis; });
  keep(
      "/estimator/mis", [](auto& s) -> auto& { return s.estimator.mis_exponent; });
  keep(
      "/estimator/roulette", [](auto& s) -> auto& { return s.estimator.roulette; });
  keep(
      "/estimator/splitting", [](auto& s) -> auto& { return s.estimator.splitting; });
  keep(
      "/sampler/type", [](auto& s) -> auto& { return s.sampler; });
  keep(
      "/light_sampler", [](auto& s) -> auto& { return s.light_sampler; });
  return out;
}

core::Result<std::shared_ptr<const core::Renderer>> settled_renderer(core::View view) {
  view.settings = accepted(view.settings);
  return core::settled_renderer(std::move(view));
}

Picture render(const core::View& view, const core::StopRules& stop, int threads) {
  auto renderer = test_support::settled_renderer(view);
  CHECK(renderer);
  Picture picture;
  picture.film = core::make_film(view.settings);
  core::NullSink sink;
  core::TaskOptions options;
  options.stop = stop;
  core::RenderTask task(*renderer, picture.film, options, sink);
  core::run_to_end(task, threads);
  picture.snapshot = picture.film->snapshot();
  picture.reason = task.stop_reason();
  picture.progress = task.progress();
  picture.points = task.points();
  return picture;
}

Picture render(const core::View& view, int samples_per_pixel, int threads) {
  core::StopRules stop;
  stop.samples_per_pixel = samples_per_pixel;
  return render(view, stop, threads);
}

}  // namespace test_support
