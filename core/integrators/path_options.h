/// What the path tracer does at a vertex, chosen once a job.
///
/// Types with the same members: StudyOptions holds whatever the settings ask for; WholeOptions also
/// renders what few jobs have; DefaultOptions holds the defaults as constants, so that the default
/// path is compiled without a branch for anything else but splitting. The loop
/// (core/integrators/path_tracer.h) is one source for all.
#pragma once

#include "core/bsdf/spectral_bsdf.h"
#include "core/film/replicate_fit.h"
#include "core/integrators/light_ledger.h"
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
  MisRule mis;  ///< where weights are not fitted
  RouletteType roulette;
  ControlVariateType control_variate;
  FitType fit;
  float shadow_threshold;  ///< of roulette for shadow rays; 0: every one is traced
  int candidates;          ///< light samples of which one is taken (resampling)
  int first_candidates;    ///< the same at the first surface
  bool expected_values;    ///< false: analog absorption
  int split_count;         ///< continuations at the first surface
  int max_depth;
};

/// The same with all that few jobs ask for: media that scatter, shares of the light.
struct WholeOptions : StudyOptions {
  using StudyOptions::StudyOptions;
  using Ledger = LightLedger;
  static constexpr bool has_media = true;  // NOLINT(readability-identifier-naming): as above
};

/// The same with wavelengths instead of colours.
struct SpectralOptions : WholeOptions {
  using WholeOptions::WholeOptions;
  using Surface = SpectralBsdf;
  static constexpr bool is_spectral = true;  // NOLINT(readability-identifier-naming): as above
};

struct DefaultOptions {
  using Ledger = NoLedger;
  using Surface = Bsdf;
  explicit DefaultOptions(const RenderSettings& settings);
  /// Do the settings ask for nothing else?
  static bool serves(const RenderSettings& settings);
  /// And has the scene nothing else?
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

/// Does the job have media that scatter, or shares of the light?
bool needs_whole_options(const IntegratorInput& input);

/// What path samples the sky by: where each light sample is weighted against the BSDF's, and is no
/// candidate or partner of others, it need not be found everywhere.
SkyDensity sky_density(const RenderSettings& settings);

}  // namespace core
