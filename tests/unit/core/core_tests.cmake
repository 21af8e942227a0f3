set(CORE_TEST_SOURCES
  sampler_test.cpp)
