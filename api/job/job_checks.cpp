#include "api/job/job_checks.h"

#include <cstdint>
#include <utility>

#include "api/json/limits.h"
#include "core/base/invalid.h"
#include "core/camera/camera_choice.h"
#include "core/layers/layer_rows.h"

namespace api {
namespace {

void add_error(const core::Status& status, Faults& faults) {
  if (!status) {
    faults.add(status.error().where, status.error().message);
  }
}

}  // namespace

void check_camera(const JobSpec& spec, Faults& faults) {
  core::CameraSettings camera = spec.camera;
  if (camera.type) {
    add_error(core::check_members(camera, *camera.type), faults);
  }
  const core::FilmSettings& film = spec.render.film;
  add_error(core::check_values(camera, film.width, film.height), faults);
  if (spec.orbit && (camera.is_placed() || camera.target)) {
    faults.add("/camera/orbit", camera.pose
                                    ? "sets the camera's position; give either orbit or pose"
                                    : "sets the camera's position; give either orbit or "
                                      "position and target");
    camera.position.reset();
    camera.target.reset();
  }
  for (const core::Error& error : core::view_faults(camera)) {
    faults.add(error.where, error.message);
  }
}

void check_film(const core::FilmSettings& film, Faults& faults) {
  const std::int64_t pixels = static_cast<std::int64_t>(film.width) * film.height;
  if (pixels > limits::kFilmPixels) {
    faults.add_too_large("/film", std::to_string(film.width) + " x " + std::to_string(film.height) +
                                      " is " + std::to_string(pixels) + " pixels; at most " +
                                      std::to_string(limits::kFilmPixels) + " are allowed");
  }
}

void drop_image(JobSpec& spec) {
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

core::Status check_denoiser(core::DenoiserType type, std::string where) {
  return type == core::DenoiserType::kNone
             ? core::invalid(std::move(where), "the job's denoise.type is 'none'")
             : core::ok_status();
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
  if (stop.denoised_error) {
    add_error(check_denoiser(spec.denoise.type, "/stop/denoised_error"), faults);
  }
  for (core::BrokenRule& rule : core::broken_stop_rules(stop, spec.render, nullptr)) {
    faults.add(std::move(rule.pointer), std::move(rule.reason));
  }
}

void check_rules(const JobSpec& spec, const core::SceneTraits* scene, Faults& faults) {
  for (core::BrokenRule& rule : core::broken_rules(spec.render, spec.camera, scene)) {
    faults.add(rule.share ? share_pointer(spec, *rule.share) : std::move(rule.pointer),
               std::move(rule.reason));
  }
}

void check_shutter(const JobSpec& spec, Faults& faults) {
  if (spec.render.shutter_seconds > 0 && !spec.time_seconds) {
    faults.add("/shutter_seconds", "requires time_seconds: in the rest pose nothing moves");
  }
}

}  // namespace api
