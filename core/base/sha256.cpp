#include "core/base/sha256.h"

#include <array>
#include <span>

#include <openssl/evp.h>

#include "core/base/check.h"
#include "core/base/text.h"

namespace core {

struct Sha256::Impl {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
};

Sha256::Sha256() : impl_(std::make_unique<Impl>()) {
  CHECK(EVP_DigestInit_ex(impl_->context, EVP_sha256(), nullptr) == 1);
}

Sha256::~Sha256() { EVP_MD_CTX_free(impl_->context); }

void Sha256::add(const void* data, std::size_t bytes) {
  CHECK(EVP_DigestUpdate(impl_->context, data, bytes) == 1);
}

std::string Sha256::hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  CHECK(EVP_DigestFinal_ex(impl_->context, digest.data(), &size) == 1);
  return core::hex(std::span(digest).first(size));
}

std::string sha256_hex(const void* data, std::size_t bytes) {
  Sha256 hash;
  hash.add(data, bytes);
  return hash.hex();
}

}  // namespace core
