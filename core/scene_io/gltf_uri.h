/// URIs in glTF files: data URIs are decoded, everything else is a relative name.
#pragma once

#include <optional>
#include <string>
#include <string_view>

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

}  // namespace core
