#include <gtest/gtest.h>

#include "server/http/request_head.h"

namespace server {
namespace {

struct Parsed {
  Request request;
  Framing framing;
  int status = 0;  ///< 0: accepted.
};

Parsed parse(std::string_view head) {
  Parsed result;
  const ParsedHead parsed = parse_head(head, {}, result.request);
  result.framing = parsed.framing;
  result.status = parsed.refusal ? parsed.refusal->status : 0;
  return result;
}

int status_with(std::string_view header) {
  return parse("POST / HTTP/1.1\r\nHost: a\r\n" + std::string(header) + "\r\n\r\n").status;
}

int status_of_target(std::string_view target) {
  return parse("GET " + std::string(target) + " HTTP/1.1\r\nHost: a\r\n\r\n").status;
}

TEST(HttpRequestHead, ReadsTargetQueryAndHeaders) {
  const Parsed parsed =
      parse("GET /a%20b?x=1&y=%26+z&x=2&flag HTTP/1.1\r\nHost: a:80\r\nX-Some:  v \t\r\n\r\n");
  ASSERT_EQ(parsed.status, 0);
  EXPECT_EQ(parsed.request.path, "/a b");
  EXPECT_EQ(parsed.request.query("x"), "1");
  EXPECT_EQ(parsed.request.query("y"), "& z");
  EXPECT_EQ(parsed.request.query("flag"), "");
  EXPECT_FALSE(parsed.request.query("none"));
  EXPECT_EQ(parsed.request.header("x-SOME"), "v");
}

TEST(HttpRequestHead, AbsoluteTargetOverridesHost) {
  const Parsed parsed = parse("GET http://b:1/p?q=1 HTTP/1.1\r\nHost: a\r\n\r\n");
  ASSERT_EQ(parsed.status, 0);
  EXPECT_EQ(parsed.request.path, "/p");
  EXPECT_EQ(parsed.request.header("Host"), "b:1");
}

TEST(HttpRequestHead, DeterminesHowTheBodyIsDelimited) {
  EXPECT_EQ(parse("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\n").framing.length, 5U);
  EXPECT_EQ(parse("POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: Chunked\r\n\r\n").framing.body,
            Framing::Body::kChunked);
  EXPECT_EQ(parse("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n\r\n").framing.body,
            Framing::Body::kNone);
}

TEST(HttpRequestHead, DeterminesWhetherTheConnectionIsKeptAlive) {
  EXPECT_TRUE(parse("GET / HTTP/1.1\r\nHost: a\r\n\r\n").framing.wants_keep_alive);
  EXPECT_FALSE(
      parse("GET / HTTP/1.1\r\nHost: a\r\nConnection: x, Close\r\n\r\n").framing.wants_keep_alive);
  EXPECT_FALSE(parse("GET / HTTP/1.0\r\n\r\n").framing.wants_keep_alive);
  EXPECT_TRUE(parse("GET / HTTP/1.0\r\nConnection: Keep-Alive\r\n\r\n").framing.wants_keep_alive);
}

TEST(HttpRequestHead, RefusesAnAmbiguousLength) {
  EXPECT_EQ(status_with("Content-Length: abc"), 400);
  EXPECT_EQ(status_with("Content-Length: -1"), 400);
  EXPECT_EQ(status_with("Content-Length: +1"), 400);
  EXPECT_EQ(status_with("Content-Length: 1,1"), 400);
  EXPECT_EQ(status_with("Content-Length:"), 400);
  EXPECT_EQ(status_with("Content-Length: 18446744073709551616"), 400);
  EXPECT_EQ(status_with("Content-Length: 1\r\nContent-Length: 1"), 400);
  EXPECT_EQ(status_with("Content-Length: 1\r\nTransfer-Encoding: chunked"), 400);
  EXPECT_EQ(status_with("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked"), 400);
  EXPECT_EQ(status_with("Transfer-Encoding: gzip, chunked"), 501);
  EXPECT_EQ(status_with("Transfer-Encoding: xchunked"), 501);
}

TEST(HttpRequestHead, RefusesMalformedFields) {
  EXPECT_EQ(status_with("Name : v"), 400);
  EXPECT_EQ(status_with("Name"), 400);
  EXPECT_EQ(status_with(": v"), 400);
  EXPECT_EQ(status_with("A: b\r\n folded"), 400);
  EXPECT_EQ(status_with("A: b\x01"), 400);
  EXPECT_EQ(status_with("A: b\rc"), 400);
  EXPECT_EQ(status_with(std::string_view("A: b\0c", 6)), 400);
  EXPECT_EQ(status_with("Host: b"), 400);
}

TEST(HttpRequestHead, RequiresExactlyOneValidHost) {
  EXPECT_EQ(parse("GET / HTTP/1.1\r\n\r\n").status, 400);
  EXPECT_EQ(parse("GET / HTTP/1.1\r\nHost: a/b\r\n\r\n").status, 400);
  EXPECT_EQ(parse("GET / HTTP/1.1\r\nHost: u@a\r\n\r\n").status, 400);
  EXPECT_EQ(parse("GET / HTTP/1.1\r\nHost: [::1]:8080\r\n\r\n").status, 0);
}

TEST(HttpRequestHead, RefusesOtherProtocols) {
  EXPECT_EQ(parse("GET / HTTP/2.0\r\nHost: a\r\n\r\n").status, 505);
  EXPECT_EQ(parse("GET / HTTQ/1.1\r\nHost: a\r\n\r\n").status, 400);
  EXPECT_EQ(parse("GET /\r\nHost: a\r\n\r\n").status, 400);
  EXPECT_EQ(parse("G@T / HTTP/1.1\r\nHost: a\r\n\r\n").status, 400);
}

TEST(HttpRequestHead, RefusesBrokenTargets) {
  EXPECT_EQ(status_of_target("/a b"), 400);
  EXPECT_EQ(status_of_target("/a#b"), 400);
  EXPECT_EQ(status_of_target("a"), 400);
  EXPECT_EQ(status_of_target("*"), 400);
  EXPECT_EQ(status_of_target("/%"), 400);
  EXPECT_EQ(status_of_target("/%4"), 400);
  EXPECT_EQ(status_of_target("/%zz"), 400);
  EXPECT_EQ(status_of_target("/%00"), 400);
  EXPECT_EQ(status_of_target("/?a=%f"), 400);
  EXPECT_EQ(status_of_target("/\xC3\xA4"), 400);
  EXPECT_EQ(status_of_target("/" + std::string(9000, 'a')), 414);
}

TEST(HttpRequestHead, RefusesCompressedBodiesAndUnknownExpectations) {
  EXPECT_EQ(status_with("Content-Encoding: gzip"), 415);
  EXPECT_EQ(status_with("Content-Encoding: identity"), 0);
  EXPECT_EQ(status_with("Expect: tea"), 417);
}

TEST(HttpHeadScanner, FindsTheEndForAnyChunks) {
  const std::string head = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  const std::string bytes = head + "GET /next";
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    HeadScanner scanner({});
    std::size_t found = scanner.scan(std::string_view(bytes).substr(0, cut)).head_bytes;
    EXPECT_EQ(found, cut < head.size() ? 0 : head.size());
    if (found == 0) {
      found = scanner.scan(bytes).head_bytes;
      EXPECT_EQ(found, head.size());
    }
  }
}

TEST(HttpHeadScanner, RefusesABareLineFeed) {
  HeadScanner scanner({});
  EXPECT_EQ(scanner.scan("GET / HTTP/1.1\nHost: a\n\n").refusal.value().status, 400);
}

}  // namespace
}  // namespace server
