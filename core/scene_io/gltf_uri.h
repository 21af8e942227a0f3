/// URIs in glTF files: data URIs are decoded; others are relative names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

bool is_data_uri(std::string_view uri) noexcept;

/// Returns the bytes of a data URI (RFC 2397): percent-encoded, and base64 with or without line
/// breaks if one of its parameters says so. Errors: kInvalidArgument without a location.
Result<Bytes> decode_data_uri(std::string_view uri);

/// Decodes percent escapes (%41 becomes A); malformed ones stay unchanged.
std::string percent_decode(std::string_view text);

/// Returns true for "http://...", "file:..." and other names that are not relative.
bool has_scheme(std::string_view uri) noexcept;

/// Returns at most the first 200 bytes, for messages.
std::string shown_uri(std::string_view uri);

/// Returns kMissingFiles with `words` and as many of the names as fit in 4 kB.
Error missing_files(std::string_view words, const std::vector<std::string>& uris);

}  // namespace core
