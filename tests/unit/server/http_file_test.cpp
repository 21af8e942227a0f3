#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "server/http/file_response.h"
#include "tests/unit/server/http_test_server.h"

namespace server {
namespace {

using http_test::Answer;
using http_test::Client;
using http_test::get;
using http_test::TestServer;

/// "offset+size", "whole" or "416" for a representation of 100 bytes.
std::string range_of(std::string_view header) {
  const RangeRequest range = parse_range(header, 100);
  switch (range.kind) {
    case RangeRequest::Kind::kWhole:
      return "whole";
    case RangeRequest::Kind::kUnsatisfiable:
      return "416";
    case RangeRequest::Kind::kPart:
      break;
  }
  return std::to_string(range.offset) + "+" + std::to_string(range.size);
}

TEST(HttpRange, AcceptsFirstLastAndSuffix) {
  EXPECT_EQ(range_of("bytes=0-0"), "0+1");
  EXPECT_EQ(range_of("bytes=10-19"), "10+10");
  EXPECT_EQ(range_of("bytes=90-"), "90+10");
  EXPECT_EQ(range_of("bytes=-30"), "70+30");
}

TEST(HttpRange, IsClampedToTheEnd) {
  EXPECT_EQ(range_of("bytes=90-1000"), "90+10");
  EXPECT_EQ(range_of("bytes=-1000"), "0+100");
  EXPECT_EQ(range_of("bytes=0-18446744073709551615"), "0+100");
}

TEST(HttpRange, RefusesImpossibleRanges) {
  for (const char* text : {"bytes=100-", "bytes=100-200", "bytes=-0", "bytes=5-4", "bytes=",
                           "bytes=-", "bytes=a-b", "bytes=1-b", "bytes=18446744073709551616-"}) {
    EXPECT_EQ(range_of(text), "416") << text;
  }
}

TEST(HttpRange, EmptyFileHasNoRange) {
  EXPECT_EQ(parse_range("bytes=0-", 0).kind, RangeRequest::Kind::kUnsatisfiable);
}

TEST(HttpRange, SeveralRangesAndOtherUnitsGiveTheWholeFile) {
  EXPECT_EQ(range_of("bytes=0-1,5-6"), "whole");
  EXPECT_EQ(range_of("lines=1-2"), "whole");
}

class HttpFile : public testing::Test {
 protected:
  HttpFile() {
    directory_ = std::filesystem::path(testing::TempDir()) /
                 ("http_file_" + std::to_string(::getpid()) + "_" +
                  testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(directory_);
    for (int i = 0; i < 300'000; ++i) {
      content_ += static_cast<char>('a' + i % 26);
    }
    std::ofstream(directory_ / "file", std::ios::binary) << content_;
    std::filesystem::create_symlink(directory_ / "file", directory_ / "link");
  }
  ~HttpFile() override { std::filesystem::remove_all(directory_); }

  std::vector<Route> routes() {
    return {{.method = "GET", .pattern = "/files/{name}", .handler = [this](Request& request) {
               return file_response(request,
                                    {.path = directory_ / std::string(request.path_param("name")),
                                     .content_type = "model/gltf-binary",
                                     .etag = "\"abc\"",
                                     .cache_control = "immutable"});
             }}};
  }

  std::filesystem::path directory_;
  std::string content_;
};

TEST_F(HttpFile, SendsTheWholeAndItsParts) {
  TestServer server(routes());
  Client client(server);
  const Answer whole = client.exchange(get("/files/file"));
  EXPECT_EQ(whole.status, 200);
  EXPECT_EQ(whole.body, content_);
  EXPECT_EQ(whole.header("ETag"), "\"abc\"");
  const Answer part = client.exchange(get("/files/file", "Range: bytes=1000-1999\r\n"));
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, content_.substr(1000, 1000));
  EXPECT_EQ(part.header("Content-Range"), "bytes 1000-1999/300000");
}

TEST_F(HttpFile, AnswersConditionsAndHead) {
  TestServer server(routes());
  Client client(server);
  EXPECT_EQ(client.exchange(get("/files/file", "If-None-Match: \"abc\"\r\n")).status, 304);
  EXPECT_EQ(client.exchange(get("/files/file", "Range: bytes=0-1\r\nIf-Range: \"old\"\r\n")).status,
            200);
  client.send("HEAD /files/file HTTP/1.1\r\nHost: a\r\n\r\n");
  const Answer head = client.receive(/*head_only=*/true);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("Content-Length"), "300000");
  EXPECT_EQ(client.exchange(get("/echo/next")).body, "next");
}

TEST_F(HttpFile, RefusesARangeBeyondTheEnd) {
  TestServer server(routes());
  Client client(server);
  const Answer answer = client.exchange(get("/files/file", "Range: bytes=300000-\r\n"));
  EXPECT_EQ(answer.status, 416);
  EXPECT_EQ(answer.header("Content-Range"), "bytes */300000");
}

TEST_F(HttpFile, AThousandRangesGiveOneFile) {
  std::string ranges = "Range: bytes=0-1";
  for (int i = 0; i < 1000; ++i) {
    ranges += ",5-6";
  }
  TestServer server(routes());
  Client client(server);
  EXPECT_EQ(client.exchange(get("/files/file", ranges + "\r\n")).body.size(), content_.size());
}

TEST_F(HttpFile, DoesNotFollowLinksOrOpenFolders) {
  TestServer server(routes());
  Client client(server);
  EXPECT_EQ(client.exchange(get("/files/link")).status, 404);
  EXPECT_EQ(client.exchange(get("/files/.")).status, 404);
  EXPECT_EQ(client.exchange(get("/files/none")).status, 404);
}

/// The alphabet, letter by letter; "short" makes three letters fewer than declared.
std::vector<Route> alphabet() {
  return {{.method = "GET", .pattern = "/made/{name}", .handler = [](Request& request) {
             const int letters = request.path_param("name") == "short" ? 23 : 26;
             return made_response(request, {.bytes = 26,
                                            .make =
                                                [letters](const MadeSource::Sink& sink) {
                                                  for (int i = 0; i < letters; ++i) {
                                                    const char letter = static_cast<char>('a' + i);
                                                    if (!sink({&letter, 1})) {
                                                      return;
                                                    }
                                                  }
                                                },
                                            .content_type = "text/plain",
                                            .etag = "\"abc\"",
                                            .cache_control = "no-cache"});
           }}};
}

TEST(HttpMade, HasALengthAndParts) {
  TestServer server(alphabet());
  Client client(server);
  const Answer whole = client.exchange(get("/made/x"));
  EXPECT_EQ(whole.body, "abcdefghijklmnopqrstuvwxyz");
  EXPECT_EQ(whole.header("Content-Length"), "26");
  EXPECT_EQ(whole.header("Transfer-Encoding"), "");
  const Answer part = client.exchange(get("/made/x", "Range: bytes=3-5\r\n"));
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, "def");
  EXPECT_EQ(part.header("Content-Range"), "bytes 3-5/26");
  EXPECT_EQ(client.exchange(get("/made/x", "Range: bytes=-1\r\n")).body, "z");
  EXPECT_EQ(client.exchange(get("/made/x", "Range: bytes=26-\r\n")).status, 416);
  EXPECT_EQ(client.exchange(get("/made/x", "If-None-Match: \"abc\"\r\n")).status, 304);
  EXPECT_EQ(client.exchange(get("/made/x", "Range: bytes=0-1\r\nIf-Range: \"old\"\r\n")).status,
            200);
  std::string head = get("/made/x");
  client.send(head.replace(0, 3, "HEAD"));
  EXPECT_EQ(client.receive(true).header("Content-Length"), "26");
  EXPECT_EQ(client.exchange(get("/made/x")).status, 200);
}

TEST(HttpMade, TooShortContentEndsTheConnection) {
  TestServer server(alphabet());
  Client client(server);
  EXPECT_EQ(client.exchange(get("/made/short")).status, 0);
  EXPECT_FALSE(client.send(get("/made/x")) && client.receive().status == 200);
}

}  // namespace
}  // namespace server
