/// Addresses in messages.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace core {

/// Returns the address with "***" for all that precedes its last '@', except a scheme: it may be
/// a password. The text need not be a valid address.
inline std::string shown_address(std::string_view text) {
  const std::size_t at = text.rfind('@');
  if (at == std::string_view::npos) {
    return std::string(text);
  }
  const std::size_t mark = text.substr(0, at).find("://");
  const std::string_view scheme = text.substr(0, mark == std::string_view::npos ? 0 : mark);
  const bool is_scheme = std::all_of(scheme.begin(), scheme.end(),
                                     [](unsigned char c) { return std::isalnum(c) != 0; });
  return (scheme.empty() || !is_scheme ? "" : std::string(scheme) + "://") + "***" +
         std::string(text.substr(at));
}

}  // namespace core
