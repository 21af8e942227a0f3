#include "server/http/http_server.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/http/compress.h"
#include "server/http/problem.h"
#include "tests/unit/server/http_test_server.h"

namespace server {
namespace {

using http_test::Answer;
using http_test::Client;
using http_test::get;
using http_test::post;
using http_test::TestServer;

TEST(HttpServer, AnswersManyRequestsOnOneConnection) {
  TestServer server;
  Client client(server);
  for (int i = 0; i < 1000; ++i) {
    const std::string word = std::to_string(i);
    ASSERT_EQ(client.exchange(get("/echo/" + word)).body, word);
  }
  EXPECT_EQ(server.http().stats().connections_accepted, 1U);
}

TEST(HttpServer, AnswersPipelinedRequestsInOrder) {
  TestServer server;
  Client client(server);
  client.send(get("/echo/a") + post("/json", "{}") + get("/echo/b"));
  EXPECT_EQ(client.receive().body, "a");
  EXPECT_EQ(client.receive().body, "{}");
  EXPECT_EQ(client.receive().body, "b");
}

TEST(HttpServer, HeadHasTheLengthAndNoBody) {
  TestServer server;
  Client client(server);
  client.send("HEAD /echo/abc HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_EQ(client.receive(/*head_only=*/true).header("Content-Length"), "3");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST(HttpServer, WrongMethodIsAnsweredWithTheAllowedOnes) {
  TestServer server;
  Client client(server);
  const Answer answer = client.exchange("PUT /json HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_EQ(answer.status, 405);
  EXPECT_EQ(answer.header("Allow"), "POST, OPTIONS");
  EXPECT_EQ(client.exchange("BREW /json HTTP/1.1\r\nHost: a\r\n\r\n").status, 405);
  EXPECT_EQ(client.exchange("OPTIONS /json HTTP/1.1\r\nHost: a\r\n\r\n").status, 204);
  EXPECT_EQ(client.exchange("OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n").status, 204);
}

TEST(HttpServer, UnknownPathIsAProblemDocument) {
  TestServer server;
  Client client(server);
  const Answer answer = client.exchange(get("/a%22b"));
  EXPECT_EQ(answer.status, 404);
  EXPECT_EQ(answer.header("Content-Type"), "application/problem+json");
  EXPECT_EQ(answer.body, R"({"type":"/docs#problem-not-found","title":"Not found","status":404,)"
                         R"("detail":"there is nothing at this path","instance":"/a\"b"})");
}

TEST(HttpServer, TextOfAnExceptionGoesOnlyToTheLog) {
  TestServer server;
  Client client(server);
  const Answer answer = client.exchange(get("/throw"));
  EXPECT_EQ(answer.status, 500);
  EXPECT_EQ((answer.head + answer.body).find("secret"), std::string::npos);
  EXPECT_EQ(server.next_outcome().value().outcome.internal_error, "secret text");
  EXPECT_EQ(client.exchange(get("/echo/alive")).body, "alive");
}

TEST(HttpServer, EchoesAWellFormedRequestId) {
  TestServer server;
  Client client(server);
  EXPECT_EQ(client.exchange(get("/echo/a", "X-Request-Id: my-id.1\r\n")).header("X-Request-Id"),
            "my-id.1");
  const std::string made =
      client.exchange(get("/echo/a", "X-Request-Id: a b\r\n")).header("X-Request-Id");
  EXPECT_EQ(made.size(), 16U);
  EXPECT_NE(client.exchange(get("/echo/a")).header("X-Request-Id"), made);
}

TEST(HttpServer, BeforeHookAnswersInsteadOfTheRoute) {
  TestServer server;
  Client client(server);
  EXPECT_EQ(client.exchange(get("/echo/a", "X-Deny: 1\r\n")).status, 401);
  EXPECT_EQ(client.exchange(get("/none", "X-Deny: 1\r\n")).status, 401);
  EXPECT_EQ(server.next_outcome().value().route, "/echo/{word}");
}

TEST(HttpServer, ReadsChunkedBodies) {
  TestServer server;
  Client client(server);
  const std::string head = "POST /json HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n";
  EXPECT_EQ(client.exchange(head + "3;x=y\r\n[1,\r\n2\r\n2]\r\n0\r\nTrailer: x\r\n\r\n").body,
            "[1,2]");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST(HttpServer, AnswersExpectContinue) {
  TestServer server;
  Client client(server);
  client.send(
      "POST /json HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(client.receive(/*head_only=*/true).status, 100);
  client.send("{}");
  EXPECT_EQ(client.receive().body, "{}");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST(HttpServer, JsonRouteRequiresJson) {
  TestServer server;
  Client client(server);
  EXPECT_EQ(client.exchange(post("/json", "{}", "Content-Type: text/plain\r\n")).status, 415);
  EXPECT_EQ(client.exchange(post("/json", "{}", "Content-Type: Application/JSON; a=b\r\n")).status,
            200);
  EXPECT_EQ(
      client.exchange(post("/json", "{}", "Content-Type: application/merge-patch+json\r\n")).status,
      200);
}

TEST(HttpServer, SupportsHttp10) {
  TestServer server;
  Client client(server);
  const std::string request = "GET /echo/a HTTP/1.0\r\nConnection: keep-alive\r\n\r\n";
  EXPECT_EQ(client.exchange(request).header("Connection"), "keep-alive");
  EXPECT_EQ(client.exchange("GET /echo/b HTTP/1.0\r\n\r\n").header("Connection"), "close");
  EXPECT_TRUE(client.is_closed_within(std::chrono::milliseconds(500)));
}

TEST(HttpServer, CompressesCompressibleContent) {
  const std::string text(20'000, 'x');
  TestServer server({{.method = "GET", .pattern = "/text", .handler = [&](Request&) {
                        Response response = json_response(200, text);
                        response.headers.add("ETag", "\"v1\"");
                        return response;
                      }}});
  Client client(server);
  const Answer plain = client.exchange(get("/text"));
  EXPECT_EQ(plain.body, text);
  EXPECT_EQ(plain.header("Vary"), "Accept-Encoding");
  const Answer small = client.exchange(get("/text", "Accept-Encoding: br, gzip\r\n"));
  EXPECT_EQ(small.header("Content-Encoding"), "gzip");
  EXPECT_EQ(small.header("ETag"), "\"v1-gzip\"");
  EXPECT_EQ(small.body, gzip(text));
  EXPECT_LT(small.body.size(), text.size() / 10);
}

TEST(HttpServer, LineBreakInAValueCannotStartAHeader) {
  TestServer server({{.method = "GET", .pattern = "/split", .handler = [](Request&) {
                        Response response = empty_response();
                        response.headers.add("Location", "/a\r\nSet-Cookie: evil");
                        return response;
                      }}});
  Client client(server);
  EXPECT_EQ(client.exchange(get("/split")).header("Set-Cookie"), "");
}

TEST(HttpServer, SecondServerCannotBindThePort) {
  TestServer server;
  StreamGate streams(1);
  HttpOptions options;
  options.port = server.port();
  HttpServer second(options, {}, streams);
  const auto bound = second.bind();
  ASSERT_FALSE(bound);
  EXPECT_NE(bound.error().message.find("Address already in use"), std::string::npos)
      << bound.error().message;
}

TEST(HttpServer, ReportsAnUnknownHostAtBind) {
  StreamGate streams(1);
  HttpOptions options;
  options.host = "256.0.0.1";
  HttpServer http(options, {}, streams);
  EXPECT_FALSE(http.bind());
}

TEST(HttpProblem, EveryStatusOfTheTransportIsAProblemDocument) {
  for (const int status :
       {400, 404, 405, 408, 413, 414, 415, 416, 417, 429, 431, 500, 501, 503, 505}) {
    const Response response = problem_response(status, "a\xFF\"\n", "/x");
    const auto body = nlohmann::json::parse(std::get<std::string>(response.body));
    EXPECT_EQ(body["status"], status);
    EXPECT_EQ(body["detail"], "a\xEF\xBF\xBD\"\n");
    EXPECT_EQ(body["instance"], "/x");
    EXPECT_TRUE(body["type"].get<std::string>().starts_with("/docs#problem-")) << status;
    EXPECT_EQ(response.headers.contains("Retry-After"), status == 429 || status == 503) << status;
  }
}

}  // namespace
}  // namespace server
