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

/// Returns true for "http://...", "file:..." and other names that are not relative.
bool has_scheme(std::string_view uri) noexcept;

/// Returns at most the first 200 bytes, for messages.
std::string shown_uri(std::string_view uri);

/// Returns kMissingFiles with as many of the names as fit in 4 kB; first with those that lead out
/// of the scene's folder.
Error missing_files(const std::vector<std::string>& names, const std::vector<std::string>& outside);

}  // namespace core
