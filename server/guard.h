/// Guard: who may ask. Host and Origin of every request, and its key where one is set.
///
/// Runs before the routes. Probes answer anybody; the page, its files and the API's description need
/// no key, so that a browser can get to the point of bringing one.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/config.h"
#include "server/http/message.h"

namespace server {

class Guard {
 public:
  /// config must outlive it.
  explicit Guard(const Config& config);

  /// 421 for a wrong Host, 403 for a foreign Origin, 401 without the key; else empty.
  std::optional<Response> check(Request& request) const;
  /// CORS headers for the origins that the operator named.
  void decorate(const Request& request, Response& response) const;
  /// POST /v1/session: the key, brought as a bearer token, becomes a cookie for images and events.
  Response start_session(const Request& request) const;

 private:
  bool is_known_host(std::string_view host) const;
  bool is_named_origin(std::string_view origin) const;
  bool has_key(const Request& request) const;
  bool is_key(std::string_view text) const;

  const Config& config_;
  std::string cookie_;  ///< Value of the session cookie: a hash of the key.
};

}  // namespace server
