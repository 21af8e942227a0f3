set(CLI_TEST_SOURCES
  command_test.cpp
  files_test.cpp
  job_flags_test.cpp
  picture_test.cpp
  progress_test.cpp
  sse_test.cpp
  tev_test.cpp)
