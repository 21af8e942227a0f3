/// Which integrator a job of type `auto` gets: path or bdpt, by pictures that both make small.
///
/// Each makes a pilot picture with random numbers of its own stream. What counts is efficiency,
/// 1 / (V T): V is the variance of the pilot's pixels, in tiles over the light that both saw there;
/// T is work, rays times a fixed weight, never time. So the choice is a function of the scene and
/// of the job without its seed, crop, replicates and machine: parts of a picture agree about it.
///
/// A pilot that misses rare light is dark there and seems to be without noise. Where the two
/// pictures differ by more than their noise, the difference is the darker one's variance.
/// Source: efficiency, Hammersley and Handscomb 1964; Veach 1997, 2.4.
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
  double work = 0;        ///< of a sample of a pixel, in rays of `path`
  double efficiency = 0;  ///< 1 / (variance work); infinite without noise
};

struct IntegratorChoice {
  std::string_view integrator;           ///< a row of integrators()
  std::string reason;                    ///< a sentence
  std::array<PilotFigures, 2> pilots{};  ///< of path and bdpt; work 0: there was no need for them
};

/// Pre: view.settings.integrator is kAutomaticIntegrator, and its options are those that it
/// accepts.
/// Errors: of Renderer::create().
Result<IntegratorChoice> choose_integrator(const View& view);

/// Puts the choice in the place of kAutomaticIntegrator, and returns the warning that says so;
/// empty where the job names its integrator. Errors: as above.
Result<std::string> settle_integrator(View& view);

/// Relative variances of the pixels of two pictures of the same size.
std::array<double, 2> paired_variances(const FilmSnapshot& a, const FilmSnapshot& b);

}  // namespace core
