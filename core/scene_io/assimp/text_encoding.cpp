#include "core/scene_io/assimp/text_encoding.h"

#include <cstdint>
#include <string>

#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

void append_utf8(std::string& to, std::uint32_t code) {
  const auto part = [&](unsigned shift) {
    to += static_cast<char>(0x80U | ((code >> shift) & 0x3FU));
  };
  if (code < 0x80) {
    to += static_cast<char>(code);
  } else if (code < 0x800) {
    to += static_cast<char>(0xC0U | code >> 6U);
    part(0);
  } else if (code < 0x10000) {
    to += static_cast<char>(0xE0U | code >> 12U);
    part(6);
    part(0);
  } else {
    to += static_cast<char>(0xF0U | code >> 18U);
    part(12);
    part(6);
    part(0);
  }
}

std::string of_utf16(std::string_view text, bool is_big_endian) {
  const auto unit = [&](std::size_t at) {
    const auto byte = [&](std::size_t i) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i]));
    };
    return is_big_endian ? byte(at) << 8U | byte(at + 1) : byte(at + 1) << 8U | byte(at);
  };
  std::string out;
  out.reserve(text.size());
  for (std::size_t at = 0; at + 1 < text.size(); at += 2) {
    std::uint32_t code = unit(at);
    const bool is_pair =
        (code & 0xFC00U) == 0xD800 && at + 3 < text.size() && (unit(at + 2) & 0xFC00U) == 0xDC00;
    if (is_pair) {
      code = 0x10000 + ((code & 0x3FFU) << 10U | (unit(at + 2) & 0x3FFU));
      at += 2;
    } else if ((code & 0xF800U) == 0xD800) {
      code = 0xFFFD;  // half of a pair
    }
    append_utf8(out, code);
  }
  return out;
}

}  // namespace

void make_utf8(Bytes& text) {
  const std::string_view all = text_of(text);
  if (all.starts_with("\xEF\xBB\xBF")) {
    text.erase(text.begin(), text.begin() + 3);
  } else if (all.starts_with("\xFF\xFE") || all.starts_with("\xFE\xFF")) {
    text = bytes_of(of_utf16(all.substr(2), all.front() == '\xFE'));
  }
}

}  // namespace core
