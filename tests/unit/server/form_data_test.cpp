#include "server/http/form_data.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/http/text.h"

namespace {

using core::ErrorCode;

constexpr std::string_view kType = "multipart/form-data; boundary=\"a b\"";

std::string part(const std::string& head, const std::string& content) {
  return "--a b\r\n" + head + "\r\n\r\n" + content + "\r\n";
}

TEST(FormData, PartsAreSectionsOfTheBody) {
  const std::string content = "x\r\n--a\0 b\r\ny";
  const std::string body =
      "preamble\r\n" +
      part(
          "content-type: Model/GLTF-binary; v=1\r\n"
          "Content-Disposition: form-data; filename=\"a \\\"1\\\"; C:\\x.glb\"; name=scene",
          content) +
      part("Content-Disposition: form-data; name=\"size\"", "") + "--a b--\r\nepilogue";
  const auto parts = server::parse_form_data(body, kType, 2);
  ASSERT_TRUE(parts) << parts.error().message;
  ASSERT_EQ(parts->size(), 2U);
  EXPECT_EQ((*parts)[0].name, "scene");
  EXPECT_EQ((*parts)[0].filename, "a \"1\"; C:\\x.glb");
  EXPECT_EQ((*parts)[0].content_type, "model/gltf-binary");
  EXPECT_EQ((*parts)[0].content(body), content);
  EXPECT_EQ((*parts)[1].name, "size");
  EXPECT_FALSE((*parts)[1].filename);
  EXPECT_EQ((*parts)[1].content(body), "");
}

TEST(FormData, PartWithAFileNameOrAnotherTypeThanTextIsAFile) {
  const auto is_file = [](const std::string& head) {
    const std::string body = part("Content-Disposition: form-data; name=a" + head, "") + "--a b--";
    return server::parse_form_data(body, kType, 1)->front().is_file();
  };
  EXPECT_FALSE(is_file(""));
  EXPECT_FALSE(is_file("\r\nContent-Type: text/plain; charset=utf-8"));
  EXPECT_TRUE(is_file("\r\nContent-Type: application/zip"));
  EXPECT_TRUE(is_file("; filename=\"\""));
}

TEST(FormData, EveryCutIsRefused) {
  const std::string body = part("Content-Disposition: form-data; name=a", "content") + "--a b--";
  ASSERT_TRUE(server::parse_form_data(body, kType, 1));
  for (std::size_t size = 0; size < body.size(); ++size) {
    const auto parts = server::parse_form_data(body.substr(0, size), kType, 1);
    ASSERT_FALSE(parts) << size;
    EXPECT_EQ(parts.error().code, ErrorCode::kBadSyntax);
  }
}

TEST(FormData, MalformedPartsAreRefused) {
  const auto code = [](const std::string& body, std::string_view type) {
    const auto parts = server::parse_form_data(body, type, 1);
    EXPECT_FALSE(parts);
    return parts ? ErrorCode::kInternal : parts.error().code;
  };
  const std::string good = part("Content-Disposition: form-data; name=a", "") + "--a b--";
  EXPECT_EQ(code(good, "multipart/form-data"), ErrorCode::kBadSyntax);
  EXPECT_EQ(code(good, "multipart/form-data; boundary=\"a b"), ErrorCode::kBadSyntax);
  EXPECT_EQ(code(good, "multipart/form-data; boundary=" + std::string(71, 'a')),
            ErrorCode::kBadSyntax);
  for (const char* head : {"Content-Disposition: form-data", "Content-Disposition: file; name=a",
                           "Content-Type: text/plain", "no header",
                           "Content-Disposition: form-data; name=a\r\n"
                           "Content-Transfer-Encoding: base64"}) {
    EXPECT_EQ(code(part(head, "") + "--a b--", kType), ErrorCode::kBadSyntax) << head;
  }
  EXPECT_EQ(
      code(part("Content-Disposition: form-data; name=" + std::string(9000, 'a'), "") + "--a b--",
           kType),
      ErrorCode::kBadSyntax);
  const std::string one = part("Content-Disposition: form-data; name=a", "");
  EXPECT_EQ(code(one + one + "--a b--", kType), ErrorCode::kTooLarge);
}

TEST(QueryText, PercentSignAfterADigitAtTheEndOfAValueStandsForItself) {
  using Pairs = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(server::parse_query("error=3%"), (Pairs{{"error", "3%"}}));
  EXPECT_EQ(server::parse_query("error=3%&a=1"), (Pairs{{"error", "3%"}, {"a", "1"}}));
  EXPECT_EQ(server::parse_query("error=3%25"), (Pairs{{"error", "3%"}}));
  for (const char* broken : {"a=%", "a=x%", "a=3%4", "a=%2%", "3%=a", "a=3%%", "a=3%&b=%"}) {
    EXPECT_FALSE(server::parse_query(broken)) << broken;
  }
}

}  // namespace
