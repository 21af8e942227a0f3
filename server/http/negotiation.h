/// Proactive negotiation (RFC 9110 section 12.5): Accept, Accept-Encoding.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace server {

/// Returns the index of the offered media type that `accept` prefers; among equals the one that it
/// names first, or else the first offer, if it names none. An empty header accepts everything.
/// Returns empty when nothing fits: 406. Malformed elements or qualities are ignored. Offers are
/// plain types in lower case: "image/png".
std::optional<std::size_t> negotiate_media_type(std::string_view accept,
                                                std::span<const std::string_view> offers);

/// True if `accept_encoding` names the coding (or `*`) with a quality above 0.
bool accepts_encoding(std::string_view accept_encoding, std::string_view coding);

}  // namespace server
