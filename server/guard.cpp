#include "server/guard.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "api/operations.h"
#include "server/http/text.h"
#include "server/routes/answers.h"

namespace server {
namespace {

constexpr std::string_view kCookieName = "tessera_session";

std::string_view without_port(std::string_view host) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(0, end + 1);
  }
  const std::size_t colon = host.rfind(':');
  return colon == std::string_view::npos ? host : host.substr(0, colon);
}

bool is_probe(std::string_view path) { return path == "/livez" || path == "/readyz" || path == "/metrics"; }

/// What a key needs for the row of the API: "read", "write", or "" for nothing. What is no row (page
/// files, unknown paths) needs nothing, but everything below /v1 does.
std::string_view needed_scope(const Request& request) {
  const std::string_view method = request.method == "HEAD" ? "GET" : std::string_view(request.method);
  for (const api::Operation& operation : api::operations()) {
    if (operation.method == method && operation.path == request.route) {
      return operation.scope;
    }
  }
  return request.path.rfind("/v1/", 0) == 0 && request.path != "/v1/session" ? "read" : "";
}

/// The jobs that a request would watch, if it is one that a ticket can stand for; else none.
std::vector<std::string> watched_jobs(const Request& request) {
  constexpr std::array<std::string_view, 3> kOfOneJob = {
      "/v1/jobs/{id}/events", "/v1/jobs/{id}/tiles", "/v1/jobs/{id}/image{.format}"};
  if (request.method != "GET" && request.method != "HEAD") {
    return {};
  }
  if (std::find(kOfOneJob.begin(), kOfOneJob.end(), request.route) != kOfOneJob.end()) {
    return {std::string(request.path_param("id"))};
  }
  std::vector<std::string> jobs;
  if (request.route == "/v1/events") {
    const std::string list = request.query("jobs").value_or("");
    for (const std::string_view job : split_list(list)) {
      jobs.emplace_back(job);
    }
  }
  return jobs;
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

/// RFC 6750, 3: an error is named only to who brought something.
enum class Brought : std::uint8_t { kNothing, kUnknown };

Response unauthorized(const Request& request, Brought brought, std::string detail) {
  Response response =
      error_answer(request, core::ErrorCode::kUnauthorized, std::move(detail));
  response.headers.set("WWW-Authenticate", brought == Brought::kNothing
                                               ? "Bearer realm=\"tessera\""
                                               : "Bearer realm=\"tessera\", error=\"invalid_token\"");
  return response;
}

/// For a request whose holder is not known.
Response unknown_holder(const Request& request) {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view given = request.header("Authorization").value_or("");
  if (given.size() > kScheme.size() && equal_ignoring_case(given.substr(0, kScheme.size()), kScheme)) {
    return unauthorized(request, Brought::kUnknown, "this key is not known, or has expired");
  }
  const std::string_view cookies = request.header("Cookie").value_or("");
  if (given.empty() && !cookie_value(cookies, kCookieName).empty()) {
    return unauthorized(request, Brought::kUnknown,
                        "the key that this session was begun with is not known any more, or has expired");
  }
  return unauthorized(request, Brought::kNothing,
                      "no key was given; bring one as 'Authorization: Bearer KEY'");
}

}  // namespace

Guard::Guard(const Config& config, KeyRing& keys, const Tickets& tickets)
    : config_(config), keys_(keys), tickets_(tickets) {}

bool Guard::is_known_host(std::string_view host) const {
  const std::string_view name = without_port(host);
  return is_loopback(name) ||
         std::any_of(config_.hosts.begin(), config_.hosts.end(),
                     [&](const std::string& known) { return known == name || known == host; });
}

bool Guard::is_named_origin(std::string_view origin) const {
  return std::find(config_.origins.begin(), config_.origins.end(), origin) != config_.origins.end();
}

std::optional<Holder> Guard::holder_of(const Request& request) {
  if (const auto given = request.header("Authorization")) {
    constexpr std::string_view kBearer = "Bearer ";
    if (given->size() <= kBearer.size() ||
        !equal_ignoring_case(given->substr(0, kBearer.size()), kBearer)) {
      return std::nullopt;
    }
    return keys_.holder_of_token(given->substr(kBearer.size()));
  }
  const auto cookies = request.header("Cookie");
  return cookies ? keys_.holder_of_session(cookie_value(*cookies, kCookieName)) : std::nullopt;
}

std::optional<Response> Guard::check_host_and_origin(const Request& request) const {
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
  return std::nullopt;
}

std::variant<Holder, Response> Guard::authorize(Request& request, std::string_view scope) {
  auto& query = request.query_params;
  const auto ticket = std::find_if(query.begin(), query.end(),
                                   [](const auto& each) { return each.first == "ticket"; });
  if (ticket != query.end()) {
    if (const auto jobs = watched_jobs(request); !jobs.empty()) {
      auto holder = tickets_.holder_of(ticket->second, jobs);
      query.erase(ticket);
      if (!holder) {
        return unauthorized(request, Brought::kUnknown, "the ticket is not for this, or its minute is over");
      }
      return Holder{.id = std::move(*holder)};
    }
  }
  if (scope.empty() || !keys_.is_needed()) {
    return Holder{};
  }
  auto holder = holder_of(request);
  if (!holder) {
    return unknown_holder(request);
  }
  request.principal = holder->id;
  request.principal_name = holder->name;
  if (scope == "write" ? !holder->may_write : !holder->may_read) {
    return error_answer(request, core::ErrorCode::kForbidden,
                        "the key '" + holder->id + "' has no scope '" + std::string(scope) + "'");
  }
  return std::move(*holder);
}

std::optional<Response> Guard::count(const Request& request, const Holder& holder) {
  if (holder.id.empty() || holder.rate_limit <= 0) {
    return std::nullopt;
  }
  const RateLimiter::State state = rates_.take(holder.id, holder.rate_limit);
  if (state.allowed) {
    return std::nullopt;
  }
  Response response = error_answer(request, core::ErrorCode::kTooManyRequests,
                                   "the key '" + holder.id + "' may ask " +
                                       std::to_string(state.limit) + " times a minute");
  response.headers.set("Retry-After", std::to_string(state.reset_seconds));
  return response;
}

std::optional<Response> Guard::check(Request& request) {
  if (is_probe(request.path)) {
    return std::nullopt;
  }
  if (auto refused = check_host_and_origin(request)) {
    return refused;
  }
  if (request.method == "OPTIONS") {
    return std::nullopt;
  }
  auto authorized = authorize(request, needed_scope(request));
  if (auto* refused = std::get_if<Response>(&authorized)) {
    return std::move(*refused);
  }
  const Holder& holder = *std::get_if<Holder>(&authorized);
  request.principal = holder.id;
  request.principal_name = holder.name;
  return count(request, holder);
}

void Guard::decorate(const Request& request, Response& response) const {
  response.headers.set("X-Content-Type-Options", "nosniff");
  // draft-ietf-httpapi-ratelimit-headers-10: a list of policies, and what is left of them.
  if (const auto rate = request.principal.empty() ? std::nullopt : rates_.last(request.principal)) {
    response.headers.set("RateLimit-Policy", "\"key\";q=" + std::to_string(rate->limit) + ";w=60");
    response.headers.set("RateLimit", "\"key\";r=" + std::to_string(rate->remaining) + ";t=" +
                                          std::to_string(rate->reset_seconds));
  }
  const auto origin = request.header("Origin");
  if (!origin || !is_named_origin(*origin)) {
    return;
  }
  response.headers.set("Access-Control-Allow-Origin", *origin);
  response.headers.add("Vary", "Origin");
  response.headers.set("Access-Control-Allow-Credentials", "true");
  response.headers.set("Access-Control-Expose-Headers", 
                       "ETag, Link, Location, Preference-Applied, RateLimit, RateLimit-Policy, "
                       "Retry-After, X-Request-Id, X-Tessera-Ignored, X-Tessera-Range, X-Tessera-Revision");
  if (request.method == "OPTIONS") {
    response.headers.set("Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, PATCH, DELETE");
    response.headers.set("Access-Control-Allow-Headers",
                         "Authorization, Content-Type, Idempotency-Key, If-Match, If-None-Match, "
                         "Last-Event-ID, Prefer, X-Request-Id");
  }
}

Response Guard::start_session(const Request& request) {
  if (!keys_.is_needed()) {
    return empty_response();
  }
  if (!holder_of(request)) {
    return unknown_holder(request);
  }
  Response response = empty_response();
  if (const auto given = request.header("Authorization")) {
    const std::string_view token = given->substr(given->find(' ') + 1);
    response.headers.set("Set-Cookie",
                         std::string(kCookieName) + "=" + session_of_token(token) +
                             "; Path=/; HttpOnly; SameSite=Strict" +
                             (config_.tls_cert.empty() ? "" : "; Secure"));
  }
  return response;
}

}  // namespace server
