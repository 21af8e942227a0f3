/// Base64 as in RFC 4648, section 4, with padding; uses OpenSSL.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <openssl/evp.h>

namespace core {

/// bytes: less than 1.5 GB, because the library counts characters in an int.
inline std::string encode_base64(std::span<const std::byte> bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');  // plus the terminating zero
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                     reinterpret_cast<const unsigned char*>(bytes.data()),
                                     static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(length));
  return text;
}

}  // namespace core
