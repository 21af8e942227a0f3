/// Guard: who may ask. Host and Origin of every request, its key where one is needed, what the key
/// allows, and how often.
///
/// Runs before the routes. Probes answer anybody; the page, its files and the API's description
/// need no key, so that a browser can get to the point of bringing one.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/http/message.h"
#include "server/key_ring.h"
#include "server/live_config.h"
#include "server/rate_limiter.h"
#include "server/store/session_store.h"
#include "server/tickets.h"

namespace server {

/// /livez, /readyz and /metrics: they answer whatever the state of the server.
bool is_probe(std::string_view path);

class Guard {
 public:
  /// All must outlive it.
  Guard(const LiveConfig& config, KeyRing& keys, const Tickets& tickets, SessionStore& sessions);

  /// 421 for a wrong Host, 403 for a foreign Origin or a scope that the key lacks, 401 without a
  /// key, 429 for too many requests; else empty, and request.principal is the key's id,
  /// request.access what it may see.
  std::optional<Response> check(Request& request);
  /// What browsers may do with the answer, CORS headers for the origins that the operator named,
  /// how much of its rate the key has left. What was given to a key is for no shared cache.
  void decorate(const Request& request, Response& response) const;
  /// POST /v1/session: the key, brought as a bearer token, becomes a cookie for images and events.
  Response start_session(const Request& request);
  /// DELETE /v1/session: the cookie is not valid any more.
  Response end_session(const Request& request);

 private:
  bool is_known_host(std::string_view host) const;
  bool is_named_origin(std::string_view origin) const;
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
