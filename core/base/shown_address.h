/// Addresses in messages.
#pragma once

#include <string>
#include <string_view>

#include "core/base/text.h"

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
  return (scheme.empty() || !is_word(scheme) ? "" : std::string(scheme) + "://") + "***" +
         std::string(text.substr(at));
}

}  // namespace core
