add_executable(core_bench bench/core_bench.cpp bench/embree_share.cpp bench/hall.cpp)
target_link_libraries(core_bench PRIVATE test_support core tessera_lto)

# Seconds and bytes a triangle of large glTF files.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(load_bench bench/load_bench.cpp render/asset_files.cpp)
  target_link_libraries(load_bench PRIVATE test_support core_scene_io core_image_io core)

  # What each option of the estimators is worth; how light samplers scale.
  add_executable(options_bench bench/options_bench.cpp bench/named_view.cpp bench/bench_views.cpp
    render/asset_files.cpp)
  target_link_libraries(options_bench PRIVATE test_support core_scene_io core_image_io core tessera_lto)

  # Every integrator with equal time.
  add_executable(integrators_bench bench/integrators_bench.cpp)
  target_link_libraries(integrators_bench PRIVATE test_support core_scene_io core_image_io core tessera_lto)
endif()

# Over the built-in scenes: 1/(V T) of adaptive sampling.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(adaptive_bench bench/adaptive_bench.cpp bench/bench_views.cpp)
  target_link_libraries(adaptive_bench PRIVATE test_support core_scene_io core_image_io core tessera_lto)

  # Are error targets kept?
  add_executable(targets_bench bench/targets_bench.cpp bench/bench_views.cpp)
  target_link_libraries(targets_bench PRIVATE test_support core_scene_io core_image_io core tessera_lto)

  # Do intervals of single pixels hold the truth as often as they say?
  add_executable(coverage_bench bench/coverage_bench.cpp bench/bench_views.cpp)
  target_link_libraries(coverage_bench PRIVATE test_support core_scene_io core_image_io core tessera_lto)

  # What is denoising worth, and do its errors hold the truth?
  add_executable(denoise_bench bench/denoise_bench.cpp bench/bench_views.cpp render/asset_files.cpp)
  target_link_libraries(denoise_bench PRIVATE test_support core_scene_io core_image_io core tessera_lto)
endif()

# A render for callgrind.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(instructions_bench bench/instructions_bench.cpp bench/named_view.cpp
    bench/bench_views.cpp render/asset_files.cpp)
  target_link_libraries(instructions_bench PRIVATE test_support core_scene_io core_image_io core
    tessera_lto)
endif()

# Speed over threads: of this machine, and simulated.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(scaling_bench bench/scaling_bench.cpp bench/named_view.cpp bench/bench_views.cpp
    render/asset_files.cpp)
  target_link_libraries(scaling_bench PRIVATE test_support core_scene_io core_image_io core
    tessera_lto)
endif()

# Small requests, as many as the server answers.
add_executable(http_load bench/http_load.cpp)
