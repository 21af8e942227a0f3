#Helpers shared by the test programs.
set(SUPPORT_SOURCES bsdf_cases.cpp differing_pixels.cpp errors.cpp scenes.cpp statistics.cpp
  synthetic.cpp tasks.cpp zip_files.cpp)
set(SUPPORT_LIBRARIES ZLIB::ZLIB)

# Of programs that load assets.
if(TARGET core_scene_io AND TARGET core_image_io)
  tessera_resolve(asset_sources ${CMAKE_CURRENT_LIST_FILE} asset_files.cpp)
  add_library(test_assets STATIC ${asset_sources})
  target_link_libraries(test_assets PUBLIC test_support core_scene_io core_image_io core)
endif()

# A library that replaces Open Image Denoise, in the folder where the API tests also look for it,
# and its helper.
add_library(fake_oidn SHARED support/fake_oidn.cpp)
set_target_properties(fake_oidn PROPERTIES
  OUTPUT_NAME OpenImageDenoise SUFFIX .so.2
  LIBRARY_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/fake_oidn/lib)
add_executable(oidn_helper support/oidn_helper.cpp)
target_link_libraries(oidn_helper PRIVATE tessera_flags core)
add_library(fake_oidn_paths INTERFACE)
target_compile_definitions(fake_oidn_paths INTERFACE
  TESSERA_FAKE_OIDN="${CMAKE_CURRENT_BINARY_DIR}/fake_oidn/lib"
  TESSERA_OIDN_HELPER="$<TARGET_FILE:oidn_helper>")
add_dependencies(fake_oidn_paths fake_oidn oidn_helper)
