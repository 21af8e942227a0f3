/// One POST to an address that somebody else chose, for webhooks.
///
/// The name is resolved here and the connection goes to an address that was looked at, so that it
/// cannot mean another one a moment later. Redirects are not followed; of the answer only the status
/// is read.
#pragma once

#include <chrono>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"

namespace server {

struct WebTarget {
  bool is_tls = false;
  std::string host;  ///< A name or an address, IPv6 without brackets.
  int port = 80;
  std::string path = "/";  ///< With its query.
};
/// Empty when it is not http(s)://host[:port][/path][?query].
std::optional<WebTarget> parse_web_target(std::string_view url);

/// localhost, or an address (not a name) that is not on the public internet.
bool is_private_literal(std::string_view host);
/// An IPv4 or IPv6 address in numbers; what is no address is not public.
bool is_public_address(std::string_view address);

enum class Reach { kPublicOnly, kAnywhere };

struct WebPost {
  std::string body;
  std::string content_type;
  std::vector<std::pair<std::string, std::string>> headers;
  Reach reach = Reach::kPublicOnly;
  std::chrono::seconds timeout{15};  ///< For everything together.
  std::stop_token stop = {};         ///< Breaks it off.
};
/// The status of the answer. Errors: kForbidden for an address that is not public; kUnavailable when
/// there was no answer, with the reason.
core::Result<int> post_to_web(const WebTarget& target, const WebPost& post);

}  // namespace server
