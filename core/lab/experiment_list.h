/// The experiments, one constant each, listed in registry.cpp.
#pragma once

#include "core/lab/experiment.h"

namespace core::lab {

extern const Experiment kPiExperiment;
extern const Experiment kMseExperiment;
extern const Experiment kQuadratureExperiment;
extern const Experiment kInversionExperiment;
extern const Experiment kRenderingEquationExperiment;
extern const Experiment kStrategiesExperiment;
extern const Experiment kMisGammaExperiment;
extern const Experiment kOptimalMisExperiment;
extern const Experiment kInfiniteVarianceExperiment;
extern const Experiment kRouletteExperiment;
extern const Experiment kSplittingExperiment;
extern const Experiment kRouletteEfficiencyExperiment;
extern const Experiment kExpectedValuesExperiment;
extern const Experiment kControlVariateExperiment;
extern const Experiment kRegressionExperiment;
extern const Experiment kAntitheticExperiment;
extern const Experiment kDiscrepancyExperiment;
extern const Experiment kSamplers2dExperiment;
extern const Experiment kSamplers4dExperiment;
extern const Experiment kRisExperiment;
extern const Experiment kReservoirExperiment;
extern const Experiment kReservoirMergeExperiment;
extern const Experiment kRestirExperiment;
extern const Experiment kPathIntegralExperiment;
extern const Experiment kMetropolisExperiment;
extern const Experiment kDensityEstimationExperiment;
extern const Experiment kPpmExperiment;
extern const Experiment kIrradianceCacheExperiment;
extern const Experiment kStoppingExperiment;

}  // namespace core::lab
