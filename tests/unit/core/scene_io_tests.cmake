find_package(meshoptimizer REQUIRED CONFIG)

set(SCENE_IO_TEST_SOURCES
  builtin_scenes_test.cpp
  gltf_assets_test.cpp
  gltf_bad_input_test.cpp
  gltf_basisu_test.cpp
  gltf_cases_test.cpp
  gltf_compression_test.cpp
  gltf_container_test.cpp
  gltf_deform_test.cpp
  gltf_environment_test.cpp
  gltf_geometry_test.cpp
  gltf_ior_test.cpp
  gltf_material_test.cpp
  gltf_mutation_test.cpp
  gltf_motion_test.cpp
  gltf_objects_test.cpp
  gltf_pointer_test.cpp
  gltf_repairs_test.cpp
  gltf_tangent_test.cpp
  gltf_visibility_test.cpp
  ies_test.cpp
  settle_test.cpp
  split_gltf_test.cpp)
set(SCENE_IO_TEST_LIBRARIES test_assets core_image_io meshoptimizer::meshoptimizer ${DRACO_LIBRARY})
