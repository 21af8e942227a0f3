/// Proactive negotiation (RFC 9110 section 12.5): Accept, Accept-Encoding.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace server {

/// Index of the offered media type that `accept` likes best; among equals the first offered.
/// An empty header accepts everything. Empty result: nothing fits, 406. A malformed element or
/// quality counts as not there. Offers are plain types in lower case: "image/png".
std::optional<std::size_t> negotiate_media_type(std::string_view accept,
                                                std::span<const std::string_view> offers);

/// True if `accept_encoding` names the coding (or `*`) with a quality above 0.
bool accepts_encoding(std::string_view accept_encoding, std::string_view coding);

}  // namespace server
