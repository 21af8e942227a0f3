/// Protocol between a server and its helper process `tessera denoise`, on one socket: a request,
/// its planes, an answer, its planes or a text. Both are the same program on the same machine.
#pragma once

#include <cstdint>

namespace core {

struct OidnRequest {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t pictures = 0;      ///< each width * height * 3 floats
  std::uint32_t has_features = 0;  ///< albedo and normal follow, with as many floats each
  std::uint32_t threads = 0;
};

struct OidnAnswer {
  std::uint32_t version = 0;     ///< of the library, 20501 for 2.5.1
  char sha256[64] = {};          ///< hex, of the file with its weights
  std::uint32_t text_bytes = 0;  ///< not 0: it failed, and a text follows instead of images
};

}  // namespace core
