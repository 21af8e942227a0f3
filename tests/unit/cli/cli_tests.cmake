set(CLI_TEST_SOURCES
  command_test.cpp
  files_test.cpp
  job_flags_test.cpp
  picture_test.cpp
  progress_test.cpp
  proxy_test.cpp
  shown_test.cpp
  sse_test.cpp
  tev_test.cpp)
set(CLI_TEST_LIBRARIES api)
