/// Signatures of image URLs: HMAC-SHA256 (RFC 2104), in base64url without padding (RFC 4648,
/// section 5); uses OpenSSL.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <openssl/hmac.h>

#include "core/base/base64.h"
#include "core/base/check.h"

namespace core {

/// Characters of a signature: 256 bits, six in each.
constexpr std::size_t kSignatureSize = 43;

inline std::string encode_base64url(std::span<const std::byte> bytes) {
  std::string text = encode_base64(bytes);
  std::replace(text.begin(), text.end(), '+', '-');
  std::replace(text.begin(), text.end(), '/', '_');
  text.erase(std::min(text.find('='), text.size()));
  return text;
}

/// key: as POST /v1/signing-keys gave it. signed_part: of the URL, all that follows the signature,
/// with the slash and the query.
inline std::string url_signature(std::string_view key, std::string_view signed_part) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  CHECK(HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
             reinterpret_cast<const unsigned char*>(signed_part.data()), signed_part.size(),
             digest.data(), &length) != nullptr);
  return encode_base64url(std::as_bytes(std::span(digest).first(length)));
}

}  // namespace core
