set(IMAGE_IO_TEST_SOURCES
  image_headers_test.cpp
  image_io_test.cpp
  ktx2_test.cpp
  tone_map_test.cpp)
set(IMAGE_IO_TEST_LIBRARIES PkgConfig::WEBP)
