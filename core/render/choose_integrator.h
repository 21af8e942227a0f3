/// Chooses path or bdpt for jobs of type `auto`, by small pilot images of both.
///
/// Each pilot uses a random stream of its own. The criterion is efficiency, 1 / (V T): V is the
/// variance of the pilot's pixels, relative in each tile to the light that both pilots found there;
/// T is work, the number of rays times a fixed weight, never time. The choice therefore depends
/// only on the scene and on the job without its seed, crop, replicates and machine, so all parts of
/// an image make the same choice.
///
/// A pilot that misses rare light is dark there and appears free of noise. Where the two images
/// differ by more than their noise, the difference counts as variance of the darker one. Source:
/// efficiency, Hammersley and Handscomb 1964; Veach 1997, 2.4.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/view.h"

namespace core {

struct PilotFigures {
  std::string_view integrator;
  double variance = 0;    ///< relative
  double work = 0;        ///< per sample of a pixel, in rays of `path`
  double efficiency = 0;  ///< 1 / (variance work); infinite if there is no noise
};

struct IntegratorChoice {
  std::string_view integrator;           ///< a row of integrators()
  std::string reason;                    ///< a full sentence
  std::array<PilotFigures, 2> pilots{};  ///< path and bdpt; work is 0 if no pilot was needed
};

/// Chooses the integrator. Pre: view.settings.integrator is kAutomaticIntegrator with options that
/// it accepts. Errors: as Renderer::create().
Result<IntegratorChoice> choose_integrator(const View& view);

/// Replaces kAutomaticIntegrator by the choice and returns a warning that names it. Returns an
/// empty string if the job names its integrator. Errors: as above.
Result<std::string> settle_integrator(View& view);

/// Returns the relative variances of the pixels of two images of the same size.
std::array<double, 2> paired_variances(const FilmSnapshot& a, const FilmSnapshot& b);

}  // namespace core
