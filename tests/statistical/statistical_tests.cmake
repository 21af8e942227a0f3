set(STATISTICAL_TEST_SOURCES
  bsdf_chi2_test.cpp
  convergence_test.cpp
  coverage_test.cpp
  error_estimate_test.cpp
  error_target_test.cpp
  lights_chi2_test.cpp)
