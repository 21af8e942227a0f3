# Figures, never asserted: tests/bench/run prints them.
if(TARGET core AND TARGET test_support)
  add_executable(core_bench bench/core_bench.cpp bench/hall.cpp)
  target_link_libraries(core_bench PRIVATE core test_support tessera_lto)
endif()
