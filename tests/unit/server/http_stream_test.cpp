#include <atomic>
#include <cstdint>

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/mutex.h"
#include "tests/unit/server/http_test_server.h"

namespace server {
namespace {

using http_test::Answer;
using http_test::Client;
using http_test::get;
using http_test::seconds_since;
using http_test::TestServer;
using std::chrono::milliseconds;

/// Waits like a stream without events, until the token requests a stop.
void wait_for_stop(const std::stop_token& token) {
  core::Mutex mutex;
  core::CondVar never;
  core::MutexLock lock(mutex);
  never.wait_for(mutex, token, std::chrono::seconds(20), [] { return false; });
}

Route silent_stream() {
  return {.method = "GET", .pattern = "/silent", .handler = [](Request&) {
            return stream_response("text/event-stream", [](StreamWriter& writer) {
              writer.write("hello\n");
              wait_for_stop(writer.stop_token());
              if (writer.stopping()) {
                writer.write("goodbye\n");
              }
            });
          }};
}

Route long_poll() {
  return {.method = "GET", .pattern = "/wait", .handler = [](Request& request) {
            wait_for_stop(request.stop_token());
            return text_response(200, "text/plain", "waited");
          }};
}

TEST(HttpStream, SendsChunksAndEnds) {
  TestServer server({{.method = "GET", .pattern = "/count", .handler = [](Request&) {
                        return stream_response("text/plain", [](StreamWriter& writer) {
                          for (int i = 0; i < 100; ++i) {
                            writer.write(std::to_string(i) + ",");
                          }
                        });
                      }}});
  Client client(server);
  const Answer answer = client.exchange(get("/count"));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body.substr(0, 8), "0,1,2,3,");
  EXPECT_EQ(answer.body.substr(answer.body.size() - 3), "99,");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST(HttpStream, LittleWaitsForAClientThatDoesNotRead) {
  std::atomic<std::int64_t> written = 0;
  HttpLimits limits = http_test::short_limits();
  limits.write_stall = std::chrono::seconds(30);
  TestServer server({{.method = "GET",
                      .pattern = "/endless",
                      .handler =
                          [&written](Request&) {
                            return stream_response("text/plain", [&written](StreamWriter& writer) {
                              const std::string piece(4096, 'x');
                              while (writer.write(piece)) {
                                written += 4096;
                              }
                            });
                          }}},
                    limits);
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(server.port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  const std::string request = get("/endless");
  ASSERT_EQ(::send(fd, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  std::int64_t before = -1;
  while (before != written || written == 0) {
    before = written;
    std::this_thread::sleep_for(milliseconds(300));
  }
  int arrived = 0;
  ASSERT_EQ(::ioctl(fd, FIONREAD, &arrived), 0);
  EXPECT_LT(written - arrived, static_cast<std::int64_t>(kUnsentBytes));  // by default 4 MB
  ::close(fd);
}

TEST(HttpStream, SilentStreamDetectsThatItsClientLeaves) {
  TestServer server({silent_stream()});
  Client client(server);
  client.send(get("/silent"));
  ASSERT_TRUE(client.wait_for("hello"));
  const auto start = std::chrono::steady_clock::now();
  client.close();
  const auto logged = server.next_outcome();
  ASSERT_TRUE(logged);
  EXPECT_TRUE(logged->outcome.client_gone);
  EXPECT_LT(seconds_since(start), 2.0);
  EXPECT_EQ(server.streams().open_count(), 0);
}

TEST(HttpStream, LongPollDetectsThatItsClientLeaves) {
  TestServer server({long_poll()});
  Client client(server);
  client.send(get("/wait"));
  std::this_thread::sleep_for(milliseconds(100));
  client.close();
  EXPECT_TRUE(server.next_outcome());
}

TEST(HttpStream, RefusesStreamsBeyondTheLimit) {
  TestServer server({silent_stream()}, http_test::short_limits(), /*stream_limit=*/1);
  Client first(server);
  first.send(get("/silent"));
  ASSERT_TRUE(first.wait_for("hello"));
  Client second(server);
  EXPECT_EQ(second.exchange(get("/silent")).status, 503);
  ASSERT_EQ(server.next_outcome().value().outcome.status, 503);
  first.close();
  ASSERT_EQ(server.next_outcome().value().outcome.status, 200);
  second.send(get("/silent"));
  EXPECT_TRUE(second.wait_for("hello"));
}

TEST(HttpStream, DropsAClientThatDoesNotRead) {
  TestServer server({{.method = "GET", .pattern = "/flood", .handler = [](Request&) {
                        return stream_response("text/plain", [](StreamWriter& writer) {
                          const std::string block(100'000, 'x');
                          while (writer.write(block)) {
                          }
                        });
                      }}});
  Client client(server);
  client.send(get("/flood"));
  const auto logged = server.next_outcome();
  ASSERT_TRUE(logged);
  EXPECT_TRUE(logged->outcome.client_gone);
}

TEST(HttpStream, ProducerThatThrowsTruncatesTheStream) {
  TestServer server({{.method = "GET", .pattern = "/broken", .handler = [](Request&) {
                        return stream_response("text/plain", [](StreamWriter& writer) {
                          writer.write("half");
                          throw std::runtime_error("why");
                        });
                      }}});
  Client client(server);
  client.send(get("/broken"));
  EXPECT_TRUE(client.wait_for("half"));
  EXPECT_FALSE(client.wait_for("0\r\n\r\n"));
  EXPECT_EQ(server.next_outcome().value().outcome.internal_error, "why");
}

TEST(HttpStream, EndsWithTheConnectionForHttp10) {
  TestServer server({{.method = "GET", .pattern = "/short", .handler = [](Request&) {
                        return stream_response("text/plain",
                                               [](StreamWriter& writer) { writer.write("all"); });
                      }}});
  Client client(server);
  const Answer answer = client.exchange("GET /short HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
  EXPECT_EQ(answer.header("Transfer-Encoding"), "");
  EXPECT_TRUE(client.wait_for("all"));
}

TEST(HttpStop, EndsStreamsCleanlyAndClosesIdleConnections) {
  TestServer server({silent_stream(), long_poll()});
  Client idle(server);
  EXPECT_EQ(idle.exchange(get("/echo/a")).status, 200);
  Client stream(server);
  stream.send(get("/silent"));
  ASSERT_TRUE(stream.wait_for("hello"));
  Client poll(server);
  poll.send(get("/wait"));
  std::this_thread::sleep_for(milliseconds(100));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(server.http().stop(std::chrono::seconds(5)));
  EXPECT_LT(seconds_since(start), 1.0);
  EXPECT_TRUE(stream.wait_for("goodbye"));
  const Answer waited = poll.receive();
  EXPECT_EQ(waited.body, "waited");
  EXPECT_EQ(waited.header("Connection"), "close");
  EXPECT_TRUE(idle.is_closed_within(milliseconds(100)));
}

TEST(HttpStop, EndsAStreamThatIgnoresTheStop) {
  TestServer server({{.method = "GET", .pattern = "/deaf", .handler = [](Request&) {
                        return stream_response("text/plain", [](StreamWriter& writer) {
                          while (writer.write("x")) {
                            std::this_thread::sleep_for(milliseconds(10));
                          }
                        });
                      }}});
  Client client(server);
  client.send(get("/deaf"));
  ASSERT_TRUE(client.wait_for("x"));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(server.http().stop(milliseconds(800)));
  EXPECT_LT(seconds_since(start), 0.9);
}

TEST(HttpStop, ReportsAHandlerThatDoesNotReturnInTime) {
  std::atomic<bool> is_released = false;
  TestServer server({{.method = "GET", .pattern = "/stuck", .handler = [&](Request&) {
                        while (!is_released) {
                          std::this_thread::sleep_for(milliseconds(5));
                        }
                        return empty_response();
                      }}});
  Client client(server);
  client.send(get("/stuck"));
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_FALSE(server.http().stop(milliseconds(200)));
  is_released = true;
  EXPECT_TRUE(server.http().stop(std::chrono::seconds(2)));
}

TEST(HttpStop, BeforeRunMakesRunReturn) {
  StreamGate streams(1);
  HttpOptions options;
  options.port = 0;
  HttpServer http(options, {}, streams);
  ASSERT_TRUE(http.bind());
  EXPECT_TRUE(http.stop(milliseconds(100)));
  http.run();
}

TEST(HttpStop, LosesNoThreadUnderLoad) {
  for (int round = 0; round < 5; ++round) {
    TestServer server({silent_stream()});
    std::atomic<bool> is_over = false;
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        Client client(server);
        while (!is_over && client.exchange(get("/echo/a")).status == 200) {
        }
      });
    }
    std::this_thread::sleep_for(milliseconds(50));
    EXPECT_TRUE(server.http().stop(std::chrono::seconds(2)));
    is_over = true;
    for (std::thread& thread : threads) {
      thread.join();
    }
  }
}

}  // namespace
}  // namespace server
