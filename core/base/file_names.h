/// Compares names of files as Windows and macOS do, whose scenes name files in ways that differ by
/// bytes from what a disk or an archive holds.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace core {

/// Returns a name with `/` for `\`.
std::string with_slashes(std::string_view name);

/// Returns a name with `/` for `\`, composed (NFC) and in folded case: equal for names that Windows
/// or macOS would take for the same file. Text that is not UTF-8 keeps its bytes.
std::string folded_name(std::string_view name);

/// Returns the part after the last `/` or `\`.
std::string_view last_part(std::string_view name);

bool is_utf8(std::string_view text);

/// Returns a relative name without `.`, `..` and empty parts (RFC 3986, 5.2.4); empty if it is
/// absolute or leads out of its folder.
std::optional<std::string> plain_name(std::string_view name);

/// Decodes percent escapes (%41 becomes A); malformed ones stay unchanged.
std::string percent_decode(std::string_view text);
/// Escapes all but the unreserved characters of RFC 3986, 2.3.
std::string percent_encode(std::string_view text);

/// A list of names, in which a name is found as it is, else by folded_name() if only one is the
/// same.
class FileNames {
 public:
  void add(const std::string& name);
  /// Returns the number of the name in the order of add(); empty if none or several are the same.
  std::optional<std::size_t> find(std::string_view name) const;
  /// Returns a text such as `; there is "b.PNG"` of at most three names whose last part differs by
  /// case, escapes or composition only; empty: there are none.
  std::string near(std::string_view name) const;

 private:
  std::size_t count_ = 0;
  std::map<std::string, std::size_t, std::less<>> exact_;
  std::map<std::string, std::optional<std::size_t>, std::less<>> folded_;  ///< empty: several
  std::multimap<std::string, std::string, std::less<>> near_;
};

}  // namespace core
