#include "core/base/file_names.h"

#include <algorithm>
#include <cstdlib>

#include <utf8proc.h>

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
  ++count_;
}

std::optional<std::size_t> FileNames::find(std::string_view name) const {
  if (const auto same = exact_.find(name); same != exact_.end()) {
    return same->second;
  }
  const auto alike = folded_.find(folded_name(name));
  return alike == folded_.end() ? std::nullopt : alike->second;
}

}  // namespace core
