#include "server/http/text.h"

#include <algorithm>
#include <array>
#include <limits>

namespace server {
namespace {

constexpr std::array<bool, 256> make_token_table() {
  std::array<bool, 256> table = {};
  constexpr std::string_view kTokenChars =
      "!#$%&'*+-.^_`|~0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
  for (const char c : kTokenChars) {
    table[static_cast<unsigned char>(c)] = true;
  }
  return table;
}
constexpr std::array<bool, 256> kIsTokenChar = make_token_table();

bool ends_with_percentage(std::string_view text) {
  return text.size() > 1 && text.back() == '%' && text[text.size() - 2] >= '0' &&
         text[text.size() - 2] <= '9';
}

}  // namespace

std::string_view trim(std::string_view text) { return core::trimmed(text, " \t"); }

bool is_token(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return kIsTokenChar[static_cast<unsigned char>(c)];
  });
}

std::optional<std::uint64_t> parse_decimal(std::string_view text) {
  if (text.empty()) {
    return std::nullopt;
  }
  std::uint64_t value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') {
      return std::nullopt;
    }
    const auto digit = static_cast<std::uint64_t>(c - '0');
    if (value > (std::numeric_limits<std::uint64_t>::max() - digit) / 10) {
      return std::nullopt;
    }
    value = value * 10 + digit;
  }
  return value;
}

std::vector<std::string_view> split_list(std::string_view text) {
  std::vector<std::string_view> elements;
  bool is_quoted = false;
  std::size_t start = 0;
  const auto take = [&](std::size_t end) {
    const std::string_view element = trim(text.substr(start, end - start));
    if (!element.empty()) {
      elements.push_back(element);
    }
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') {
      is_quoted = !is_quoted;
    } else if (text[i] == ',' && !is_quoted) {
      take(i);
      start = i + 1;
    }
  }
  take(text.size());
  return elements;
}

std::optional<std::string> percent_decode(std::string_view text, PlusSign plus) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+' && plus == PlusSign::kIsSpace) {
      decoded += ' ';
    } else if (text[i] != '%') {
      decoded += text[i];
    } else {
      if (i + 2 >= text.size()) {
        return std::nullopt;
      }
      const int high = core::hex_digit(text[i + 1]);
      const int low = core::hex_digit(text[i + 2]);
      if (high < 0 || low < 0 || (high == 0 && low == 0)) {
        return std::nullopt;
      }
      decoded += static_cast<char>(high * 16 + low);
      i += 2;
    }
  }
  return decoded;
}

std::optional<std::vector<std::pair<std::string, std::string>>> parse_query(std::string_view text) {
  std::vector<std::pair<std::string, std::string>> params;
  while (!text.empty()) {
    const std::size_t end = text.find('&');
    const std::string_view part = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    if (part.empty()) {
      continue;
    }
    const std::size_t equals = part.find('=');
    auto name = percent_decode(part.substr(0, equals), PlusSign::kIsSpace);
    std::string_view text_of_value =
        equals == std::string_view::npos ? std::string_view() : part.substr(equals + 1);
    const bool is_percentage = ends_with_percentage(text_of_value);
    text_of_value.remove_suffix(is_percentage ? 1 : 0);
    auto value = percent_decode(text_of_value, PlusSign::kIsSpace);
    if (!name || !value) {
      return std::nullopt;
    }
    *value += is_percentage ? "%" : "";
    params.emplace_back(std::move(*name), std::move(*value));
  }
  return params;
}

std::optional<std::string> base_path(std::string_view text) {
  constexpr std::array<std::string_view, 3> kSteps = {"//", "/./", "/../"};
  while (text.ends_with('/')) {
    text.remove_suffix(1);
  }
  const std::string whole = std::string(text) + "/";
  const bool has_steps = std::any_of(kSteps.begin(), kSteps.end(), [&](std::string_view step) {
    return whole.find(step) != std::string::npos;
  });
  const bool is_path = text.empty() || text.front() == '/';
  return core::is_word(text, "/-._~") && is_path && !has_steps ? std::optional<std::string>(text)
                                                               : std::nullopt;
}

std::string media_type(std::string_view content_type) {
  return core::in_lower_case(trim(content_type.substr(0, content_type.find(';'))));
}

}  // namespace server
