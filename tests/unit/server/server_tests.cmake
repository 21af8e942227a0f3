# Store, checkpoints, scheduling, events, scenes: the server without HTTP.
set(SERVER_TEST_SOURCES
  blob_store_test.cpp
  comparison_store_test.cpp
  config_test.cpp
  database_mark_test.cpp
  event_log_test.cpp
  event_stream_test.cpp
  film_file_splats_test.cpp
  film_file_test.cpp
  full_disk_test.cpp
  guard_test.cpp
  job_book_test.cpp
  job_memory_test.cpp
  job_record_test.cpp
  job_service_test.cpp
  memory_test.cpp
  scene_service_test.cpp
  scheduler_test.cpp
  server_test_support.cpp
  single_flight_cache_test.cpp
  storage_quota_test.cpp
  store_test.cpp
  tile_stream_test.cpp
  turns_test.cpp
  webhook_test.cpp
  zip_test.cpp)
set(SERVER_TEST_LIBRARIES ZLIB::ZLIB)
