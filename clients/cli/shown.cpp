#include "clients/cli/shown.h"

#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace cli {
namespace {

struct Character {
  std::uint32_t code = 0xfffd;
  std::size_t bytes = 1;
};

/// Decodes the first character; U+FFFD for a byte that begins none.
Character first_of(std::string_view text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  const std::size_t bytes = lead < 0x80U                    ? 1
                            : lead >= 0xc2U && lead < 0xe0U ? 2
                            : lead >= 0xe0U && lead < 0xf0U ? 3
                            : lead >= 0xf0U && lead < 0xf5U ? 4
                                                            : 0;
  if (bytes == 1) {
    return {lead, 1};
  }
  if (bytes == 0 || text.size() < bytes) {
    return {};
  }
  std::uint32_t code = lead & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) {
      return {};
    }
    code = code << 6U | (byte(i) & 0x3fU);
  }
  return {code, bytes};
}

bool is_control(std::uint32_t code) {
  return (code < 0x20 && code != '\n' && code != '\t') || (code >= 0x7f && code < 0xa0) ||
         code == 0x061c || code == 0x200e || code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
         (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string shown(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const Character next = first_of(text);
    if (is_control(next.code)) {
      char escaped[16];
      std::snprintf(escaped, sizeof escaped, "\\u{%x}", static_cast<unsigned>(next.code));
      out += escaped;
    } else if (next.code == 0xfffd) {
      out += "\xef\xbf\xbd";
    } else {
      out += text.substr(0, next.bytes);
    }
    text.remove_prefix(next.bytes);
  }
  return out;
}

}  // namespace cli
