/// Names in zip archives.
#pragma once

#include <string>
#include <string_view>

namespace core {

/// Returns the name in UTF-8, with `/` for `\`, which some programs for Windows write. Without the
/// flag for UTF-8 it is in code page 437, unless it is UTF-8 all the same. Source: APPNOTE.TXT
/// 6.3.3, 4.4.17 and appendix D.
std::string zip_name(std::string_view stored, bool is_utf8);

/// Returns whether a name is relative and plain: not empty, no `.` and `..` parts, no control
/// characters.
bool is_safe_name(std::string_view name);

/// Returns whether a file is one in which macOS keeps what belongs to another file.
bool is_from_macos(std::string_view name);

}  // namespace core
