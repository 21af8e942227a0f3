/// Options of the path tracer, selected once per job.
///
/// Types with the same members. StudyOptions holds everything that the settings can ask for;
/// WholeOptions adds features that few jobs use; DefaultOptions holds the defaults as constants, so
/// the default path compiles without branches other than for splitting. The loop
/// (core/integrators/path/path_tracer.h) is the same for all.
#pragma once

#include "core/bsdf/spectral_bsdf.h"
#include "core/film/replicate_fit.h"
#include "core/integrators/path/light_ledger.h"
#include "core/lights/environment.h"
#include "core/sampling/mis.h"
#include "core/settings/settings.h"

namespace core {

struct StudyOptions {
  using Ledger = NoLedger;
  using Surface = Bsdf;
  static constexpr bool has_media = false;    // NOLINT(readability-identifier-naming): a member
  static constexpr bool is_spectral = false;  // NOLINT(readability-identifier-naming): as above
  explicit StudyOptions(const RenderSettings& settings);

  Strategy strategy;
  MisRule mis;  ///< if weights are not fitted
  RouletteType roulette;
  ControlVariateType control_variate;
  FitType fit;
  float shadow_threshold;  ///< Russian roulette for shadow rays; 0: traces all of them
  int candidates;          ///< resampled light candidates, one of which is chosen
  int first_candidates;    ///< candidates at the first surface
  bool expected_values;    ///< false: analog absorption
  int split_count;         ///< continuations at the first surface
  int max_depth;
};

/// Adds features that few jobs use: scattering media and shares of the light.
struct WholeOptions : StudyOptions {
  using StudyOptions::StudyOptions;
  using Ledger = LightLedger;
  static constexpr bool has_media = true;  // NOLINT(readability-identifier-naming): as above
};

/// As WholeOptions, with wavelengths instead of RGB.
struct SpectralOptions : WholeOptions {
  using WholeOptions::WholeOptions;
  using Surface = SpectralBsdf;
  static constexpr bool is_spectral = true;  // NOLINT(readability-identifier-naming): as above
};

struct DefaultOptions {
  using Ledger = NoLedger;
  using Surface = Bsdf;
  explicit DefaultOptions(const RenderSettings& settings);
  /// Returns whether the settings ask for defaults only.
  static bool serves(const RenderSettings& settings);
  /// Returns whether the scene needs the defaults only, too.
  static bool serves(const IntegratorInput& input);

  // NOLINTBEGIN(readability-identifier-naming): the names of StudyOptions' members
  static constexpr Strategy strategy = Strategy::kMis;
  static constexpr MisRule mis{MisType::kPower, 2};
  static constexpr RouletteType roulette = RouletteType::kThroughput;
  static constexpr ControlVariateType control_variate = ControlVariateType::kNone;
  static constexpr FitType fit = FitType::kNone;
  static constexpr float shadow_threshold = 0;
  static constexpr int candidates = 1;
  static constexpr int first_candidates = 1;
  static constexpr bool expected_values = true;
  static constexpr bool has_media = false;
  static constexpr bool is_spectral = false;
  // NOLINTEND(readability-identifier-naming)
  int split_count;
  int max_depth;
};

/// Returns whether the estimators are the defaults, for any number of light candidates.
bool has_default_estimators(const RenderSettings& settings);

/// Returns whether the job has scattering media or shares of the light.
bool needs_whole_options(const IntegratorInput& input);

/// Returns the density by which path samples the environment. It may leave out dark parts if every
/// light sample is combined with BSDF samples by MIS and is neither resampled nor shared.
SkyDensity sky_density(const RenderSettings& settings);

}  // namespace core
