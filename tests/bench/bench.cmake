add_executable(core_bench bench/core_bench.cpp bench/hall.cpp)
target_link_libraries(core_bench PRIVATE test_support core tessera_lto)
