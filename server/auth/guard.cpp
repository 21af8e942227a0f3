#include "server/auth/guard.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "api/header_rows.h"
#include "api/json/error_codes.h"
#include "api/operations.h"
#include "server/http/security_headers.h"
#include "server/http/text.h"
#include "server/observe/clock.h"
#include "server/origin.h"
#include "server/routes/answers.h"

namespace server {
namespace {

constexpr std::string_view kCookieName = "tessera_session";

/// Browsers send cookies to all ports of a host: servers on several ports have a cookie each.
std::string cookie_name(const Request& request) {
  const std::string_view asked = request.forwarded_host.empty()
                                     ? request.header("Host").value_or("")
                                     : std::string_view(request.forwarded_host);
  const std::string_view port = asked.substr(without_port(asked).size());
  return std::string(kCookieName) + (port.empty() ? "" : "_" + std::string(port.substr(1)));
}

/// "ETag, Link, ..."
std::string names_of(std::span<const api::HeaderRow> rows) {
  std::string names;
  for (const api::HeaderRow& row : rows) {
    names.append(names.empty() ? "" : ", ").append(row.name);
  }
  return names;
}

const std::string& exposed_headers() {
  static const std::string kNames = names_of(api::response_headers());
  return kNames;
}

/// Images by URL are for the pages of all origins: their signature is their only credential.
bool is_public_image(std::string_view path) { return path.starts_with("/i/"); }

/// Returns the scope that the request's operation needs: "read", "write", "admin", "worker", or ""
/// for none. Requests outside the table (page files, unknown paths) need none, except below /v1.
std::string_view needed_scope(const Request& request) {
  const std::string_view method =
      request.method == "HEAD" ? "GET" : std::string_view(request.method);
  for (const api::Operation& operation : api::operations()) {
    if (operation.method == method && operation.path == request.route) {
      return operation.scope;
    }
  }
  return request.path.rfind("/v1/", 0) == 0 && request.path != "/v1/session" ? "read" : "";
}

/// Returns the jobs that the request would watch, if a ticket may authorize it; otherwise none.
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

/// Returns the values of all sessions: a server that restarts on another port knows its old ones,
/// and those of other servers are unknown here.
std::vector<std::string_view> session_cookies(std::string_view cookies) {
  std::vector<std::string_view> values;
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view pair = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (!pair.empty() && pair.front() == ' ') {
      pair.remove_prefix(1);
    }
    if (const std::size_t equals = pair.find('=');
        pair.starts_with(kCookieName) && equals != std::string_view::npos) {
      values.push_back(pair.substr(equals + 1));
    }
  }
  return values;
}

/// Returns TOKEN of `Authorization: Bearer TOKEN`.
std::optional<std::string_view> bearer_token(const Request& request) {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view given = request.header("Authorization").value_or("");
  return given.size() > kScheme.size() &&
                 equal_ignoring_case(given.substr(0, kScheme.size()), kScheme)
             ? std::optional<std::string_view>(given.substr(kScheme.size()))
             : std::nullopt;
}

bool may(const Holder& holder, std::string_view scope) {
  return scope == "admin"    ? holder.may_admin
         : scope == "write"  ? holder.may_write
         : scope == "worker" ? holder.may_work
                             : holder.may_read;
}

/// RFC 6750, 3: only requests with credentials get an error code.
enum class Brought : std::uint8_t { kNothing, kUnknown };

Response unauthorized(const Request& request, Brought brought, std::string detail) {
  Response response = error_answer(request, api::kUnauthorized, std::move(detail));
  response.headers.set("WWW-Authenticate",
                       brought == Brought::kNothing
                           ? "Bearer realm=\"tessera\""
                           : "Bearer realm=\"tessera\", error=\"invalid_token\"");
  return response;
}

/// Returns the response to a request whose holder is unknown.
Response unknown_holder(const Request& request) {
  if (bearer_token(request)) {
    return unauthorized(request, Brought::kUnknown, "the key is unknown or has expired");
  }
  const std::string_view cookies = request.header("Cookie").value_or("");
  if (request.header("Authorization").value_or("").empty() && !session_cookies(cookies).empty()) {
    return unauthorized(request, Brought::kUnknown,
                        "the session has ended, or its key is no longer valid");
  }
  return unauthorized(request, Brought::kNothing,
                      "no key was given; send one as 'Authorization: Bearer KEY'");
}

}  // namespace

bool is_probe(std::string_view path) {
  return path == "/livez" || path == "/readyz" || path == "/metrics";
}

Guard::Guard(const LiveConfig& config, KeyRing& keys, const Tickets& tickets,
             SessionStore& sessions)
    : config_(config), keys_(keys), tickets_(tickets), sessions_(sessions) {}

bool Guard::is_known_host(std::string_view host) const {
  const auto asked = parse_host(host);
  if (!asked) {
    return false;
  }
  const std::string_view name = without_port(*asked);
  const auto config = config_.now();
  return is_loopback(name) ||
         std::any_of(config->hosts.begin(), config->hosts.end(), [&](const std::string& known) {
           return equal_ignoring_case(known, name) || equal_ignoring_case(known, *asked);
         });
}

bool Guard::is_named_origin(std::string_view origin) const {
  const auto parsed = parse_origin(origin);
  const auto config = config_.now();
  return parsed && std::find(config->origins.begin(), config->origins.end(), *parsed) !=
                       config->origins.end();
}

/// The page was loaded from the host of the request, or from that which a trusted proxy names.
/// Schemes may differ: proxies end TLS.
bool Guard::is_same_origin(const Request& request, std::string_view origin) const {
  const auto parsed = parse_origin(origin);
  const std::string scheme(origin.substr(0, origin.find("//") + 2));
  const auto names_this = [&](std::string_view host) {
    const auto own = parse_origin(scheme + std::string(host));
    return parsed && own && *parsed == *own;
  };
  return names_this(request.header("Host").value_or("")) ||
         (is_known_host(request.forwarded_host) && names_this(request.forwarded_host));
}

std::optional<Holder> Guard::holder_of(const Request& request) {
  if (request.header("Authorization")) {
    const auto token = bearer_token(request);
    return token ? keys_.holder_of_hash(secret_hash(*token)) : std::nullopt;
  }
  for (const std::string_view cookie : session_cookies(request.header("Cookie").value_or(""))) {
    if (const auto hash = sessions_.token_hash_of(cookie, unix_now())) {
      return keys_.holder_of_hash(*hash);
    }
  }
  return std::nullopt;
}

std::optional<Response> Guard::check_host_and_origin(const Request& request) const {
  const std::string_view host = request.header("Host").value_or("");
  if (!is_known_host(host)) {
    return error_answer(request, api::kMisdirected,
                        "this server does not accept the host name '" +
                            std::string(without_port(host)) +
                            "'; add it with --hosts or TESSERA_HOSTS");
  }
  if (const auto origin = request.header("Origin"); origin && !is_public_image(request.path)) {
    if (!is_same_origin(request, *origin) && !is_named_origin(*origin)) {
      return error_answer(request, api::kForeignOrigin,
                          "pages of the origin '" + std::string(*origin) +
                              "' may not call this server as '" + std::string(host) +
                              "'; name the origin with --origins or TESSERA_ORIGINS, or let the "
                              "proxy pass on the browser's Host with its port (or trust its "
                              "X-Forwarded-Host with --trusted-proxies)");
    }
  }
  return std::nullopt;
}

Access Guard::access_of(const Holder& holder) {
  const bool is_shared = config_.now()->shared || !keys_.is_needed();
  return {.tenant = holder.tenant,
          .scope = is_shared          ? Access::Scope::kShared
                   : holder.may_admin ? Access::Scope::kAll
                                      : Access::Scope::kOwn,
          .priority_max = holder.priority_max};
}

Access Guard::access_of_tenant(std::string tenant) {
  Holder holder;
  holder.tenant = std::move(tenant);
  return access_of(holder);
}

std::optional<Response> Guard::authorize(Request& request, std::string_view scope) {
  auto& query = request.query_params;
  const auto ticket = std::find_if(query.begin(), query.end(),
                                   [](const auto& each) { return each.first == "ticket"; });
  if (ticket != query.end()) {
    if (const auto jobs = watched_jobs(request); !jobs.empty()) {
      auto holder = tickets_.holder_of(ticket->second, jobs);
      query.erase(ticket);
      if (!holder) {
        return unauthorized(request, Brought::kUnknown,
                            "the ticket is not valid for this request, or has expired");
      }
      request.principal = std::move(holder->key);
      request.access = std::move(holder->access);
      return std::nullopt;
    }
  }
  if (scope.empty()) {
    return std::nullopt;
  }
  if (!keys_.is_needed()) {
    request.access = access_of(Holder{});
    request.is_of_worker = scope == "worker";
    return std::nullopt;
  }
  auto holder = holder_of(request);
  if (!holder) {
    return unknown_holder(request);
  }
  request.principal = holder->id;
  request.principal_name = holder->name;
  request.access = access_of(*holder);
  if (!may(*holder, scope)) {
    return error_answer(
        request, core::ErrorCode::kForbidden,
        "the key '" + holder->id + "' lacks the scope '" + std::string(scope) + "'");
  }
  request.is_of_worker = scope == "worker";
  // Workers send as many requests as they finish units.
  return request.is_of_worker ? std::nullopt : count(request, *holder);
}

std::optional<Response> Guard::count(const Request& request, const Holder& holder) {
  if (holder.id.empty() || holder.rate_limit <= 0) {
    return std::nullopt;
  }
  const RateLimiter::State state = rates_.take(holder.id, holder.rate_limit);
  if (state.allowed) {
    return std::nullopt;
  }
  Response response = error_answer(request, api::kTooManyRequests,
                                   "the key '" + holder.id + "' is limited to " +
                                       std::to_string(state.limit) + " requests per minute");
  response.headers.set("Retry-After", std::to_string(state.reset_seconds));
  return response;
}

std::optional<Response> Guard::check_probe(const Request& request) const {
  const auto config = config_.now();
  const auto given = bearer_token(request);
  if (request.path != "/metrics" || config->metrics_key.empty() ||
      (given && is_same_secret(secret_hash(*given), secret_hash(config->metrics_key)))) {
    return std::nullopt;
  }
  return unauthorized(request, given ? Brought::kUnknown : Brought::kNothing,
                      "/metrics requires the key of --metrics-key");
}

std::optional<Response> Guard::check(Request& request) {
  if (is_probe(request.path)) {
    return check_probe(request);
  }
  if (auto refused = check_host_and_origin(request)) {
    return refused;
  }
  if (request.method == "OPTIONS") {
    return std::nullopt;
  }
  return authorize(request, needed_scope(request));
}

void Guard::decorate(const Request& request, Response& response) const {
  add_security_headers(
      response,
      request.is_https && !is_loopback(without_port(request.header("Host").value_or(""))));
  constexpr std::string_view kPublic = "public";
  const std::string caching(response.headers.find("Cache-Control").value_or(""));
  if (caching.starts_with(kPublic) && request.path.starts_with("/v1/") && keys_.is_needed()) {
    response.headers.set("Cache-Control", "private" + caching.substr(kPublic.size()));
  }
  // draft-ietf-httpapi-ratelimit-headers-10: a list of policies, and the remaining quota.
  if (const auto rate = request.principal.empty() ? std::nullopt : rates_.last(request.principal)) {
    response.headers.set("RateLimit-Policy", "\"key\";q=" + std::to_string(rate->limit) + ";w=60");
    response.headers.set("RateLimit", "\"key\";r=" + std::to_string(rate->remaining) +
                                          ";t=" + std::to_string(rate->reset_seconds));
  }
  if (const auto location = response.headers.find("Location");
      location && location->starts_with('/')) {
    response.headers.set("Location", base_path_of(request) + std::string(*location));
  }
  if (is_public_image(request.path)) {
    // With or without an Origin, because caches keep one answer for all.
    response.headers.set("Access-Control-Allow-Origin", "*");
    response.headers.set("Access-Control-Expose-Headers", exposed_headers());
    return;
  }
  // Caches must not give a page of another origin what they stored for this one.
  if (!config_.now()->origins.empty()) {
    response.headers.add("Vary", "Origin");
  }
  const auto origin = request.header("Origin");
  if (!origin || !is_named_origin(*origin)) {
    return;
  }
  response.headers.set("Access-Control-Allow-Origin", *origin);
  response.headers.set("Access-Control-Allow-Credentials", "true");
  static const std::string kAllowed = names_of(api::request_headers());
  response.headers.set("Access-Control-Expose-Headers", exposed_headers());
  if (request.method == "OPTIONS") {
    response.headers.set("Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, PATCH, DELETE");
    response.headers.set("Access-Control-Allow-Headers", kAllowed);
    // Chromium's longest, two hours.
    response.headers.set("Access-Control-Max-Age", "7200");
  }
}

std::string Guard::embed_ancestors() const {
  std::string sources = "'self'";
  for (const std::string& origin : config_.now()->embed_origins) {
    sources.append(" ").append(origin);
  }
  return sources;
}

std::string Guard::base_path_of(const Request& request) const {
  return request.base_path.empty() ? config_.now()->base_path : request.base_path;
}

std::string Guard::cookie_field(const Request& request, std::string_view value,
                                std::chrono::seconds life) const {
  std::string field = cookie_name(request);
  field.append("=").append(value).append("; Path=").append(base_path_of(request)).append("/");
  field.append("; Max-Age=").append(std::to_string(life.count()));
  field.append("; HttpOnly; SameSite=Strict");
  return request.is_https ? field + "; Secure" : field;
}

Response Guard::start_session(const Request& request) {
  if (!keys_.is_needed()) {
    return empty_response();
  }
  if (!holder_of(request)) {
    return unknown_holder(request);
  }
  const auto token = bearer_token(request);
  if (!token) {
    return empty_response();  // The existing session continues.
  }
  const auto cookie = sessions_.begin(secret_hash(*token), unix_now());
  if (!cookie) {
    return error_answer(request, cookie.error());
  }
  Response response = empty_response();
  response.headers.set("Set-Cookie",
                       cookie_field(request, *cookie, std::chrono::seconds(SessionStore::kLife)));
  return response;
}

Response Guard::end_session(const Request& request) {
  for (const std::string_view cookie : session_cookies(request.header("Cookie").value_or(""))) {
    if (const auto ended = sessions_.end(cookie); !ended) {
      return error_answer(request, ended.error());
    }
  }
  Response response = empty_response();
  response.headers.set("Set-Cookie", cookie_field(request, "", std::chrono::seconds(0)));
  return response;
}

}  // namespace server
