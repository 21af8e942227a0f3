#include "clients/cli/proxy.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <string_view>

#include "core/base/text.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

/// Returns lower case first: HTTP_PROXY may come from a header of a request in a CGI program.
std::string either(const Variable& variable, const std::string& name) {
  const std::string lower = variable(core::in_lower_case(name).c_str());
  return lower.empty() ? variable(name.c_str()) : lower;
}

bool is_of_this_machine(const std::string& host) {
  return host == "localhost" || host.ends_with(".localhost") || host == "[::1]" ||
         host.starts_with("127.");
}

bool is_exempt(std::string_view list, const std::string& host, int port) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    std::string name = core::in_lower_case(core::trimmed(list.substr(0, end), " "));
    list.remove_prefix(std::min(end + 1, list.size()));
    const std::string own_port = ":" + std::to_string(port);
    if (name.ends_with(own_port)) {
      name.resize(name.size() - own_port.size());
    }
    if (name.starts_with("*.") || name.starts_with('.')) {
      name.erase(0, name.find('.') + 1);
    }
    if (!name.empty() && (name == "*" || host == name || host.ends_with("." + name))) {
      return true;
    }
  }
  return false;
}

}  // namespace

core::Result<std::optional<ProxyAddress>> proxy_for(const std::string& scheme,
                                                    const std::string& host_name, int port,
                                                    const Variable& variable) {
  const std::string host = core::in_lower_case(host_name);
  std::string name = scheme == "https" ? "HTTPS_PROXY" : "HTTP_PROXY";
  std::string value = either(variable, name);
  if (value.empty()) {
    name = "ALL_PROXY";
    value = either(variable, name);
  }
  std::string_view url = value;
  if (url.empty() || is_of_this_machine(host) ||
      is_exempt(either(variable, "NO_PROXY"), host, port)) {
    return std::optional<ProxyAddress>();
  }
  const Error unusable = {ErrorCode::kInvalidArgument,
                          name + " is not an address such as http://proxy.example.org:3128", ""};
  if (const std::size_t mark = url.find("://"); mark != std::string_view::npos) {
    if (core::in_lower_case(url.substr(0, mark)) != "http") {
      return unusable;
    }
    url.remove_prefix(mark + 3);
  }
  url = url.substr(0, url.find('/'));
  ProxyAddress proxy = {.variable = name, .host = {}};
  if (const std::size_t at = url.rfind('@'); at != std::string_view::npos) {
    const std::string_view user = url.substr(0, at);
    const std::size_t colon = std::min(user.find(':'), user.size());
    proxy.user = user.substr(0, colon);
    proxy.password = user.substr(std::min(colon + 1, user.size()));
    url.remove_prefix(at + 1);
  }
  const std::size_t colon = url.rfind(':');
  proxy.host = url.substr(0, colon);
  proxy.port = 80;
  if (colon != std::string_view::npos) {
    const std::string_view digits = url.substr(colon + 1);
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), proxy.port);
    if (read.ec != std::errc() || read.ptr != digits.data() + digits.size() || proxy.port < 1 ||
        proxy.port > 65535) {
      return unusable;
    }
  }
  if (proxy.host.empty() || !core::is_word(proxy.host, "-._:[]")) {
    return unusable;
  }
  return std::optional(proxy);
}

}  // namespace cli
