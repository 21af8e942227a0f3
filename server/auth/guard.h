/// Guard: authentication and authorization. Checks Host and Origin of every request, its key where
/// one is required, the scopes of the key, and its rate.
///
/// Runs before the routes. Probes need no key; nor do the page, its files and the API's
/// description, so that a browser can load the form in which users enter a key.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "server/auth/key_ring.h"
#include "server/auth/rate_limiter.h"
#include "server/auth/tickets.h"
#include "server/config/live_config.h"
#include "server/http/message.h"
#include "server/store/session_store.h"

namespace server {

/// /livez, /readyz and /metrics, which answer in any state of the server.
bool is_probe(std::string_view path);

class Guard {
 public:
  /// All arguments must outlive it.
  Guard(const LiveConfig& config, KeyRing& keys, const Tickets& tickets, SessionStore& sessions);

  /// Returns 421 for a wrong Host, 403 for a foreign Origin or a scope that the key lacks, 401
  /// without a key, 429 for too many requests; else empty, and sets request.principal to the key's
  /// id, request.access to its rights, and request.is_of_worker.
  std::optional<Response> check(Request& request);
  /// Adds the browser security headers, CORS headers for origins that the operator named
  /// (api/header_rows.h), and the key's remaining rate. Responses to requests with a key are marked
  /// as not for shared caches.
  void decorate(const Request& request, Response& response) const;
  /// Returns the sources of pages that may frame /embed/JOB (CSP's frame-ancestors).
  std::string embed_ancestors() const;
  /// Returns the rights of a tenant over its own things, for requests without a key.
  Access access_of_tenant(std::string tenant);
  /// POST /v1/session: turns the bearer token into a cookie for images and events.
  Response start_session(const Request& request);
  /// DELETE /v1/session: invalidates the cookie.
  Response end_session(const Request& request);

 private:
  bool is_known_host(std::string_view host) const;
  bool is_same_origin(const Request& request, std::string_view origin) const;
  bool is_named_origin(std::string_view origin) const;
  std::string cookie_field(const Request& request, std::string_view value,
                           std::chrono::seconds life) const;
  /// Path of this server for the client: "/render" behind a proxy that places it there, else "".
  std::string base_path_of(const Request& request) const;
  std::optional<Response> check_probe(const Request& request) const;
  std::optional<Response> check_host_and_origin(const Request& request) const;
  std::optional<Holder> holder_of(const Request& request);
  Access access_of(const Holder& holder);
  std::optional<Response> authorize(Request& request, std::string_view scope);
  std::optional<Response> count(const Request& request, const Holder& holder);

  const LiveConfig& config_;
  KeyRing& keys_;
  const Tickets& tickets_;
  SessionStore& sessions_;
  RateLimiter rates_;
};

}  // namespace server
