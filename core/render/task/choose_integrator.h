/// Chooses path, bdpt, sppm or path-caustics for jobs of type `auto`, by small pilot images of
/// each, whether `path` traces photons of caustics, how often it splits, and how it picks lights.
///
/// Each pilot uses a random stream of its own. The criterion is efficiency, 1 / (V T): V is the
/// squared error of the pilot's pixels, relative to the light that the pilots found there, times
/// the samples; T is work per sample, the number of rays times a fixed weight, never time. The
/// choice therefore depends only on the scene and on the job without its seed, crop, replicates and
/// machine, so all parts of an image make the same choice.
///
/// The squared error is that of the noise, from the halves, plus two parts that no halves show:
/// - A pilot that misses rare light is dark there and appears free of noise. Where two images
///   differ by more than twice their errors, the difference counts as error of the darker one.
/// - The bias of sppm and path-caustics is proportional to their squared radius, so an image with
///   half the radius has a quarter of it, and the difference of the two images shows the rest.
///   It falls more slowly than noise: V is that of 1,024 samples.
/// A candidate whose pilot lacks more than kLackMost of the light, as the census of its particles
/// finds (core/render/picture/light_not_found.h), is left out if another does not: no number of
/// samples brings that light.
///
/// Light samplers find the same light, so the error that a job reports is their V. Sources:
/// efficiency, Hammersley and Handscomb 1964; Veach 1997, 2.4. Bias: Knaus and Zwicker 2011.
#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/picture/view.h"

namespace core {

/// An error of 1% is hardly visible in a clean image.
inline constexpr double kLackMost = 0.01;
/// The same in a tenth of an image.
inline constexpr double kCausticsLeast = 0.1 * kLackMost;

struct PilotFigures {
  std::string_view name;  ///< of an integrator or a light sampler
  double samples = 0;     ///< per pixel
  double variance = 0;    ///< relative squared error of a sample, if there are 1,024
  double work = 0;        ///< per sample of a pixel, in rays of `path`
  double efficiency = 0;  ///< 1 / (variance work); infinite if there is no error
  double error = 0;       ///< as a job reports it
  double lacks = 0;       ///< LightNotFound::detected
};

struct PilotChoice {
  std::string_view name;             ///< a row of integrators()
  std::string reason;                ///< a full sentence
  std::vector<PilotFigures> pilots;  ///< path first; empty if none was needed
};

/// Chooses the integrator. has_error_target: not sppm and path-caustics, whose error is measured by
/// images of bdpt with an eighth of its samples: their doubt meets a target about when bdpt itself
/// does. Pre: view.settings.integrator is kAutomaticIntegrator with options that it accepts.
/// Errors: as settle().
Result<PilotChoice> choose_integrator(const View& view, bool has_error_target,
                                      const std::stop_token& stop = {});

/// Chooses path or kCausticsIntegrator, without pilots if caustics are no more than kCausticsLeast
/// of the light that arrives where the camera sees it. Pre: as above, of `path`. Errors: as above.
Result<PilotChoice> choose_caustics(const View& view, const std::stop_token& stop = {});

/// Chooses the number of continuations of a path at its first surface, from images with 1 and 2.
/// Pre: view.measured but for the count. Errors: as above.
Result<int> choose_split_count(const View& view, const std::stop_token& stop = {});

struct LightChoice {
  LightSamplerType type = LightSamplerType::kTree;
  int candidates = 1;                ///< of ris
  std::vector<PilotFigures> pilots;  ///< of tree, then ris with 2, 4, ... candidates
};

/// Chooses tree or ris, with twice the candidates as long as that raises the efficiency; tree
/// without pilots if all lights are distant: ris was then .62 to .89 times as efficient in four
/// scenes of files under maps. Not restir, which leaves the lanes: its rays take 1.7 to 5.1 times
/// as long, and its efficiency was that of ris or less in cornell-box, interior, many-lights,
/// veach-mis and glass. Pre: the integrator of view.settings accepts light samplers, and the other
/// options accept tree. Errors: as above.
Result<LightChoice> choose_light_sampler(const View& view, const std::stop_token& stop = {});

/// Replaces kAutomaticIntegrator, and `path` with caustics, by the choice, with its defaults, and
/// returns a warning that names it. Returns an empty string if the job names its integrator.
/// Errors: as above.
Result<std::string> settle_integrator(View& view, const StopRules& rules,
                                      const std::stop_token& stop = {});

/// Replaces LightSamplerType::kMeasured by the choice. Errors: as above.
Status settle_light_sampler(View& view, const std::stop_token& stop = {});

struct PilotImage {
  FilmSnapshot film;
  std::optional<FilmSnapshot> finer{};  ///< with half the radius, if the image is biased
  /// By how much samples times squared error are more at kJobSamples than in the pilot.
  double noise_growth = 1;
  double bias_growth = 1;
};

/// Returns the index of the best of the candidates.
std::size_t best_of(std::span<const PilotFigures> pilots);

/// Returns the relative squared errors of the pixels of images of the same size.
std::vector<double> pilot_errors(std::span<const PilotImage> images);

}  // namespace core
