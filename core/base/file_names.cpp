#include "core/base/file_names.h"

#include <algorithm>
#include <cstdlib>

#include <utf8proc.h>

#include "core/base/text.h"

namespace core {

std::string with_slashes(std::string_view name) {
  std::string out(name);
  std::replace(out.begin(), out.end(), '\\', '/');
  return out;
}

std::string folded_name(std::string_view name) {
  const std::string plain = with_slashes(name);
  utf8proc_uint8_t* folded = nullptr;
  const utf8proc_ssize_t bytes = utf8proc_map(
      reinterpret_cast<const utf8proc_uint8_t*>(plain.data()),
      static_cast<utf8proc_ssize_t>(plain.size()), &folded,
      static_cast<utf8proc_option_t>(UTF8PROC_STABLE | UTF8PROC_COMPOSE | UTF8PROC_CASEFOLD));
  if (bytes < 0) {
    return plain;
  }
  std::string out(reinterpret_cast<const char*>(folded), static_cast<std::size_t>(bytes));
  std::free(folded);  // NOLINT(cppcoreguidelines-no-malloc): the library's contract
  return out;
}

std::string_view last_part(std::string_view name) {
  return name.substr(name.find_last_of("/\\") + 1);
}

namespace {

std::string near_key(std::string_view name) { return folded_name(percent_decode(last_part(name))); }

}  // namespace

std::string percent_decode(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size()) {
      const int high = hex_digit(text[i + 1]);
      const int low = hex_digit(text[i + 2]);
      if (high >= 0 && low >= 0) {
        decoded.push_back(static_cast<char>(high * 16 + low));
        i += 2;
        continue;
      }
    }
    decoded.push_back(text[i]);
  }
  return decoded;
}

std::string percent_encode(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  constexpr std::string_view kMarks = "-._~";
  std::string encoded;
  for (const char c : text) {
    if (is_letter_or_digit(c) || kMarks.find(c) != std::string_view::npos) {
      encoded += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    encoded += {'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
  }
  return encoded;
}

std::optional<std::string> plain_name(std::string_view name) {
  std::string out;
  if (name.starts_with('/')) {
    return std::nullopt;
  }
  while (!name.empty()) {
    const std::size_t end = std::min(name.find('/'), name.size());
    const std::string_view part = name.substr(0, end);
    name.remove_prefix(std::min(end + 1, name.size()));
    if (part == "..") {
      if (out.empty()) {
        return std::nullopt;
      }
      const std::size_t parent = out.rfind('/');
      out.resize(parent == std::string::npos ? 0 : parent);
    } else if (!part.empty() && part != ".") {
      out += out.empty() ? "" : "/";
      out += part;
    }
  }
  return out;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    utf8proc_int32_t point = 0;
    const utf8proc_ssize_t bytes =
        utf8proc_iterate(reinterpret_cast<const utf8proc_uint8_t*>(text.data()),
                         static_cast<utf8proc_ssize_t>(text.size()), &point);
    if (bytes <= 0) {
      return false;
    }
    text.remove_prefix(static_cast<std::size_t>(bytes));
  }
  return true;
}

void FileNames::add(const std::string& name) {
  exact_.emplace(name, count_);
  const auto [place, is_new] = folded_.emplace(folded_name(name), count_);
  if (!is_new) {
    place->second.reset();
  }
  near_.emplace(near_key(name), name);
  ++count_;
}

std::optional<std::size_t> FileNames::find(std::string_view name) const {
  if (const auto same = exact_.find(name); same != exact_.end()) {
    return same->second;
  }
  const auto alike = folded_.find(folded_name(name));
  return alike == folded_.end() ? std::nullopt : alike->second;
}

std::string FileNames::near(std::string_view name) const {
  constexpr int kNamed = 3;
  std::string out;
  auto [at, end] = near_.equal_range(near_key(name));
  for (int i = 0; i < kNamed && at != end; ++i, ++at) {
    out += (i == 0 ? "; there is \"" : ", \"") + at->second + "\"";
  }
  return out;
}

}  // namespace core
