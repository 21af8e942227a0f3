set(STATISTICAL_TEST_SOURCES
  bsdf_chi2_test.cpp
  error_estimate_test.cpp
  lights_chi2_test.cpp)
