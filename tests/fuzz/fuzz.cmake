# Fuzz targets. With TESSERA_FUZZ (clang) they are libFuzzer programs; else a small driver of our own feeds
# them mutations of their seeds, so that every compiler and every test run has a short form of it.
function(tessera_fuzz name)
  add_executable(${name} fuzz/${name}.cpp)
  target_link_libraries(${name} PRIVATE tessera_flags ${ARGN})
  if(TESSERA_FUZZ)
    target_compile_options(${name} PRIVATE -fsanitize=fuzzer)
    target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  else()
    target_sources(${name} PRIVATE fuzz/fuzz_driver.cpp)
  endif()
endfunction()

if(TARGET api)
  tessera_fuzz(job_fuzz api)
endif()
if(TARGET core_scene_io)
  tessera_fuzz(gltf_fuzz core_scene_io core)
endif()
