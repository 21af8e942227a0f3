#include <new>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/unit/server/http_test_server.h"

namespace server {
namespace {

using http_test::Answer;
using http_test::Client;
using http_test::get;
using http_test::post;
using http_test::seconds_since;
using http_test::TestServer;
using std::chrono::milliseconds;

/// The answer to a second request that is hidden behind the first one.
constexpr std::string_view kHidden = "GET /echo/hidden HTTP/1.1\r\nHost: a\r\n\r\n";

/// Returns the status of the answer; -1 if the hidden request was served or the connection stayed
/// open.
int status_without_desync(std::string_view bytes) {
  TestServer server;
  Client client(server);
  client.send(bytes);
  client.send(kHidden);
  const Answer answer = client.receive();
  if (answer.header("Connection") != "close" || !client.is_closed_within(milliseconds(2500))) {
    return -1;
  }
  return answer.status;
}

TEST(HttpSmuggling, TwoLengthsCloseTheConnection) {
  EXPECT_EQ(status_without_desync("POST /json HTTP/1.1\r\nHost: a\r\nContent-Length: 4\r\n"
                                  "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"),
            400);
  EXPECT_EQ(status_without_desync("POST /json HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n"
                                  "Content-Length: 44\r\n\r\n"),
            400);
}

TEST(HttpSmuggling, GarbageLengthClosesTheConnection) {
  EXPECT_EQ(status_without_desync("POST /json HTTP/1.1\r\nHost: a\r\nContent-Length: abc\r\n\r\n"),
            400);
}

TEST(HttpSmuggling, FoldedLineClosesTheConnection) {
  EXPECT_EQ(status_without_desync("POST /json HTTP/1.1\r\nHost: a\r\nX: y\r\n"
                                  " Transfer-Encoding: chunked\r\n\r\n"),
            400);
}

TEST(HttpSmuggling, BareLineFeedClosesTheConnection) {
  EXPECT_EQ(status_without_desync("GET /echo/a HTTP/1.1\nHost: a\n\n"), 400);
}

TEST(HttpSmuggling, MalformedChunksCloseTheConnection) {
  const std::string head = "POST /json HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (const char* chunks : {"x\r\n", "-1\r\n", "0x2\r\n{}\r\n", "2\n{}\n0\n\n", "2\r\n{}x\r\n",
                             "2 2\r\n{}\r\n", "1000000000000000\r\n", "\r\n"}) {
    EXPECT_EQ(status_without_desync(head + chunks), 400) << chunks;
  }
}

TEST(HttpSmuggling, EarlyAnswerToALargeBodyClosesTheConnection) {
  // The declared body is larger than the server would skip, and starts like a request.
  EXPECT_EQ(status_without_desync("POST /refuse HTTP/1.1\r\nHost: a\r\nX-Deny: 1\r\n"
                                  "Content-Length: 1000000\r\n\r\n"),
            401);
  EXPECT_EQ(status_without_desync("POST /refuse HTTP/1.1\r\nHost: a\r\n"
                                  "Transfer-Encoding: chunked\r\n\r\n"),
            403);
}

TEST(HttpSmuggling, SkipsABodyThatArrivesAfterTheAnswer) {
  TestServer server;
  Client client(server);
  const std::string body(kHidden);
  for (const char* target : {"/refuse", "/ignore", "/none"}) {
    client.send("POST " + std::string(target) + " HTTP/1.1\r\nHost: a\r\nContent-Length: " +
                std::to_string(body.size()) + "\r\n\r\n");
    EXPECT_NE(client.receive().status, 0);
    client.send(body);
    EXPECT_EQ(client.exchange(get("/echo/next")).body, "next") << target;
  }
  client.send("GET /echo/a HTTP/1.1\r\nHost: a\r\nContent-Length: " + std::to_string(body.size()) +
              "\r\n\r\n" + body);
  EXPECT_EQ(client.receive().body, "a");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST(HttpSmuggling, UnansweredExpectationClosesTheConnection) {
  TestServer server;
  Client client(server);
  const Answer answer = client.exchange(
      "POST /refuse HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(answer.status, 403);
  EXPECT_EQ(answer.header("Connection"), "close");
}

/// Returns the status of a request whose handler throws while it reads the body; the connection
/// must then be closed.
template <typename Exception>
int status_after(const Exception& thrown) {
  TestServer server({{.method = "POST",
                      .pattern = "/break",
                      .handler = [&thrown](Request& request) -> Response {
                        request.body_reader->read(
                            [&thrown](std::string_view) -> bool { throw thrown; });
                        return empty_response();
                      },
                      .body = BodyPolicy::stream(1U << 30U)}});
  Client client(server);
  client.send("POST /break HTTP/1.1\r\nHost: a\r\nContent-Length: 1000000\r\n\r\n");
  client.send(kHidden);
  const int status = client.receive().status;
  EXPECT_TRUE(client.is_closed_within(milliseconds(2500)));
  return status;
}

TEST(HttpSmuggling, HandlerThatThrowsDuringABodyClosesTheConnection) {
  EXPECT_EQ(status_after(std::runtime_error("broken")), 500);
  EXPECT_EQ(status_after(std::bad_alloc()), 503);
}

TEST(HttpLimitsTest, SlowHeadersGive408) {
  TestServer server;
  Client client(server);
  const auto start = std::chrono::steady_clock::now();
  const std::string request = get("/echo/a");
  // One byte every 50 ms: each read is in time, the whole request is not.
  for (std::size_t i = 0; i < request.size() && seconds_since(start) < 0.5; ++i) {
    client.send(request.substr(i, 1));
    std::this_thread::sleep_for(milliseconds(50));
  }
  EXPECT_EQ(client.receive().status, 408);
  EXPECT_LT(seconds_since(start), 1.5);
}

TEST(HttpLimitsTest, ClosesASilentConnection) {
  TestServer server;
  Client client(server);
  EXPECT_TRUE(client.is_closed_within(milliseconds(1000)));
}

TEST(HttpLimitsTest, FloodOfHeadersGives431) {
  TestServer server;
  Client lines(server);
  lines.send("GET / HTTP/1.1\r\nHost: a\r\n");
  for (int i = 0; i < 1000 && lines.send("A: b\r\n"); ++i) {
  }
  EXPECT_EQ(lines.receive().status, 431);
  Client bytes(server);
  bytes.send("GET / HTTP/1.1\r\nHost: a\r\nA: ");
  const std::string block(10'000, 'x');
  for (int i = 0; i < 1000 && bytes.send(block); ++i) {
  }
  EXPECT_EQ(bytes.receive().status, 431);
}

TEST(HttpLimitsTest, LongTargetGives414) {
  TestServer server;
  Client client(server);
  client.send("GET /" + std::string(20'000, 'x'));
  EXPECT_EQ(client.receive().status, 414);
}

TEST(HttpLimitsTest, RefusesTlsOnAPlainPortAtOnce) {
  TestServer server;
  Client client(server);
  client.send(std::string_view("\x16\x03\x01\x02\x00\x01\x00", 7));
  EXPECT_EQ(client.receive().status, 400);
}

TEST(HttpLimitsTest, DoesNotReadADeclaredBodyOverTheLimit) {
  TestServer server;
  Client json(server);
  EXPECT_EQ(json.exchange("POST /json HTTP/1.1\r\nHost: a\r\nContent-Length: 1001\r\n\r\n").status,
            413);
  Client upload(server);
  EXPECT_EQ(
      upload.exchange("POST /upload HTTP/1.1\r\nHost: a\r\nContent-Length: 100001\r\n\r\n").status,
      413);
}

TEST(HttpLimitsTest, CountsAChunkedBodyAgainstTheLimit) {
  TestServer server;
  Client client(server);
  client.send("POST /upload HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "2710\r\n" + std::string(10'000, 'x') + "\r\n";
  for (int i = 0; i < 1000 && client.send(chunk); ++i) {
  }
  EXPECT_EQ(client.receive().status, 413);
  EXPECT_EQ(server.next_outcome().value().outcome.bytes_received, 100'000U);
}

TEST(HttpLimitsTest, AcceptsABodyUpToTheLimit) {
  TestServer server;
  Client client(server);
  EXPECT_EQ(client.exchange(post("/upload", std::string(100'000, 'x'))).body, "100000");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST(HttpLimitsTest, BodyThatStopsGives408) {
  TestServer server;
  Client client(server);
  client.send("POST /upload HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\nabc");
  EXPECT_EQ(client.receive().status, 408);
}

TEST(HttpLimitsTest, SlowBodyGives408) {
  TestServer server;
  Client client(server);
  client.send("POST /upload HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n");
  const auto start = std::chrono::steady_clock::now();
  while (seconds_since(start) < 0.6 && client.send("x")) {
    std::this_thread::sleep_for(milliseconds(50));
  }
  EXPECT_EQ(client.receive().status, 408);
}

TEST(HttpLimitsTest, TruncatedBodyNeverReachesTheRouteAsComplete) {
  TestServer server;
  Client client(server);
  client.send("POST /json HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n{}");
  client.close();
  EXPECT_EQ(server.next_outcome().value().outcome.status, 400);
}

TEST(HttpLimitsTest, DropsAClientThatDoesNotRead) {
  TestServer server({{.method = "GET", .pattern = "/big", .handler = [](Request&) {
                        return text_response(200, "text/plain", std::string(50'000'000, 'x'));
                      }}});
  Client client(server);
  client.send(get("/big"));
  const auto logged = server.next_outcome();
  ASSERT_TRUE(logged);
  EXPECT_TRUE(logged->outcome.client_gone);
}

}  // namespace
}  // namespace server
