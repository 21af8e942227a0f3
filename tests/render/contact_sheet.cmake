# A program that renders all assets into one sheet: contact_sheet OUT.png [--assets DIR] [--samples
# N].
if(TARGET core_scene_io AND TARGET core_image_io)
  add_executable(contact_sheet render/contact_sheet.cpp)
  target_link_libraries(contact_sheet PRIVATE test_assets)
endif()
