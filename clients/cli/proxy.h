/// The proxy of the environment.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/base/result.h"

namespace cli {

struct ProxyAddress {
  std::string variable;  ///< HTTPS_PROXY, for example.
  std::string host;
  int port = 0;
  std::string user = {};
  std::string password = {};
};

/// Returns the variable's value; empty if it is not set.
using Variable = std::function<std::string(const char* name)>;

/// Returns the proxy for a server: HTTPS_PROXY or HTTP_PROXY by its scheme, else ALL_PROXY; each
/// also in lower case, which comes first. Empty if there is none, for the machine itself, and for
/// hosts that NO_PROXY names: `*`, a name with all names below it, or an address; with a port, only
/// that one. Errors: kInvalidArgument for a variable that is not an address http://HOST:PORT; the
/// text has no password.
core::Result<std::optional<ProxyAddress>> proxy_for(const std::string& scheme,
                                                    const std::string& host, int port,
                                                    const Variable& variable);

}  // namespace cli
