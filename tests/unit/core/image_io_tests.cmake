set(IMAGE_IO_TEST_SOURCES
  image_io_test.cpp
  ktx2_test.cpp
  tone_map_test.cpp)
