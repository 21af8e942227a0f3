#include "server/guard.h"

#include <gtest/gtest.h>

namespace {

using server::Config;
using server::Guard;
using server::Request;

Request request(std::string method, std::string route, std::string host = "localhost:8080") {
  Request made;
  made.method = std::move(method);
  made.route = route;
  made.path = std::move(route);
  made.headers.set("Host", host);
  return made;
}

int status_of(const Guard& guard, Request asked) {
  const auto answer = guard.check(asked);
  return answer ? answer->status : 0;
}

TEST(Guard, AnswersToLoopbackNamesAndTheNamedHosts) {
  Config config;
  config.hosts = {"render.example"};
  const Guard guard(config);
  for (const char* host : {"localhost", "127.0.0.1:99", "[::1]:8080", "render.example:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 0) << host;
  }
  for (const char* host : {"evil.example", "", "localhost.evil.example", "127.0.0.1.nip.example:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 421) << host;
  }
}

TEST(Guard, ProbesAnswerToAnyHostWithoutAKey) {
  Config config;
  config.key = "k";
  EXPECT_EQ(status_of(Guard(config), request("GET", "/livez", "10.1.2.3")), 0);
}

TEST(Guard, PagesOfOtherOriginsAreRefusedUnlessNamed) {
  Config config;
  config.origins = {"https://studio.example"};
  const Guard guard(config);
  auto asked = request("POST", "/v1/jobs");
  asked.headers.set("Origin", "http://localhost:8080");
  EXPECT_EQ(status_of(guard, asked), 0);
  asked.headers.set("Origin", "https://studio.example");
  EXPECT_EQ(status_of(guard, asked), 0);
  for (const char* origin : {"https://evil.example", "null", "http://localhost:9999"}) {
    asked.headers.set("Origin", origin);
    EXPECT_EQ(status_of(guard, asked), 403) << origin;
  }
}

TEST(Guard, TheKeyComesAsBearerTokenOrCookie) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  auto asked = request("GET", "/v1/jobs");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer wrong");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer secret");
  EXPECT_EQ(status_of(guard, asked), 0);

  const auto session = guard.start_session(asked);
  const auto cookie = session.headers.find("Set-Cookie");
  ASSERT_TRUE(cookie);
  EXPECT_NE(cookie->find("HttpOnly"), std::string_view::npos);
  EXPECT_NE(cookie->find("SameSite=Strict"), std::string_view::npos);
  EXPECT_EQ(cookie->find("secret"), std::string_view::npos);
  auto by_cookie = request("GET", "/v1/jobs");
  by_cookie.headers.set("Cookie", "a=b; " + std::string(cookie->substr(0, cookie->find(';'))));
  EXPECT_EQ(status_of(guard, by_cookie), 0);
}

TEST(Guard, ThePageAndTheDescriptionNeedNoKey) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  for (const char* path : {"/", "/docs", "/openapi.json"}) {
    EXPECT_EQ(status_of(guard, request("GET", path)), 0) << path;
  }
  EXPECT_EQ(status_of(guard, request("GET", "/v1/server")), 401);
  EXPECT_EQ(status_of(guard, request("POST", "/v1/jobs")), 401);
}

}  // namespace
