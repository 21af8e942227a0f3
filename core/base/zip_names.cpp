#include "core/base/zip_names.h"

#include <algorithm>
#include <array>

#include "core/base/file_names.h"

namespace core {
namespace {

/// Code page 437 from 0x80 on. Source: Unicode's mapping table CP437.TXT.
constexpr std::array<char16_t, 129> kUpperHalf = {
    u"ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒáíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐"
    u"└┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘┌█▄▌▐▀αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■\u00a0"};

void append_utf8(std::string& to, char16_t c) {
  if (c < 0x80) {
    to += static_cast<char>(c);
  } else if (c < 0x800) {
    to += static_cast<char>(0xC0 | c >> 6);
    to += static_cast<char>(0x80 | (c & 0x3F));
  } else {
    to += static_cast<char>(0xE0 | c >> 12);
    to += static_cast<char>(0x80 | (c >> 6 & 0x3F));
    to += static_cast<char>(0x80 | (c & 0x3F));
  }
}

}  // namespace

std::string zip_name(std::string_view stored, bool is_utf8) {
  std::string name;
  if (is_utf8 || core::is_utf8(stored)) {
    name = stored;
  } else {
    for (const char c : stored) {
      const auto byte = static_cast<unsigned char>(c);
      append_utf8(name, byte < 0x80 ? byte : kUpperHalf[byte - 0x80U]);
    }
  }
  return with_slashes(name);
}

bool is_safe_name(std::string_view name) {
  if (name.empty() || name.front() == '/' || name.find('\\') != std::string_view::npos ||
      (name.size() > 1 && name[1] == ':')) {
    return false;
  }
  if (std::any_of(name.begin(), name.end(),
                  [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; })) {
    return false;
  }
  while (true) {
    const auto slash = name.find('/');
    const std::string_view part = name.substr(0, slash);
    if (part.empty() || part == "." || part == "..") {
      return false;
    }
    if (slash == std::string_view::npos) {
      return true;
    }
    name.remove_prefix(slash + 1);
    if (name.empty()) {
      return true;  // A folder.
    }
  }
}

bool is_from_macos(std::string_view name) {
  const auto slash = name.rfind('/');
  return name.starts_with("__MACOSX/") || name.find("/__MACOSX/") != std::string_view::npos ||
         name.substr(slash == std::string_view::npos ? 0 : slash + 1).starts_with("._");
}

}  // namespace core
