#include "server/origin.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <arpa/inet.h>

#include "core/base/shown_address.h"
#include "core/base/text.h"
#include "server/http/text.h"

namespace server {
namespace {

core::Error refused(std::string_view text, const char* expected) {
  return {core::ErrorCode::kInvalidArgument,
          "\"" + core::shown_address(text) + "\" is not " + expected,
          {}};
}

/// RFC 1123, 2.1, and underscores: labels of letters, digits and dashes, which begin and end none.
bool is_name(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('.'), text.size());
    const std::string_view label = text.substr(0, end);
    if (label.empty() || !core::is_word(label, "-_") || label.front() == '-' ||
        label.back() == '-') {
      return false;
    }
    if (end == text.size()) {
      return true;
    }
    text.remove_prefix(end + 1);
  }
  return false;
}

bool is_bracketed_address(std::string_view text) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') {
    return false;
  }
  in6_addr address = {};
  return ::inet_pton(AF_INET6, std::string(text.substr(1, text.size() - 2)).c_str(), &address) == 1;
}

/// Returns host and port in lower case; the port is empty if there is none.
std::optional<std::pair<std::string, std::string>> split_host(std::string_view text) {
  std::string_view name = without_port(text);
  const std::string_view port = text.substr(name.size());
  if (name.ends_with('.')) {  // the root of DNS
    name.remove_suffix(1);
  }
  constexpr std::uint64_t kPorts = 65536;  // none is 0
  const std::uint64_t number = port.empty() ? 0 : parse_decimal(port.substr(1)).value_or(0);
  const bool is_port = port.empty() || (number > 0 && number < kPorts);
  if (!(is_name(name) || is_bracketed_address(name)) || !is_port) {
    return std::nullopt;
  }
  return std::pair(core::in_lower_case(name), port.empty() ? "" : std::to_string(number));
}

struct Scheme {
  std::string_view prefix;
  std::string_view default_port;
};
constexpr std::array kSchemes = {Scheme{"http://", "80"}, Scheme{"https://", "443"}};

}  // namespace

std::string_view without_port(std::string_view host) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(0, end + 1);
  }
  const std::size_t colon = host.rfind(':');
  return colon == std::string_view::npos ? host : host.substr(0, colon);
}

core::Result<std::string> parse_host(std::string_view text) {
  const auto host = split_host(text);
  if (!host) {
    return refused(text, "a host name such as render.example.org or 192.0.2.1:8080");
  }
  return host->first + (host->second.empty() ? "" : ":" + host->second);
}

core::Result<std::string> parse_origin(std::string_view text) {
  const std::string lower = core::in_lower_case(text);
  for (const Scheme& scheme : kSchemes) {
    if (lower.starts_with(scheme.prefix)) {
      std::string_view rest = std::string_view(lower).substr(scheme.prefix.size());
      if (rest.ends_with('/')) {
        rest.remove_suffix(1);
      }
      if (const auto host = split_host(rest)) {
        const bool is_default = host->second.empty() || host->second == scheme.default_port;
        return std::string(scheme.prefix) + host->first + (is_default ? "" : ":" + host->second);
      }
    }
  }
  return refused(text, "an origin such as https://shop.example.org");
}

}  // namespace server
