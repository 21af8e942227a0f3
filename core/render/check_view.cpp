#include "core/render/check_view.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/film/replicate_fit.h"
#include "core/settings/registry.h"

namespace core {
namespace {

Error refused(std::string message, std::string pointer) {
  return Error{ErrorCode::kInvalidArgument, std::move(message), std::move(pointer)};
}

/// Refuses options that combine light of different paths.
Status check_mixing(const RenderSettings& settings, const std::string& reason) {
  if (settings.light_sampler == LightSamplerType::kRestir) {
    return refused("'restir' " + reason, "/light_sampler/type");
  }
  if (settings.estimator.control_variate != ControlVariateType::kNone) {
    return refused("a control variate " + reason, "/estimator/control_variate/type");
  }
  if (fit_type(settings) != FitType::kNone) {
    return refused("'optimal' " + reason, "/estimator/mis/type");
  }
  return ok_status();
}

/// Checks that the integrator supports the shares of the light and spectral paths with the options.
/// Parameters and errors as above.
Status check_light(const View& view, const IntegratorEntry* integrator) {
  const RenderSettings& settings = view.settings;
  if (integrator == nullptr || (settings.film.shares.empty() && !settings.spectral)) {
    return ok_status();
  }
  for (const LightShare& share : settings.film.shares) {
    if (!keeps_share(*integrator, share)) {
      return refused(settings.integrator + " does not support layer '" + share.layer + "'",
                     "/film/layers");
    }
    const auto& groups = view.scene->summary().light_groups;
    if (share.group && std::find(groups.begin(), groups.end(), *share.group) == groups.end()) {
      return refused("'" + *share.group + "' is not a light group of the scene", "/film/layers");
    }
  }
  const bool is_irradiance =
      std::any_of(settings.film.shares.begin(), settings.film.shares.end(),
                  [](const LightShare& share) { return share.is_irradiance; });
  if (settings.spectral && (is_irradiance || !settings.meter.empty())) {
    return refused("true cannot be combined with a meter or layer 'irradiance', which use RGB",
                   "/spectral");
  }
  if (settings.spectral && (settings.estimator.strategy == Strategy::kCosine ||
                            settings.estimator.strategy == Strategy::kUniform)) {
    return refused("'cosine' and 'uniform' cannot be combined with spectral true",
                   "/estimator/strategy");
  }
  return check_mixing(
      settings, settings.spectral
                    ? "cannot be combined with spectral true"
                    : "cannot be combined with layers bounce:N, light:NAME, st:S,T and irradiance");
}

/// Checks that the integrator supports an open shutter. Parameters and errors as above.
Status check_shutter(const RenderSettings& settings, const IntegratorEntry* integrator) {
  if (!(settings.shutter_seconds > 0) || integrator == nullptr) {
    return ok_status();
  }
  if (!accepts(*integrator, "/shutter_seconds")) {
    return refused(settings.integrator + " does not support shutter_seconds; use path",
                   "/shutter_seconds");
  }
  if (settings.light_sampler == LightSamplerType::kRestir) {
    return refused("'restir' cannot be combined with shutter_seconds", "/light_sampler/type");
  }
  if (!settings.meter.empty()) {
    return refused("a meter cannot be combined with shutter_seconds", "/meter");
  }
  return ok_status();
}

Status check_catcher(const RenderSettings& settings) {
  if (has_catcher(settings) &&
      (settings.integrator != "path" || settings.estimator.strategy != Strategy::kMis ||
       settings.light_sampler == LightSamplerType::kRestir || settings.fog || settings.spectral ||
       !settings.film.shares.empty())) {
    return refused(
        "'catcher' requires integrator 'path' and strategy 'mis'; it cannot be combined with "
        "'restir', a medium, spectral true or layers bounce:N, light:NAME, st:S,T and irradiance",
        "/ground/type");
  }
  return ok_status();
}

}  // namespace

Status check_matter(const RenderSettings& settings, const SceneSummary& scene,
                    const IntegratorEntry* integrator) {
  if (integrator == nullptr) {
    return ok_status();
  }
  if (settings.background.through_glass && !accepts(*integrator, kThroughGlass)) {
    return refused("true is not supported by " + settings.integrator + "; use path",
                   std::string(kThroughGlass));
  }
  if (scene.has_dispersion && !integrator->disperses) {
    return refused(
        "the scene has dispersion, which " + settings.integrator + " does not support; use path",
        "/integrator/type");
  }
  if (!scene.has_scattering && !settings.fog) {
    return ok_status();
  }
  if (!integrator->media) {
    return refused("the scene has scattering media, which " + settings.integrator +
                       " does not support; use path or bdpt",
                   "/integrator/type");
  }
  return check_mixing(settings, "cannot be combined with scattering media");
}

Status check_crop(const FilmSettings& film) {
  if (film.crop) {
    const PixelRect& c = *film.crop;
    if (c.x < 0 || c.y < 0 || c.width < 1 || c.height < 1 || c.x > film.width - c.width ||
        c.y > film.height - c.height) {
      return refused("the crop extends beyond the film", "/film/crop");
    }
  }
  return ok_status();
}

Result<MovingCamera> check_view(const View& view) {
  const RenderSettings& settings = view.settings;
  const SceneSummary& summary = view.scene->summary();
  const IntegratorEntry* integrator = find_integrator(settings.integrator);
  if (const Status fits = check_crop(settings.film); !fits) {
    return fits.error();
  }
  if (const Status fits = check_matter(settings, summary, integrator); !fits) {
    return fits.error();
  }
  if (const Status fits = check_light(view, integrator); !fits) {
    return fits.error();
  }
  if (const Status fits = check_shutter(settings, integrator); !fits) {
    return fits.error();
  }
  if (const Status fits = check_catcher(settings); !fits) {
    return fits.error();
  }
  auto camera = MovingCamera::create(view.camera, summary.cameras, summary.bounds,
                                     settings.film.width, settings.film.height);
  if (camera && camera->first().type() == CameraType::kPanorama && integrator != nullptr &&
      integrator->splats) {
    // Filters reach across the seam and the poles of a panorama, where splats would be cut off.
    return refused(
        "'panorama' cannot be combined with integrators that splat light paths, such as " +
            settings.integrator + "; use path",
        "/camera/type");
  }
  return camera;
}

}  // namespace core
