#include "api/job_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "api/json.h"
#include "api/limits.h"
#include "api/values.h"
#include "core/math/vec.h"
#include "core/render/light_not_found.h"
#include "core/sampling/shared_samples.h"
#include "core/settings/registry.h"

namespace api {
namespace {

/// Sine of the angle below which two directions count as equal: float coordinates of a few metres
/// cannot distinguish them.
constexpr double kParallelSine = 1e-6;

struct Exact {
  double x, y, z;
};
Exact exact(core::Place v) { return {v.x, v.y, v.z}; }
double norm(Exact v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

void check_view(const core::CameraSettings& camera, Faults& faults) {
  const Exact eye = exact(*camera.position);
  const Exact target = exact(*camera.target);
  const Exact forward = {target.x - eye.x, target.y - eye.y, target.z - eye.z};
  if (norm(forward) == 0) {
    faults.add("/camera/target", "equals position");
    return;
  }
  const Exact up = exact(camera.up.value_or(core::Vec3{0, 1, 0}));
  const Exact side = {forward.y * up.z - forward.z * up.y, forward.z * up.x - forward.x * up.z,
                      forward.x * up.y - forward.y * up.x};
  if (norm(up) > 0 && norm(side) <= kParallelSine * norm(forward) * norm(up)) {
    faults.add("/camera/up", camera.up ? "is parallel to the direction from position to target"
                                       : "is [0, 1, 0], which is parallel to the direction from "
                                         "position to target; give another");
  }
}

/// Optimal MIS solves a 2x2 system for one light sample and one BSDF sample with known densities.
void check_optimal_mis(const core::RenderSettings& render, Faults& faults) {
  const core::EstimatorSettings& estimator = render.estimator;
  if (estimator.mis != core::MisType::kOptimal || estimator.strategy != core::Strategy::kMis) {
    return;
  }
  constexpr const char* kWhere = "/estimator/mis/type";
  if (render.light_sampler == core::LightSamplerType::kRis ||
      render.light_sampler == core::LightSamplerType::kRestir) {
    const std::string_view name = core::row_of(core::light_samplers(), render.light_sampler).name;
    faults.add(kWhere, "'optimal' cannot be combined with light sampler '" + std::string(name) +
                           "', whose density is unknown");
  }
  if (estimator.roulette == core::RouletteType::kThreshold) {
    faults.add(kWhere,
               "'optimal' cannot be combined with roulette 'threshold', which skips shadow rays");
  }
  if (estimator.control_variate != core::ControlVariateType::kNone) {
    faults.add(kWhere, "'optimal' cannot be combined with a control variate; it is one");
  }
  if (!estimator.expected_values) {
    faults.add(
        kWhere,
        "'optimal' cannot be combined with expected_values false, where paths end at random");
  }
}

/// `restir` shares light samples at camera hits, for paths that have one continuation each and use
/// the samples for nothing else.
void check_restir(const core::RenderSettings& render, Faults& faults) {
  if (render.light_sampler != core::LightSamplerType::kRestir) {
    return;
  }
  const int paths = render.light_block * render.light_block * render.light_history;
  if (paths > static_cast<int>(core::SharedSamples::kMost)) {
    const std::string block = std::to_string(render.light_block);
    faults.add("/light_sampler/history",
               std::to_string(render.light_history) + " passes of " + block + " x " + block +
                   " pixels are " + std::to_string(paths) + " paths that share samples; at most " +
                   std::to_string(core::SharedSamples::kMost) + " can");
  }
  const core::EstimatorSettings& estimator = render.estimator;
  if (estimator.strategy != core::Strategy::kMis && estimator.strategy != core::Strategy::kLight) {
    faults.add("/light_sampler/type", "'restir' applies only to strategies 'mis' and 'light'");
  }
  if (estimator.splitting != core::SplittingType::kNone) {
    faults.add(
        "/estimator/splitting/type",
        "cannot be combined with light sampler 'restir', which gives each path one light sample");
  }
  if (estimator.control_variate != core::ControlVariateType::kNone) {
    faults.add("/estimator/control_variate/type",
               "cannot be combined with light sampler 'restir': a neighbour's sample does not "
               "cancel the term subtracted for a path's own sample");
  }
}

/// The study strategies require a single BSDF at each point, and irradiance is measured in RGB.
void check_spectral(const core::RenderSettings& render, Faults& faults) {
  const core::Strategy strategy = render.estimator.strategy;
  if (!render.spectral) {
    return;
  }
  if (strategy == core::Strategy::kCosine || strategy == core::Strategy::kUniform) {
    faults.add("/estimator/strategy", shown(Json(core::row_of(core::strategies(), strategy).name)) +
                                          " cannot be combined with spectral true");
  }
  const auto& shares = render.film.shares;
  if (!render.meter.empty() ||
      std::any_of(shares.begin(), shares.end(),
                  [](const core::LightShare& share) { return share.is_irradiance; })) {
    faults.add("/spectral",
               "true cannot be combined with a meter or layer 'irradiance', which use RGB");
  }
}

/// Paths of different times cannot share samples, and a meter has a single time.
void check_shutter(const JobSpec& spec, const core::IntegratorEntry& row, Faults& faults) {
  constexpr std::string_view kOption = "/shutter_seconds";
  const auto accepts = [kOption](const core::IntegratorEntry& each) {
    return std::find(each.accepts.begin(), each.accepts.end(), kOption) != each.accepts.end();
  };
  if (!(spec.render.shutter_seconds > 0)) {
    return;
  }
  if (!spec.time_seconds) {
    faults.add(std::string(kOption),
               "cannot be combined with time_seconds null: in the rest pose nothing moves");
  }
  if (!accepts(row)) {
    std::string others;
    for (const core::IntegratorEntry& other : core::integrators()) {
      if (accepts(other)) {
        others += (others.empty() ? ", but by '" : ", '") + std::string(other.name) + "'";
      }
    }
    faults.add(std::string(kOption),
               "is not used by integrator '" + std::string(row.name) + "'" + others);
  }
  if (spec.render.light_sampler == core::LightSamplerType::kRestir) {
    faults.add("/light_sampler/type", "'restir' cannot be combined with shutter_seconds");
  }
  if (!spec.render.meter.empty()) {
    faults.add("/meter", "cannot be combined with shutter_seconds");
  }
}

/// Only light found along a single path can be assigned to a share.
void check_shares(const JobSpec& spec, const core::IntegratorEntry& row, Faults& faults) {
  const core::RenderSettings& render = spec.render;
  for (std::size_t i = 0; i < render.film.shares.size(); ++i) {
    const core::LightShare& share = render.film.shares[i];
    if (core::keeps_share(row, share)) {
      continue;
    }
    std::string others;
    for (const core::IntegratorEntry& other : core::integrators()) {
      if (core::keeps_share(other, share)) {
        others += (others.empty() ? ", but by '" : ", '") + std::string(other.name) + "'";
      }
    }
    faults.add(share_pointer(spec, i), "'" + share.layer + "' is not supported by integrator '" +
                                           std::string(row.name) + "'" + others);
  }
  if (render.film.shares.empty() && !render.fog && !render.spectral) {
    return;
  }
  const std::string reason =
      render.fog ? "cannot be combined with a medium"
      : render.spectral
          ? "cannot be combined with spectral true"
          : "cannot be combined with layers bounce:N, light:NAME, st:S,T and irradiance";
  if (render.estimator.mis == core::MisType::kOptimal) {
    faults.add("/estimator/mis/type", "'optimal' " + reason);
  }
  if (render.estimator.control_variate != core::ControlVariateType::kNone) {
    faults.add("/estimator/control_variate/type", reason);
  }
  if (render.light_sampler == core::LightSamplerType::kRestir) {
    faults.add("/light_sampler/type", "'restir' " + reason);
  }
}

}  // namespace

void check_camera(const JobSpec& spec, Faults& faults) {
  const core::CameraSettings& camera = spec.camera;
  if (camera.name && camera.index) {
    faults.add("/camera/index", "name and index both select a camera of the file; give only one");
  }
  if (camera.up && norm(exact(*camera.up)) == 0) {
    faults.add("/camera/up", "is the zero vector");
  }
  if (camera.type && *camera.type != core::CameraType::kPerspective &&
      camera.vertical_fov_degrees) {
    faults.add("/camera/vertical_fov_degrees", "applies only to perspective cameras");
  }
  if (camera.type && *camera.type != core::CameraType::kOrthographic &&
      camera.orthographic_height_m) {
    faults.add("/camera/orthographic_height", "applies only to orthographic cameras");
  }
  if (camera.type == core::CameraType::kPanorama) {
    if (camera.aperture_radius_m.value_or(0) > 0) {
      faults.add("/camera/aperture_radius", "a panorama has no lens");
    }
    const core::IntegratorEntry* row = core::find_integrator(spec.render.integrator);
    if (row != nullptr && row->splats) {
      faults.add("/camera/type",
                 "'panorama' cannot be combined with integrator '" + spec.render.integrator +
                     "', whose light paths are splatted: their filters would cross the seam");
    }
  }
  if (spec.orbit && (camera.position || camera.target)) {
    faults.add("/camera/orbit",
               "sets the camera's position; give either orbit or position and target");
  } else if (camera.position && camera.target) {
    check_view(camera, faults);
  } else if (camera.position) {
    faults.add("/camera/target", "is required with position");
  } else if (camera.target) {
    faults.add("/camera/position", "is required with target");
  }
}

void check_film(const core::FilmSettings& film, Faults& faults) {
  const std::int64_t pixels = static_cast<std::int64_t>(film.width) * film.height;
  if (pixels > limits::kFilmPixels) {
    faults.add_too_large("/film", std::to_string(film.width) + " x " + std::to_string(film.height) +
                                      " is " + std::to_string(pixels) + " pixels; at most " +
                                      std::to_string(limits::kFilmPixels) + " are allowed");
  }
  if (!film.crop) {
    return;
  }
  const core::PixelRect& crop = *film.crop;
  if (crop.x + crop.width > film.width) {
    faults.add("/film/crop", "ends at x = " + std::to_string(crop.x + crop.width) +
                                 ", outside the film's width of " + std::to_string(film.width));
  }
  if (crop.y + crop.height > film.height) {
    faults.add("/film/crop", "ends at y = " + std::to_string(crop.y + crop.height) +
                                 ", outside the film's height of " + std::to_string(film.height));
  }
}

void settle_film(JobSpec& spec) {
  if (spec.has_image) {
    return;
  }
  // A pixel keeps the passes of the meter in step; no client sees it.
  core::FilmSettings& film = spec.render.film;
  film.width = film.height = 1;
  film.crop.reset();
  film.shares.clear();
  for (const core::LayerEntry& layer : core::layers()) {
    if (layer.recorded != nullptr) {
      film.*layer.recorded = false;
    }
  }
  spec.layers.clear();
  spec.share_places.clear();
}

void check_image(const JobSpec& spec, Faults& faults) {
  if (!spec.has_image && spec.render.meter.empty()) {
    faults.add("/film", "is null, but the job has no meter: there is nothing to render");
  }
}

void check_class(const JobSpec& spec, Faults& faults) {
  if (spec.preview_key && spec.job_class != JobClass::kPreview) {
    faults.add("/preview_key", "applies only to class 'preview'");
  }
  // A preview exists only in memory; these settings promise something that outlives the process.
  if (spec.webhook && spec.job_class == JobClass::kPreview) {
    faults.add("/webhook", "applies only to class 'normal'");
  }
  if (spec.retention_seconds && spec.job_class == JobClass::kPreview) {
    faults.add("/retention_seconds", "applies only to class 'normal'");
  }
}

void check_error_target(const core::StopRules& stop, const JobSpec& spec, Faults& faults) {
  if (stop.meter_error && spec.render.meter.empty()) {
    faults.add("/stop/meter_error", "the job has no meter");
  }
  if (!spec.has_image) {
    constexpr const char* kNone = "the job has no image (film is null); give meter_error";
    if (stop.relative_error) {
      faults.add("/stop/relative_error", kNone);
    }
    if (stop.denoised_error) {
      faults.add("/stop/denoised_error", kNone);
    }
    if (stop.light_not_found) {
      faults.add("/stop/light_not_found", kNone);
    }
    return;
  }
  // Whether the scene has media is checked against it.
  if (const core::Status fits = core::check_light_rule(stop, spec.render, false); !fits) {
    faults.add(fits.error().where, fits.error().message);
  }
  if (!stop.denoised_error) {
    return;
  }
  // Stored jobs may name an integrator that this build lacks.
  const bool is_known = core::find_integrator(spec.render.integrator) != nullptr;
  if (spec.denoise.type == core::DenoiserType::kNone) {
    faults.add("/stop/denoised_error", "the job's denoise.type is 'none'");
  } else if (is_known && !core::halves_show_error(spec.render)) {
    faults.add("/stop/denoised_error",
               "the error of denoised images of integrator '" + spec.render.integrator +
                   "' is unknown: its images are biased, and their halves show only the noise; "
                   "give relative_error, samples_per_pixel or seconds");
  }
}

void check_options(const JobSpec& spec, Faults& faults) {
  const core::EstimatorSettings defaults;
  const core::EstimatorSettings& estimator = spec.render.estimator;
  if (estimator.strategy != core::Strategy::kMis &&
      (estimator.mis != defaults.mis || estimator.mis_exponent != defaults.mis_exponent)) {
    faults.add("/estimator/mis", "applies only to strategy 'mis'");
  }
  if (estimator.control_variate != core::ControlVariateType::kNone &&
      estimator.strategy != core::Strategy::kMis && estimator.strategy != core::Strategy::kLight) {
    faults.add("/estimator/control_variate", "applies only to strategies 'mis' and 'light'");
  }
  check_optimal_mis(spec.render, faults);
  check_restir(spec.render, faults);
  const core::IntegratorEntry* row = core::find_integrator(spec.render.integrator);
  CHECK(row != nullptr);
  check_error_target(spec.stop, spec, faults);
  check_shares(spec, *row, faults);
  check_spectral(spec.render, faults);
  check_shutter(spec, *row, faults);
  JobSpec plain;
  plain.render = core::default_settings(row->name, spec.stop.relative_error.has_value());
  const Json seen = to_json(spec);
  const Json usual = to_json(plain);
  for (const std::string_view option : core::integrator_options()) {
    const Json::json_pointer pointer{std::string(option)};
    if (!seen.contains(pointer) || !usual.contains(pointer)) {
      continue;  // printed where accepted, and refused elsewhere by the parser
    }
    if (!core::accepts(*row, option) && seen.at(pointer) != usual.at(pointer)) {
      faults.add(std::string(option), shown(seen.at(pointer)) + " is not used by integrator '" +
                                          spec.render.integrator + "'; its only value there is " +
                                          shown(usual.at(pointer)));
    }
  }
}

}  // namespace api
