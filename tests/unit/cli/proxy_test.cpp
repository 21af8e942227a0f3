#include "clients/cli/proxy.h"

#include <map>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace {

std::optional<cli::ProxyAddress> proxy(const std::map<std::string, std::string>& variables,
                                       const std::string& host = "render.example.org",
                                       const std::string& scheme = "http") {
  const auto found = cli::proxy_for(scheme, host, 8080, [&](const char* name) {
    const auto at = variables.find(name);
    return at == variables.end() ? std::string() : at->second;
  });
  EXPECT_TRUE(found);
  return found ? *found : std::nullopt;
}

TEST(Proxy, FollowsTheScheme) {
  const std::map<std::string, std::string> both = {{"HTTP_PROXY", "http://a:1"},
                                                   {"HTTPS_PROXY", "http://b:2/"}};
  EXPECT_EQ(proxy(both)->host, "a");
  EXPECT_EQ(proxy(both, "x.org", "https")->port, 2);
  EXPECT_EQ(proxy({{"http_proxy", "c:3"}, {"HTTP_PROXY", "http://a:1"}})->host, "c");
  EXPECT_EQ(proxy({{"HTTP_PROXY", "http://a"}})->port, 80);
  EXPECT_FALSE(proxy({{"HTTPS_PROXY", "http://b:2"}}));
  const auto with_password = proxy({{"HTTP_PROXY", "http://me:secret@a:1"}});
  EXPECT_EQ(with_password->user + " " + with_password->password, "me secret");
}

TEST(Proxy, OfAllSchemesIsTheLastResort) {
  const auto all = proxy({{"ALL_PROXY", "http://a:1"}}, "x.org", "https");
  ASSERT_TRUE(all);
  EXPECT_EQ(all->variable + " " + all->host, "ALL_PROXY a");
  EXPECT_EQ(proxy({{"all_proxy", "http://a:1"}, {"HTTP_PROXY", "http://b:1"}})->host, "b");
  EXPECT_FALSE(proxy({{"ALL_PROXY", "http://a:1"}, {"NO_PROXY", "*"}}));
}

TEST(Proxy, IsNotForExemptHostsAndThisMachine) {
  for (const char* list : {"*", "example.org", ".example.org", "x, render.example.org",
                           "*.example.org", "RENDER.example.org:8080"}) {
    EXPECT_FALSE(proxy({{"HTTP_PROXY", "http://a:1"}, {"NO_PROXY", list}})) << list;
  }
  for (const char* list : {"", "ample.org", "example.com", "render.example.org:80"}) {
    EXPECT_TRUE(proxy({{"HTTP_PROXY", "http://a:1"}, {"no_proxy", list}})) << list;
  }
  for (const char* host : {"localhost", "127.0.0.1", "[::1]"}) {
    EXPECT_FALSE(proxy({{"HTTP_PROXY", "http://a:1"}}, host)) << host;
  }
}

TEST(Proxy, RefusesOtherAddressesWithoutTheirPassword) {
  for (const char* url : {"socks5://a:1", "http://me:secret@a:x", "http://:1", "http://a:70000",
                          "garbage:", "not an address", "http://a b:1"}) {
    const auto found = cli::proxy_for("http", "h", 80, [&](const char* name) {
      return std::string(name) == "HTTP_PROXY" ? std::string(url) : std::string();
    });
    ASSERT_FALSE(found) << url;
    EXPECT_EQ(found.error().message.find("secret"), std::string::npos);
    EXPECT_TRUE(found.error().message.starts_with("HTTP_PROXY "));
  }
}

}  // namespace
