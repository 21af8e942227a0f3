#include <gtest/gtest.h>

#include "server/http/router.h"

namespace server {
namespace {

Route route(std::string method, std::string pattern) {
  return {.method = std::move(method), .pattern = std::move(pattern), .handler = [](Request&) {
            return empty_response();
          }};
}

Router make_router() {
  return Router({route("GET", "/"), route("GET", "/v1/jobs"), route("POST", "/v1/jobs"),
                 route("GET", "/v1/jobs/{id}"), route("DELETE", "/v1/jobs/{id}"),
                 route("GET", "/v1/jobs/{id}/image{.format}"),
                 route("GET", "/v1/jobs/{id}/pixels/{x}/{y}"), route("POST", "/v1/jobs/merge"),
                 route("GET", "/static/{file...}")});
}

std::string pattern_of(std::string_view method, std::string_view path) {
  const Router router = make_router();
  const Router::Match match = router.match(method, path);
  return match.route != nullptr ? match.route->pattern : "";
}

std::string param_of(std::string_view path, std::string_view name) {
  const Router router = make_router();
  for (const auto& [key, value] : router.match("GET", path).params) {
    if (key == name) {
      return value;
    }
  }
  return "(none)";
}

TEST(HttpRouter, MatchesLiteralsAndParameters) {
  EXPECT_EQ(pattern_of("GET", "/"), "/");
  EXPECT_EQ(pattern_of("POST", "/v1/jobs"), "/v1/jobs");
  EXPECT_EQ(pattern_of("GET", "/v1/jobs/7"), "/v1/jobs/{id}");
  EXPECT_EQ(param_of("/v1/jobs/7/pixels/3/4", "y"), "4");
}

TEST(HttpRouter, TrailingOrDoubledSlashIsAnotherPath) {
  EXPECT_EQ(pattern_of("GET", "/v1/jobs/"), "");
  EXPECT_EQ(pattern_of("GET", "/v1//jobs"), "");
  EXPECT_EQ(pattern_of("GET", "/v1/jobs//image"), "");
}

TEST(HttpRouter, HeadIsAnsweredByGet) {
  EXPECT_EQ(pattern_of("HEAD", "/v1/jobs/7"), "/v1/jobs/{id}");
}

TEST(HttpRouter, TheExtensionIsOptional) {
  EXPECT_EQ(param_of("/v1/jobs/7/image", "format"), "");
  EXPECT_EQ(param_of("/v1/jobs/7/image.png", "format"), "png");
  EXPECT_EQ(pattern_of("GET", "/v1/jobs/7/image."), "");
  EXPECT_EQ(pattern_of("GET", "/v1/jobs/7/imagepng"), "");
  EXPECT_EQ(pattern_of("GET", "/v1/jobs/7/image.p/g"), "");
}

TEST(HttpRouter, LiteralTakesPrecedenceOverAParameter) {
  EXPECT_EQ(pattern_of("POST", "/v1/jobs/merge"), "/v1/jobs/merge");
}

TEST(HttpRouter, EncodedSlashIsNotASeparator) {
  EXPECT_EQ(param_of("/v1/jobs/a%2Fb", "id"), "a/b");
}

TEST(HttpRouter, RestIncludesSlashes) {
  EXPECT_EQ(param_of("/static/js/app.js", "file"), "js/app.js");
}

TEST(HttpRouter, ListsTheMethodsOfAPath) {
  const Router router = make_router();
  EXPECT_EQ(router.match("PUT", "/v1/jobs/7").allow, "GET, HEAD, DELETE, OPTIONS");
  EXPECT_EQ(router.match("OPTIONS", "/v1/jobs").allow, "GET, HEAD, POST, OPTIONS");
  EXPECT_EQ(router.match("GET", "/v2").allow, "");
}

TEST(HttpRouterDeath, RefusesTwoRoutesForTheSameRequests) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(Router({route("GET", "/a/{x}"), route("GET", "/a/{y}")}), "CHECK failed");
}

}  // namespace
}  // namespace server
