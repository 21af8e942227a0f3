#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "server/store/database.h"
#include "server/store/delivery_table.h"
#include "server/webhooks/webhook_sender.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::is_private_literal;
using server::is_public_address;
using server::parse_web_target;

// The example of the Standard Webhooks specification and of its reference libraries.
TEST(Webhook, SignatureMatchesTheSpecification) {
  const auto key = server::webhook_key("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
  ASSERT_TRUE(key);
  EXPECT_EQ(server::webhook_signature(*key, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330,
                                      R"({"test": 2432232314})"),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST(Webhook, SecretIsBase64OfAtLeast16Bytes) {
  EXPECT_EQ(server::webhook_key("whsec_MDEyMzQ1Njc4OWFiY2RlZg=="), "0123456789abcdef");
  for (const char* wrong :
       {"", "whsec_", "MDEyMzQ1Njc4OWFiY2RlZg==", "whsec_MDEyMzQ1Njc4OWFiY2RlZg",
        "whsec_MDEyMzQ1Njc4OWFiY2Rl", "whsec_MDEy?zQ1Njc4OWFiY2RlZg=="}) {
    EXPECT_FALSE(server::webhook_key(wrong)) << wrong;
  }
}

TEST(Webhook, RetriesWithIncreasingDelaysAndThenGivesUp) {
  double before = 0;
  for (int attempts = 1; attempts <= 7; ++attempts) {
    const auto wait = server::webhook_wait_seconds(attempts);
    ASSERT_TRUE(wait);
    EXPECT_GT(*wait, before);
    before = *wait;
  }
  EXPECT_FALSE(server::webhook_wait_seconds(8));
}

TEST(Webhook, WaitsOfAClockThatWasAheadAreBroughtForward) {
  const test_support::TemporaryFolder folder;
  auto database = server::Database::open(folder.file("tessera.db"));
  ASSERT_TRUE(database);
  server::DeliveryTable table(**database);
  constexpr double kNow = 1e9;
  for (const auto& [id, wait] : {std::pair("soon", 20.0), std::pair("ahead", 3600.0)}) {
    server::DeliveryRow row;
    row.id = id;
    row.url = row.receiver = std::string("http://") + id;
    row.created_at = kNow;
    row.next_at = kNow + wait;
    ASSERT_TRUE(table.insert(row));
    row = *table.find(id, server::Access::operators());
    row.attempts = 3;
    ASSERT_TRUE(table.update(row));
  }
  ASSERT_TRUE(table.due(kNow, 9)->empty());
  ASSERT_TRUE(table.bring_forward(3, kNow, *server::webhook_wait_seconds(3)));
  const auto due = table.due(kNow, 9);
  ASSERT_EQ(due->size(), 1U);
  EXPECT_EQ(due->front().id, "ahead");
}

TEST(WebTarget, IsParsedFromAUrl) {
  const auto plain = parse_web_target("http://example.org");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->host, "example.org");
  EXPECT_EQ(plain->port, 80);
  EXPECT_EQ(plain->path, "/");
  const auto full = parse_web_target("https://[2001:db8::1]:8443/a/b?c=d");
  ASSERT_TRUE(full);
  EXPECT_TRUE(full->is_tls);
  EXPECT_EQ(full->host, "2001:db8::1");
  EXPECT_EQ(full->port, 8443);
  EXPECT_EQ(full->path, "/a/b?c=d");
  EXPECT_EQ(parse_web_target("http://h?x=1")->path, "/?x=1");
  for (const char* wrong : {"", "example.org", "ftp://h/", "http://", "http:///x", "http://h:0/",
                            "http://h:65536/", "http://h:x/", "http://[::1/", "http://[::1]x/"}) {
    EXPECT_FALSE(parse_web_target(wrong)) << wrong;
  }
}

TEST(WebTarget, OnlyTheInternetIsPublic) {
  for (const char* address :
       {"8.8.8.8", "172.32.0.1", "100.128.0.1", "2606:4700::1111", "2a00::1"}) {
    EXPECT_TRUE(is_public_address(address)) << address;
  }
  for (const char* address : {"127.0.0.1",
                              "10.0.0.1",
                              "172.31.255.255",
                              "192.168.1.1",
                              "169.254.169.254",
                              "100.127.0.1",
                              "0.0.0.0",
                              "224.0.0.1",
                              "255.255.255.255",
                              "::",
                              "::1",
                              "fe80::1%eth0",
                              "fd12::1",
                              "ff02::1",
                              "::ffff:10.0.0.1",
                              "64:ff9b::a00:1",
                              "2002:a00:1::1",
                              "2001:db8::1",
                              "2001::1",
                              "name"}) {
    EXPECT_FALSE(is_public_address(address)) << address;
  }
  EXPECT_TRUE(is_private_literal("127.1"));
  EXPECT_TRUE(is_private_literal("0x7f.1"));
  EXPECT_FALSE(is_private_literal("example.org"));
}

}  // namespace
