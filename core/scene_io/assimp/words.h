/// Lines and words of text files.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>
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

/// The lines of a text.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  /// Goes to the next line; false at the end.
  bool next() {
    if (text_.empty()) {
      return false;
    }
    const std::size_t end = std::min(text_.find('\n'), text_.size());
    line_ = text_.substr(0, end);
    text_.remove_prefix(std::min(end + 1, text_.size()));
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

}  // namespace core
