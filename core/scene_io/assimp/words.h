/// Lines, words and numbers of text files.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/base/text.h"
#include "core/scene_io/gltf_load.h"

namespace core {

constexpr std::string_view kSpaces = " \t\r\v\f";

inline std::string_view trimmed(std::string_view text) { return trimmed(text, " \t\r\v\f\n"); }

inline std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> out;
  for (std::size_t at = text.find_first_not_of(kSpaces); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpaces, at), text.size());
    out.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(kSpaces, end);
  }
  return out;
}

/// Returns the number that a word is; empty: it is none. The decimal sign may be a comma, as
/// libassimp reads it.
inline std::optional<double> number_in(std::string_view word) {
  if (word.starts_with("1.#") || word.starts_with("-1.#")) {  // by older C libraries of Windows
    return std::numeric_limits<double>::quiet_NaN();
  }
  word.remove_prefix(word.starts_with('+') ? 1 : 0);
  std::string with_point;
  if (word.find(',') != std::string_view::npos) {
    with_point = word;
    std::replace(with_point.begin(), with_point.end(), ',', '.');
    word = with_point;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::invalid_argument || end != word.data() + word.size()) {
    return std::nullopt;
  }
  if (error == std::errc::result_out_of_range) {
    const bool is_tiny = in_lower_case(word).find("e-") != std::string::npos;
    return is_tiny ? 0 : std::numeric_limits<double>::infinity();
  }
  return value;
}

/// Whether libassimp's numbers, floats, hold it.
inline bool is_in_float(double value) {
  return std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max());
}

/// Whether a word is a number, and which kind.
enum class Number { kFinite, kNotFinite, kNone };

inline Number number_of(std::string_view word) {
  const auto value = number_in(word);
  return !value ? Number::kNone : is_in_float(*value) ? Number::kFinite : Number::kNotFinite;
}

constexpr std::size_t kWordMost = 4095;  ///< bytes: libassimp's buffer of a word

/// Returns an error text for a word that is not a finite number.
inline std::string fault_of_number(std::size_t line, std::string_view word) {
  constexpr std::size_t kShown = 40;  // bytes
  return "line " + std::to_string(line) + ": " + std::string(word.substr(0, kShown)) +
         (number_of(word) == Number::kNotFinite ? " is not a finite number" : " is not a number");
}

/// The lines of a text, which end in \n, \r or both.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  /// Goes to the next line; false at the end.
  bool next() {
    if (text_.empty()) {
      return false;
    }
    const std::size_t end = std::min(text_.find_first_of("\r\n"), text_.size());
    line_ = text_.substr(0, end);
    const std::size_t both = text_.substr(end).starts_with("\r\n") ? 2 : 1;
    text_.remove_prefix(std::min(end + both, text_.size()));
    ++number_;
    return true;
  }
  std::string_view line() const { return line_; }
  std::size_t number() const { return number_; }  ///< of this line, from 1
  std::string_view rest() const { return text_; }

 private:
  std::string_view text_;
  std::string_view line_;
  std::size_t number_ = 0;
};

inline std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline Bytes bytes_of(std::string_view text) {
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  return Bytes(first, first + text.size());
}

/// Returns a name without the quotes around it.
inline std::string_view unquoted(std::string_view name) {
  const bool is_quoted = name.size() > 2 && name.front() == '"' && name.back() == '"';
  return is_quoted ? name.substr(1, name.size() - 2) : name;
}

}  // namespace core
