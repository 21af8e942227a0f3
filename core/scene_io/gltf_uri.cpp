#include "core/scene_io/gltf_uri.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <set>
#include <utility>

#include "core/base/file_names.h"
#include "core/base/invalid.h"
#include "core/base/text.h"

namespace core {
namespace {

constexpr std::string_view kDataScheme = "data:";  // in any case: RFC 3986, 3.1

int base64_digit(char c) noexcept {
  if (c >= 'A' && c <= 'Z') {
    return c - 'A';
  }
  if (c >= 'a' && c <= 'z') {
    return c - 'a' + 26;
  }
  if (c >= '0' && c <= '9') {
    return c - '0' + 52;
  }
  return c == '+' || c == '-' ? 62 : (c == '/' || c == '_' ? 63 : -1);
}

bool is_space(char c) noexcept { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Skips line breaks, as MIME encoders write them (RFC 2045, 6.8).
Result<Bytes> decode_base64(std::string_view text) {
  while (!text.empty() && (text.back() == '=' || is_space(text.back()))) {
    text.remove_suffix(1);
  }
  Bytes bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int held = 0;
  std::size_t digits = 0;
  for (const char c : text) {
    if (is_space(c)) {
      continue;
    }
    const int digit = base64_digit(c);
    if (digit < 0) {
      return invalid("a data URI contains a character that is not base64");
    }
    ++digits;
    bits = bits << 6U | static_cast<std::uint32_t>(digit);
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes.push_back(static_cast<std::byte>(bits >> static_cast<std::uint32_t>(held) & 0xFFU));
    }
  }
  if (digits % 4 == 1) {
    return invalid("the base64 of a data URI is truncated");
  }
  return bytes;
}

/// parameters: the text between the scheme and the comma, whose parts may be in any order.
bool names_base64(std::string_view parameters) noexcept {
  while (!parameters.empty()) {
    const std::size_t end = std::min(parameters.find(';'), parameters.size());
    std::string_view part = parameters.substr(0, end);
    while (!part.empty() && is_space(part.front())) {
      part.remove_prefix(1);
    }
    while (!part.empty() && is_space(part.back())) {
      part.remove_suffix(1);
    }
    if (equal_ignoring_case(part, "base64")) {
      return true;
    }
    parameters.remove_prefix(std::min(end + 1, parameters.size()));
  }
  return false;
}

/// Returns as many of the names as fit in 2 kB.
std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kListBytes = 1900;
  std::string list;
  std::size_t named = 0;
  while (named < names.size() && list.size() < kListBytes - 203) {
    list += (named == 0 ? ": " : ", ") + shown_uri(names[named]);
    ++named;
  }
  if (named < names.size()) {
    list += ", and " + std::to_string(names.size() - named) + " more";
  }
  return list;
}

}  // namespace

bool is_data_uri(std::string_view uri) noexcept {
  return equal_ignoring_case(uri.substr(0, kDataScheme.size()), kDataScheme);
}

Result<Bytes> decode_data_uri(std::string_view uri) {
  const std::size_t comma = uri.find(',');
  if (!is_data_uri(uri) || comma == std::string_view::npos) {
    return invalid("a data URI without a comma");
  }
  const std::string text = percent_decode(uri.substr(comma + 1));
  if (names_base64(uri.substr(kDataScheme.size(), comma - kDataScheme.size()))) {
    return decode_base64(text);
  }
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return Bytes(first, first + text.size());
}

std::string shown_uri(std::string_view uri) {
  constexpr std::size_t kLongest = 200;
  return std::string(uri.substr(0, kLongest)) + (uri.size() > kLongest ? "..." : "");
}

Error missing_files(const std::vector<std::string>& names,
                    const std::vector<std::string>& outside) {
  std::string text = outside.empty()
                         ? ""
                         : "files outside the folder of the scene are not read" + list_of(outside);
  const std::set<std::string_view> told(outside.begin(), outside.end());
  std::vector<std::string> others;
  std::copy_if(names.begin(), names.end(), std::back_inserter(others),
               [&](const std::string& name) { return !told.contains(name); });
  if (!others.empty()) {
    text += (text.empty() ? "" : "; ") + std::string("files that the scene refers to are missing") +
            list_of(others);
  }
  return {ErrorCode::kMissingFiles, std::move(text), ""};
}

bool has_scheme(std::string_view uri) noexcept {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && colon > 1 && is_word(uri.substr(0, colon), "+-.");
}

}  // namespace core
