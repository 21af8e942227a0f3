set(NAMED_VIEW_SOURCES bench/named_view.cpp bench/caustic_views.cpp bench/bench_views.cpp)

add_executable(core_bench bench/core_bench.cpp bench/embree_share.cpp bench/hall.cpp)
target_link_libraries(core_bench PRIVATE test_support core tessera_lto)

# Seconds and bytes per triangle of large glTF files.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(load_bench bench/load_bench.cpp)
  target_link_libraries(load_bench PRIVATE test_assets)

  # Gain of each option of the estimators; scaling of light samplers.
  add_executable(options_bench bench/options_bench.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(options_bench PRIVATE test_assets tessera_lto)

  # Every integrator at equal time.
  add_executable(integrators_bench bench/integrators_bench.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(integrators_bench PRIVATE test_assets tessera_lto)
endif()

# 1/(V T) of adaptive sampling over the built-in scenes.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(adaptive_bench bench/adaptive_bench.cpp bench/bench_views.cpp)
  target_link_libraries(adaptive_bench PRIVATE test_assets tessera_lto)

  # Checks whether error targets are met.
  add_executable(targets_bench bench/targets_bench.cpp bench/asset_groups.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(targets_bench PRIVATE test_assets tessera_lto)

  # Checks the coverage of intervals of single pixels.
  add_executable(coverage_bench bench/coverage_bench.cpp bench/coverage_assets.cpp
    bench/asset_groups.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(coverage_bench PRIVATE test_assets tessera_lto)

  # Gain of denoising, and coverage of its error intervals.
  add_executable(denoise_bench bench/denoise_bench.cpp bench/asset_groups.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(denoise_bench PRIVATE test_assets tessera_lto)

  # Flicker of denoised frames, alone and in series.
  add_executable(flicker_bench bench/flicker_bench.cpp)
  target_link_libraries(flicker_bench PRIVATE test_assets tessera_lto)

  # Mixed images beside denoised and plain ones, and FLIP beside the error.
  add_executable(mixed_bench bench/mixed_bench.cpp bench/asset_groups.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(mixed_bench PRIVATE test_assets tessera_lto)
endif()

# Coverage of the meter's intervals.
add_executable(meter_bench bench/meter_bench.cpp)
target_link_libraries(meter_bench PRIVATE test_support core tessera_lto)

# One render for callgrind.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(instructions_bench bench/instructions_bench.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(instructions_bench PRIVATE test_assets tessera_lto)
endif()

# Speedup over threads: of this machine, and simulated.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(scaling_bench bench/scaling_bench.cpp ${NAMED_VIEW_SOURCES})
  target_link_libraries(scaling_bench PRIVATE test_assets tessera_lto)
endif()

# Memory of a film, a wave and scenes, by parts.
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(memory_bench bench/memory_bench.cpp bench/hall.cpp)
  target_link_libraries(memory_bench PRIVATE test_assets tessera_lto)
endif()

# Throughput of small requests.
add_executable(http_load bench/http_load.cpp)
