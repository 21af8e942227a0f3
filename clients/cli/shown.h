/// Texts of others in a terminal.
#pragma once

#include <string>
#include <string_view>

namespace cli {

/// Returns the text with characters that control a terminal, or the direction of the text around
/// them, as "\u{1b}": names in scenes and texts of servers may hold any. Keeps line feeds and tabs.
/// Bytes that are not UTF-8 become U+FFFD. Source of the direction marks: Unicode, UAX #9.
std::string shown(std::string_view text);

}  // namespace cli
