#include "server/guard.h"

#include <algorithm>
#include <utility>

#include <openssl/crypto.h>

#include "api/operations.h"
#include "core/base/sha256.h"
#include "server/routes/answers.h"

namespace server {
namespace {

constexpr std::string_view kCookieName = "tessera_session";

bool same_secret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string_view without_port(std::string_view host) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(0, end + 1);
  }
  const std::size_t colon = host.rfind(':');
  return colon == std::string_view::npos ? host : host.substr(0, colon);
}

bool is_probe(std::string_view path) { return path == "/livez" || path == "/readyz" || path == "/metrics"; }

/// Does the row of the API ask for a key? What is no row (page files, unknown paths) does not, but
/// everything below /v1 does.
bool needs_key(const Request& request) {
  const std::string_view method = request.method == "HEAD" ? "GET" : std::string_view(request.method);
  for (const api::Operation& operation : api::operations()) {
    if (operation.method == method && operation.path == request.route) {
      return !operation.scope.empty();
    }
  }
  return request.path.rfind("/v1/", 0) == 0 && request.path != "/v1/session";
}

std::string_view cookie_value(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view pair = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (!pair.empty() && pair.front() == ' ') {
      pair.remove_prefix(1);
    }
    if (pair.size() > name.size() && pair.substr(0, name.size()) == name && pair[name.size()] == '=') {
      return pair.substr(name.size() + 1);
    }
  }
  return {};
}

}  // namespace

Guard::Guard(const Config& config) : config_(config) {
  const std::string salted = "tessera session " + config.key;
  cookie_ = core::sha256_hex(salted.data(), salted.size());
}

bool Guard::is_known_host(std::string_view host) const {
  const std::string_view name = without_port(host);
  return is_loopback(name) ||
         std::any_of(config_.hosts.begin(), config_.hosts.end(),
                     [&](const std::string& known) { return known == name || known == host; });
}

bool Guard::is_named_origin(std::string_view origin) const {
  return std::find(config_.origins.begin(), config_.origins.end(), origin) != config_.origins.end();
}

bool Guard::is_key(std::string_view text) const { return same_secret(text, config_.key); }

bool Guard::has_key(const Request& request) const {
  if (const auto given = request.header("Authorization")) {
    constexpr std::string_view kBearer = "Bearer ";
    return given->size() > kBearer.size() && given->substr(0, kBearer.size()) == kBearer &&
           is_key(given->substr(kBearer.size()));
  }
  const auto cookies = request.header("Cookie");
  return cookies && same_secret(cookie_value(*cookies, kCookieName), cookie_);
}

std::optional<Response> Guard::check(Request& request) const {
  if (is_probe(request.path)) {
    return std::nullopt;
  }
  const std::string_view host = request.header("Host").value_or("");
  if (!is_known_host(host)) {
    return error_answer(request, core::ErrorCode::kMisdirected,
                        "this server is not known as '" + std::string(without_port(host)) +
                            "'; name it with --hosts or TESSERA_HOSTS");
  }
  if (const auto origin = request.header("Origin")) {
    const bool same = *origin == "http://" + std::string(host) || *origin == "https://" + std::string(host);
    if (!same && !is_named_origin(*origin)) {
      return error_answer(request, core::ErrorCode::kForbidden,
                          "pages of the origin '" + std::string(*origin) + "' may not call this server");
    }
  }
  if (config_.key.empty() || request.method == "OPTIONS" || !needs_key(request) || has_key(request)) {
    return std::nullopt;
  }
  Response response = error_answer(request, core::ErrorCode::kUnauthorized,
                                   "bring the key as 'Authorization: Bearer KEY'");
  response.headers.set("WWW-Authenticate", "Bearer realm=\"tessera\"");
  return response;
}

void Guard::decorate(const Request& request, Response& response) const {
  response.headers.set("X-Content-Type-Options", "nosniff");
  const auto origin = request.header("Origin");
  if (!origin || !is_named_origin(*origin)) {
    return;
  }
  response.headers.set("Access-Control-Allow-Origin", *origin);
  response.headers.set("Vary", "Origin");
  response.headers.set("Access-Control-Allow-Credentials", "true");
  response.headers.set("Access-Control-Expose-Headers", "ETag, Link, Location, X-Request-Id");
  if (request.method == "OPTIONS") {
    response.headers.set("Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, PATCH, DELETE");
    response.headers.set("Access-Control-Allow-Headers",
                         "Authorization, Content-Type, Idempotency-Key, If-Match, If-None-Match, "
                         "Last-Event-ID, Prefer, X-Request-Id");
  }
}

Response Guard::start_session(const Request& request) const {
  if (!config_.key.empty() && !has_key(request)) {
    return error_answer(request, core::ErrorCode::kUnauthorized,
                        "bring the key as 'Authorization: Bearer KEY'");
  }
  Response response = empty_response();
  if (!config_.key.empty()) {
    response.headers.set("Set-Cookie", std::string(kCookieName) + "=" + cookie_ +
                                           "; Path=/; HttpOnly; SameSite=Strict");
  }
  return response;
}

}  // namespace server
