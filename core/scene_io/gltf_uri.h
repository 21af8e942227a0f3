/// URIs in glTF files: data URIs are decoded, everything else is a relative name.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

bool is_data_uri(std::string_view uri) noexcept;

/// Bytes of a data URI, base64 or percent-encoded. Errors: kInvalidArgument without a place.
Result<Bytes> decode_data_uri(std::string_view uri);

/// %41 becomes A; malformed escapes stay as they are.
std::string percent_decode(std::string_view text);

/// True for "http://...", "file:...", and other names that are not relative.
bool has_scheme(std::string_view uri) noexcept;

/// At most the first 200 bytes, for messages.
std::string shown_uri(std::string_view uri);

/// kMissingFiles: `words`, and as many of the names as make a message, which is 4 kB at most.
Error missing_files(std::string_view words, const std::vector<std::string>& uris);

}  // namespace core
