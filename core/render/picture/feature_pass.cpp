#include "core/render/picture/feature_pass.h"

#include <algorithm>
#include <utility>

#include "core/accel/accel.h"
#include "core/camera/camera.h"
#include "core/camera/moving_camera.h"
#include "core/film/camera_sample.h"
#include "core/lights/backdrop.h"
#include "core/render/picture/camera_start.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/streams.h"
#include "core/transport/intersect.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

/// Maximum number of mirrors and glass surfaces that a path follows.
constexpr int kSmoothMost = 16;
/// Standard error of a pixel's features that needs no more than kQuickFeatureSamples: a twentieth
/// of what denoisers take for agreement (kAlbedoSigma).
constexpr float kSteady = 0.005F;

/// The features found by one path.
struct Found {
  Rgb albedo;
  Rgb normal;
  float depth_m = 0;
  Rgb emission;
};

Rgb as_rgb(Vec3 v) { return {v.x, v.y, v.z}; }

Found first_rough_surface(const View& view, const Camera::CameraRay& camera_ray,
                          const PathSampler& sampler) {
  const SceneData& scene = view.scene->data();
  std::uint64_t rays = 0;
  PathState path = start_path(scene, camera_ray, sampler, rays);
  PathVertex vertex;
  Found out;
  float way_m = camera_ray.start_m;
  for (int k = 0; k < kSmoothMost; ++k) {
    if (!reach(scene, path, vertex)) {
      if (path.depth == 0) {
        const Backdrop backdrop(view.settings.background, view.environment.get());
        out.emission = path.beta * backdrop.seen(path.ray.direction).value_or(Rgb{});
      } else {
        out.depth_m = way_m;
        if (view.environment != nullptr) {
          out.emission = path.beta * view.environment->background(path.ray.direction);
        }
      }
      return out;
    }
    way_m += vertex.passed_m + vertex.distance_m;
    const Material& material = scene.materials[vertex.point.material];
    if (material.factors.unlit) {
      out.normal = as_rgb(vertex.point.normal_shading);
      out.depth_m = way_m;
      out.emission =
          path.beta * unlit_color(material, vertex.point, vertex.wo_world, path.footprint());
      return out;
    }
    surface_event(scene, path, vertex);
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (bsdf.has_spread() || material.is_emissive) {
      out.albedo = path.beta * bsdf.albedo();
      out.normal = as_rgb(vertex.shading.frame.n);
      out.depth_m = way_m;
      out.emission = material.is_emissive
                         ? path.beta * emitted(material, vertex.point, vertex.wo_world)
                         : Rgb{};
      return out;
    }
    const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
    const BsdfSample sample = bsdf.sample(u.x, {u.y, u.z});
    if (is_black(sample.weight)) {
      return out;
    }
    scatter(scene, path, vertex, sample, 1);
  }
  return out;
}

/// The mean, and its variance summed over channels.
struct ColorSums {
  Rgb sum;
  Rgb squares;
  void add(Rgb v) {
    sum += v;
    squares += v * v;
  }
  Rgb mean(float n) const { return sum / n; }
  float variance(float n) const {
    const Rgb left = squares - sum * sum / n;
    return std::max(left.r + left.g + left.b, 0.0F) / (n * (n - 1));
  }
  float squared_mean(float n) const {
    const Rgb m = mean(n);
    return m.r * m.r + m.g * m.g + m.b * m.b;
  }
};

struct PixelSums {
  ColorSums albedo;
  ColorSums normal;
  ColorSums depth;
  ColorSums emission;
  int count = 0;
  void add(const Found& found) {
    albedo.add(found.albedo);
    normal.add(found.normal);
    depth.add({found.depth_m, 0, 0});
    emission.add(found.emission);
    ++count;
  }
  /// Depth and emission have no scale: their errors are relative.
  bool is_steady() const {
    constexpr float kMost = kSteady * kSteady;
    const auto n = static_cast<float>(count);
    return albedo.variance(n) <= kMost && normal.variance(n) <= kMost &&
           depth.variance(n) <= kMost * depth.squared_mean(n) &&
           emission.variance(n) <= kMost * emission.squared_mean(n);
  }
};

void put(ColorPlanes& planes, std::size_t i, Rgb v) {
  planes[0][i] = v.r;
  planes[1][i] = v.g;
  planes[2][i] = v.b;
}

}  // namespace

Result<std::optional<FeaturePicture>> feature_pass(const View& view, const ParallelFor& parallel,
                                                   int samples, const std::stop_token& stop) {
  const FilmSettings& film = view.settings.film;
  const SceneSummary& summary = view.scene->summary();
  auto camera =
      MovingCamera::create(view.camera, summary.cameras, summary.bounds, film.width, film.height);
  if (!camera) {
    return camera.error();
  }
  place_in_solids(*camera, view.scene->data(),
                  {static_cast<float>(film.width), static_cast<float>(film.height)},
                  view.settings.shutter_seconds > 0);
  const FilterSampler filter(film.filter);
  const PixelRect crop = film.area();
  FeaturePicture out = FeaturePicture::blank(crop.width, crop.height);
  out.samples = samples;
  out.has_fog = view.settings.fog.has_value();
  parallel(crop.height, [&](int row) {
    if (stop.stop_requested()) {
      return;
    }
    prepare_tracing_thread();
    PathSampler sampler(SamplerType::kSobol, 1, view.settings.seed | kFeatureStream);
    for (int column = 0; column < crop.width; ++column) {
      const int x = crop.x + column;
      const int y = crop.y + row;
      PixelSums sums;
      for (int s = 0; s < samples && !(s == kQuickFeatureSamples && sums.is_steady()); ++s) {
        // Features are plain means: weights of filters with negative lobes are left out.
        const CameraSample at = start_camera_sample(sampler, filter, x, y, s);
        const float time = view.settings.shutter_seconds > 0 ? sampler.get_4d(kTimeGroup).x : 0.0F;
        const Found found =
            first_rough_surface(view, camera->ray(at.film_px, at.lens, time), sampler);
        if (is_finite(found.albedo + found.normal + found.emission + Rgb(found.depth_m))) {
          sums.add(found);
        }
      }
      if (sums.count < 2) {
        continue;
      }
      const auto n = static_cast<float>(sums.count);
      const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(crop.width) +
                     static_cast<std::size_t>(column);
      put(out.albedo, i, sums.albedo.mean(n));
      put(out.normal, i, sums.normal.mean(n));
      put(out.emission, i, sums.emission.mean(n));
      out.depth_m[i] = sums.depth.mean(n).r;
      out.albedo_variance[i] = sums.albedo.variance(n);
      out.normal_variance[i] = sums.normal.variance(n);
      out.depth_variance[i] = sums.depth.variance(n);
      out.emission_variance[i] = sums.emission.variance(n);
    }
  });
  if (stop.stop_requested()) {
    return std::optional<FeaturePicture>();
  }
  return std::optional(std::move(out));
}

}  // namespace core
