set(HTTP_TEST_SOURCES
  form_data_test.cpp
  http_bad_input_test.cpp
  http_conditional_test.cpp
  http_file_test.cpp
  http_flood_test.cpp
  http_negotiation_test.cpp
  http_request_head_test.cpp
  http_router_test.cpp
  http_server_test.cpp
  http_sse_test.cpp
  http_stream_test.cpp
  http_test_server.cpp
  http_web_calls_test.cpp)
set(HTTP_TEST_LIBRARIES server_http)
