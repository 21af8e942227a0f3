set(RENDER_TEST_SOURCES
  agreement_test.cpp
  choose_integrator_test.cpp
  control_variate_test.cpp
  fitted_test.cpp
  furnace_test.cpp
  ground_test.cpp
  irradiance_test.cpp
  media_test.cpp
  meter_test.cpp
  mlt_test.cpp
  options_test.cpp
  photons_test.cpp
  planted_bugs_test.cpp
  restir_test.cpp
  spectral_test.cpp
  truth.cpp)
# Features of glTF: scenes made in code, through a GLB and the loader, rendered small.
list(APPEND RENDER_TEST_SOURCES
  asset_files.cpp
  assets_test.cpp
  gltf_stage.cpp
  gltf_geometry_test.cpp
  gltf_glass_test.cpp
  gltf_lights_test.cpp
  gltf_materials_test.cpp
  gltf_terminator_test.cpp
  gltf_textures_test.cpp)
