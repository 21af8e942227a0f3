set(IMAGE_IO_TEST_SOURCES
  file_names_test.cpp
  image_headers_test.cpp
  image_io_test.cpp
  ktx2_test.cpp
  text_test.cpp
  tone_map_test.cpp
  zip_reader_test.cpp)
set(IMAGE_IO_TEST_LIBRARIES core_names PkgConfig::WEBP ZLIB::ZLIB)
