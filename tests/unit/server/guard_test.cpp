#include "server/auth/guard.h"

#include <memory>
#include <tuple>

#include <gtest/gtest.h>

#include "api/header_rows.h"
#include "server/store/database.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::Config;
using server::Request;
using std::chrono::seconds;

/// A guard with its own store.
class Guard {
 public:
  explicit Guard(const Config& config)
      : config_(config),
        database_(*server::Database::open(folder_.file("test.db"))),
        keys_(*database_),
        ring_(config_, keys_),
        sessions_(*server::SessionStore::open(*database_)),
        guard_(config_, ring_, tickets_, *sessions_) {}

  std::optional<server::Response> check(Request& request) const { return guard_.check(request); }
  server::Response start_session(const Request& request) const {
    return guard_.start_session(request);
  }
  server::Response end_session(const Request& request) const { return guard_.end_session(request); }
  server::Response decorated(const Request& request, server::Response response) const {
    guard_.decorate(request, response);
    return response;
  }
  server::KeyTable& keys() { return keys_; }
  server::LiveConfig& config() { return config_; }

 private:
  server::LiveConfig config_;
  test_support::TemporaryFolder folder_;
  std::unique_ptr<server::Database> database_;
  server::KeyTable keys_;
  server::KeyRing ring_;
  server::Tickets tickets_;
  std::unique_ptr<server::SessionStore> sessions_;
  mutable server::Guard guard_;
};

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

TEST(Guard, AKeyIsRequiredWhileTheStoredOnesCannotBeRead) {
  const test_support::TemporaryFolder folder;
  const auto database = *server::Database::open(folder.file("test.db"));
  server::KeyTable keys(*database);
  const server::LiveConfig config{Config{}};
  ASSERT_TRUE(database->session().execute("ALTER TABLE keys RENAME TO hidden"));
  EXPECT_TRUE(server::KeyRing(config, keys).is_needed());
  ASSERT_TRUE(database->session().execute("ALTER TABLE hidden RENAME TO keys"));
  EXPECT_FALSE(server::KeyRing(config, keys).is_needed());  // There is none.
}

TEST(Guard, AcceptsLoopbackAndConfiguredHosts) {
  Config config;
  config.hosts = {"render.example"};
  const Guard guard(config);
  for (const char* host : {"localhost", "127.0.0.1:99", "[::1]:8080", "render.example:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 0) << host;
  }
  for (const char* host :
       {"evil.example", "", "localhost.evil.example", "127.0.0.1.nip.example:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 421) << host;
  }
}

TEST(Guard, WorkerKeyGivesAccessToWorkOnly) {
  Config config;
  config.key = "operator";
  config.worker_key = "of-workers";
  const Guard guard(config);
  for (const auto& [method, route, status] :
       {std::tuple("PUT", "/v1/workers/{id}", 0), std::tuple("GET", "/v1/workers", 403),
        std::tuple("GET", "/v1/jobs", 403), std::tuple("POST", "/v1/jobs", 403),
        std::tuple("GET", "/v1/keys", 403)}) {
    Request asked = request(method, route);
    asked.headers.set("Authorization", "Bearer of-workers");
    EXPECT_EQ(status_of(guard, asked), status) << route;
  }
}

TEST(Guard, MarksRequestsOfWorkers) {
  Config config;
  for (const char* key : {"", "secret"}) {
    config.key = key;
    const Guard guard(config);
    for (const auto& [method, route, is_of_worker] :
         {std::tuple("PUT", "/v1/workers/{id}", true), std::tuple("GET", "/v1/workers", false)}) {
      Request asked = request(method, route);
      asked.headers.set("Authorization", std::string("Bearer ") + key);
      EXPECT_FALSE(guard.check(asked)) << route;
      EXPECT_EQ(asked.is_of_worker, is_of_worker) << route;
    }
  }
}

TEST(Guard, HostNamesAreCaseInsensitive) {
  Config config;
  config.hosts = {"Render.Example"};
  const Guard guard(config);
  for (const char* host : {"render.example:8080", "RENDER.EXAMPLE", "LocalHost:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 0) << host;
  }
  auto asked = request("POST", "/v1/jobs", "Render.example");
  asked.headers.set("Origin", "https://render.example");
  EXPECT_EQ(status_of(guard, asked), 0);
}

TEST(Guard, MetricsRequireTheirKeyIfConfigured) {
  Config config;
  config.metrics_key = "figures";
  const Guard guard(config);
  auto asked = request("GET", "/metrics", "10.1.2.3");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer wrong");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer figures");
  EXPECT_EQ(status_of(guard, asked), 0);
  EXPECT_EQ(status_of(guard, request("GET", "/livez", "10.1.2.3")), 0);
}

TEST(Guard, ProbesAcceptAnyHostWithoutAKey) {
  Config config;
  config.key = "k";
  EXPECT_EQ(status_of(Guard(config), request("GET", "/livez", "10.1.2.3")), 0);
}

TEST(Guard, RefusesPagesOfOtherOriginsUnlessConfigured) {
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

TEST(Guard, SameOriginIgnoresDefaultPortsAndBelievesTrustedProxies) {
  const Guard guard({});
  const auto status = [&guard](const char* host, const char* forwarded, const char* origin) {
    Request asked = request("POST", "/v1/jobs", host);
    asked.forwarded_host = forwarded;
    asked.headers.set("Origin", origin);
    return status_of(guard, asked);
  };
  EXPECT_EQ(status("localhost:443", "", "https://localhost"), 0);
  EXPECT_EQ(status("localhost", "", "http://LOCALHOST:80"), 0);
  EXPECT_EQ(status("127.0.0.1", "127.0.0.1:8123", "http://127.0.0.1:8123"), 0);
  EXPECT_EQ(status("127.0.0.1", "", "http://127.0.0.1:8123"), 403);
  EXPECT_EQ(status("localhost:443", "", "http://localhost"), 403);
  // A name that is not ours, as after DNS rebinding.
  EXPECT_EQ(status("127.0.0.1", "evil.example", "http://evil.example"), 403);
}

TEST(Guard, RefusedOriginNamesTheRemedy) {
  const Guard guard({});
  Request asked = request("POST", "/v1/jobs");
  asked.headers.set("Origin", "https://shop.example");
  const auto refused = guard.check(asked);
  ASSERT_TRUE(refused);
  const std::string& body = *std::get_if<std::string>(&refused->body);
  EXPECT_NE(body.find("--origins"), std::string::npos) << body;
  EXPECT_EQ(body.find("access key"), std::string::npos) << body;
}

TEST(Guard, PagesOfNamedOriginsMaySendAndReadAllDocumentedHeaders) {
  Config config;
  config.origins = {"https://studio.example"};
  const Guard guard(config);
  auto asked = request("OPTIONS", "/v1/jobs");
  asked.headers.set("Origin", "https://studio.example");
  const auto answer = guard.decorated(asked, {});
  const auto lists = [&answer](const char* field, std::string_view name) {
    return std::string(answer.headers.find(field).value_or("")).find(name) != std::string::npos;
  };
  for (const api::HeaderRow& row : api::response_headers()) {
    EXPECT_TRUE(lists("Access-Control-Expose-Headers", row.name)) << row.name;
  }
  for (const char* name : {"traceparent", "Range", "Idempotency-Key", "Authorization"}) {
    EXPECT_TRUE(lists("Access-Control-Allow-Headers", name)) << name;
  }
  EXPECT_TRUE(answer.headers.find("Access-Control-Max-Age"));
}

TEST(Guard, CachesKeepAnswersToOtherOriginsApart) {
  Config config;
  config.origins = {"https://studio.example"};
  EXPECT_EQ(Guard(config).decorated(request("GET", "/v1/assets/{id}"), {}).headers.find("Vary"),
            "Origin");
  EXPECT_FALSE(Guard({}).decorated(request("GET", "/v1/assets/{id}"), {}).headers.find("Vary"));
}

TEST(Guard, LocationsAndCookiesAreBelowThePathOfTheProxy) {
  Config config;
  config.key = "secret";
  config.base_path = "/render";
  const Guard guard(config);
  const auto location_for = [&guard](const Request& asked) {
    server::Response response;
    response.headers.set("Location", "/v1/jobs/1");
    return std::string(
        guard.decorated(asked, std::move(response)).headers.find("Location").value_or(""));
  };
  Request asked = request("POST", "/v1/session");
  asked.headers.set("Authorization", "Bearer secret");
  EXPECT_EQ(location_for(asked), "/render/v1/jobs/1");
  EXPECT_NE(guard.start_session(asked).headers.find("Set-Cookie")->find("; Path=/render/;"),
            std::string_view::npos);
  asked.base_path = "/other";
  EXPECT_EQ(location_for(asked), "/other/v1/jobs/1");
}

TEST(Guard, AcceptsTheKeyAsBearerTokenOrCookie) {
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

/// Exchanges the key for a session; returns the Cookie header of later requests.
std::string session_cookie(const Guard& guard, const std::string& key, bool is_https = false) {
  auto asked = request("POST", "/v1/session");
  asked.is_https = is_https;
  asked.headers.set("Authorization", "Bearer " + key);
  return std::string(guard.start_session(asked).headers.find("Set-Cookie").value_or(""));
}

int status_with_cookie(const Guard& guard, const std::string& cookie) {
  auto asked = request("GET", "/v1/jobs");
  asked.headers.set("Cookie", cookie.substr(0, cookie.find(';')));
  return status_of(guard, asked);
}

TEST(Session, ServersOnSeveralPortsOfAHostHaveACookieEach) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  auto asked = request("POST", "/v1/session", "localhost:8081");
  asked.headers.set("Authorization", "Bearer secret");
  const std::string other(guard.start_session(asked).headers.find("Set-Cookie").value_or(""));
  const std::string whole = session_cookie(guard, "secret");
  const std::string own = whole.substr(0, whole.find(';'));
  EXPECT_NE(other.substr(0, other.find('=')), own.substr(0, own.find('=')));
  // That of another server is unknown here.
  auto asked_again = request("GET", "/v1/jobs");
  asked_again.headers.set("Cookie", "tessera_session_8081=unknown; " + own);
  EXPECT_EQ(status_of(guard, asked_again), 0);
  EXPECT_EQ(status_with_cookie(guard, "tessera_session_8081=unknown"), 401);
}

TEST(Session, IsRandomAndEndsOnlyByLogout) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  const std::string first = session_cookie(guard, "secret");
  const std::string second = session_cookie(guard, "secret");
  EXPECT_NE(first, second);
  EXPECT_NE(first.find("; Max-Age=604800;"), std::string::npos);
  auto asked = request("DELETE", "/v1/session");
  asked.headers.set("Cookie", first.substr(0, first.find(';')));
  const auto ended = guard.end_session(asked);
  EXPECT_EQ(ended.status, 204);
  EXPECT_NE(ended.headers.find("Set-Cookie")->find("Max-Age=0"), std::string_view::npos);
  EXPECT_EQ(status_with_cookie(guard, first), 401);
  EXPECT_EQ(status_with_cookie(guard, second), 0);
}

TEST(Session, IsSecureForClientsWithTls) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  EXPECT_EQ(session_cookie(guard, "secret", false).find("Secure"), std::string::npos);
  EXPECT_NE(session_cookie(guard, "secret", true).find("; Secure"), std::string::npos);
}

TEST(Session, EndsWithItsKey) {
  Config config;
  config.key = "secret";
  Guard guard(config);
  const std::string cookie = session_cookie(guard, "secret");
  EXPECT_EQ(status_with_cookie(guard, cookie), 0);
  config.key = "another";
  guard.config().set(config);
  EXPECT_EQ(status_with_cookie(guard, cookie), 401);
}

TEST(Session, OutlivesTheProcessAndEndsAtItsTime) {
  const test_support::TemporaryFolder folder;
  const auto database = *server::Database::open(folder.file("test.db"));
  const double now = 1000;
  const double life = std::chrono::duration<double>(server::SessionStore::kLife).count();
  const std::string cookie = *server::SessionStore::open(*database).value()->begin("hash", now);
  const auto store = *server::SessionStore::open(*database);
  EXPECT_EQ(store->token_hash_of(cookie, now + life - 1), "hash");
  EXPECT_FALSE(store->token_hash_of(cookie, now + life));
  EXPECT_FALSE(store->token_hash_of("hash", now));
  EXPECT_FALSE(store->token_hash_of("", now));
}

TEST(Guard, AnswersHaveSecurityHeaders) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  auto asked = request("GET", "/v1/jobs", "render.example");
  auto answer = guard.decorated(asked, server::empty_response());
  EXPECT_EQ(answer.headers.find("Referrer-Policy"), "no-referrer");
  EXPECT_EQ(answer.headers.find("X-Content-Type-Options"), "nosniff");
  EXPECT_NE(answer.headers.find("Content-Security-Policy")->find("frame-ancestors 'none'"),
            std::string_view::npos);
  EXPECT_FALSE(answer.headers.contains("Strict-Transport-Security"));
  asked.is_https = true;
  EXPECT_TRUE(guard.decorated(asked, server::empty_response())
                  .headers.contains("Strict-Transport-Security"));
  asked.headers.set("Host", "localhost:8443");
  EXPECT_FALSE(guard.decorated(asked, server::empty_response())
                   .headers.contains("Strict-Transport-Security"));
}

TEST(Guard, AnswersToAKeyAreNotStoredInSharedCaches) {
  const auto caching = [](const std::string& key, const std::string& path) {
    Config config;
    config.key = key;
    auto answer = server::empty_response();
    answer.headers.set("Cache-Control", "public, max-age=31536000, immutable");
    const Guard guard(config);
    answer = guard.decorated(request("GET", path), std::move(answer));
    return std::string(*answer.headers.find("Cache-Control"));
  };
  EXPECT_EQ(caching("secret", "/v1/assets/abc"), "private, max-age=31536000, immutable");
  EXPECT_EQ(caching("secret", "/assets/page.js"), "public, max-age=31536000, immutable");
  EXPECT_EQ(caching("", "/v1/assets/abc"), "public, max-age=31536000, immutable");
}

TEST(Guard, PageAndDescriptionRequireNoKey) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  for (const char* path : {"/", "/docs", "/openapi.json"}) {
    EXPECT_EQ(status_of(guard, request("GET", path)), 0) << path;
  }
  EXPECT_EQ(status_of(guard, request("GET", "/v1/server")), 401);
  EXPECT_EQ(status_of(guard, request("POST", "/v1/jobs")), 401);
}

TEST(Guard, IdentifiesAStoredKeyByItsHashAndScopes) {
  Config config;
  Guard guard(config);
  server::MadeKey made = server::make_key("studio");
  made.row.may_write = false;
  ASSERT_TRUE(guard.keys().insert(made.row));
  EXPECT_EQ(made.row.token_hash.find(made.token), std::string::npos);
  auto asked = request("GET", "/v1/jobs");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_FALSE(guard.check(asked));
  EXPECT_EQ(asked.principal, made.row.id);
  auto submits = request("POST", "/v1/jobs");
  submits.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_EQ(status_of(guard, submits), 403);
  for (const std::string& wrong : {made.row.token_hash, made.row.session_hash, made.row.id}) {
    asked.headers.set("Authorization", "Bearer " + wrong);
    EXPECT_EQ(status_of(guard, asked), 401);
  }
}

TEST(Guard, RefusesAnExpiredKey) {
  Guard guard{Config()};
  server::MadeKey made = server::make_key("old");
  made.row.expires_at = 1000;
  ASSERT_TRUE(guard.keys().insert(made.row));
  auto asked = request("GET", "/v1/jobs");
  asked.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_EQ(status_of(guard, asked), 401);
}

TEST(RateLimiter, RefillsContinuouslyUpToOneMinute) {
  server::RateLimiter rates;
  const auto now = server::RateLimiter::Clock::now();
  for (int i = 0; i < 60; ++i) {
    const auto state = rates.take("k", 60, now);
    EXPECT_TRUE(state.allowed);
    EXPECT_EQ(state.remaining, 59 - i);
  }
  const auto refused = rates.take("k", 60, now);
  EXPECT_FALSE(refused.allowed);
  EXPECT_EQ(refused.reset_seconds, 1);
  EXPECT_TRUE(rates.take("other", 60, now).allowed);
  EXPECT_TRUE(rates.take("k", 60, now + seconds(1)).allowed);
  EXPECT_FALSE(rates.take("k", 60, now + seconds(1)).allowed);
  EXPECT_EQ(rates.take("k", 60, now + seconds(3600)).remaining, 59);
  EXPECT_FALSE(rates.last("nobody"));
}

TEST(Guard, AccessOfARequestFollowsFromItsKey) {
  const auto access_of = [](const Guard& guard, const std::string& token) {
    auto asked = request("GET", "/v1/jobs");
    asked.headers.set("Authorization", "Bearer " + token);
    EXPECT_FALSE(guard.check(asked));
    return asked.access;
  };
  using Scope = server::Access::Scope;
  Config config;
  config.key = "operators-own";
  server::MadeKey own = server::make_key("own");
  server::MadeKey named = server::make_key("named");
  named.row.tenant = "studio";
  named.row.may_admin = true;
  named.row.priority_max = 7;
  for (const bool is_shared : {false, true}) {
    config.shared = is_shared;
    Guard guard(config);
    ASSERT_TRUE(guard.keys().insert(own.row) && guard.keys().insert(named.row));
    const server::Access mine = access_of(guard, own.token);
    EXPECT_EQ(mine.tenant, own.row.id);
    EXPECT_EQ(mine.scope, is_shared ? Scope::kShared : Scope::kOwn);
    EXPECT_EQ(mine.priority_max, 0);
    const server::Access admins = access_of(guard, named.token);
    EXPECT_EQ(admins.tenant, "studio");
    EXPECT_EQ(admins.scope, is_shared ? Scope::kShared : Scope::kAll);
    EXPECT_EQ(admins.priority_max, 7);
    const server::Access operators = access_of(guard, "operators-own");
    EXPECT_EQ(operators.tenant, "");
    EXPECT_EQ(operators.scope, is_shared ? Scope::kShared : Scope::kAll);
    EXPECT_EQ(operators.priority_max, 100);
  }
  // Without keys every client may access everything.
  auto asked = request("GET", "/v1/jobs");
  EXPECT_FALSE(Guard(Config{}).check(asked));
  EXPECT_EQ(asked.access.scope, Scope::kShared);
}

TEST(Guard, OnlyTheScopeAdminManagesKeys) {
  Config config;
  Guard guard(config);
  server::MadeKey made = server::make_key("studio");
  ASSERT_TRUE(guard.keys().insert(made.row));
  auto asked = request("GET", "/v1/keys");
  asked.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_EQ(status_of(guard, asked), 403);
}

}  // namespace
