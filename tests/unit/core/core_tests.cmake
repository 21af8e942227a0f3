set(CORE_TEST_SOURCES
  bsdf_test.cpp
  camera_test.cpp
  distribution_test.cpp
  film_test.cpp
  render_task_test.cpp
  reservoir_test.cpp
  sampler_test.cpp)
