/// The experiments, one constant each, listed in registry.cpp; and code that several of them share.
#pragma once

#include <array>
#include <cstdint>

#include "core/lab/experiment.h"

namespace core::lab {

extern const Experiment kPiExperiment;
extern const Experiment kQuadratureExperiment;
extern const Experiment kStrategiesExperiment;
extern const Experiment kMisGammaExperiment;
extern const Experiment kOptimalMisExperiment;
extern const Experiment kRouletteExperiment;
extern const Experiment kSplittingExperiment;
extern const Experiment kExpectedValuesExperiment;
extern const Experiment kControlVariateExperiment;
extern const Experiment kRegressionExperiment;
extern const Experiment kAntitheticExperiment;
extern const Experiment kSamplers2dExperiment;
extern const Experiment kSamplers4dExperiment;
extern const Experiment kRisExperiment;
extern const Experiment kReservoirExperiment;
extern const Experiment kRestirExperiment;
extern const Experiment kPpmExperiment;
extern const Experiment kStoppingExperiment;

/// Powers of four, which every sampler uses unchanged or nearly so.
inline constexpr std::array<std::int64_t, 6> kPowersOfFour = {16, 64, 256, 1024, 4096, 16384};

}  // namespace core::lab
