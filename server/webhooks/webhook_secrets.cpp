#include "server/webhooks/webhook_secrets.h"

#include <array>
#include <span>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

#include "core/base/base64.h"
#include "core/base/check.h"
#include "core/base/sha256.h"
#include "server/store/files.h"

namespace server {
namespace {

constexpr std::string_view kPrefix = "whsec_";
constexpr std::size_t kSecretCharactersMax = 256;
constexpr const char* kFile = "/webhook.secret";

std::string fresh_webhook_secret() {
  std::array<unsigned char, 24> random{};
  CHECK(RAND_bytes(random.data(), static_cast<int>(random.size())) == 1);
  return std::string(kPrefix) + core::encode_base64(std::as_bytes(std::span(random)));
}

/// The line of the file beside the secret, by which changes are noticed.
std::string mark_of(const std::string& secret) {
  return seal(core::sha256_hex(secret.data(), secret.size()));
}

/// Returns the file's text without its end of line; empty if there is none.
core::Result<std::string> line_of(const std::string& path) {
  const auto file = open_file(path, O_RDONLY);
  if (!file) {
    return file.error().code == core::ErrorCode::kNotFound ? core::Result<std::string>("")
                                                           : file.error();
  }
  std::string line(kSecretCharactersMax, '\0');
  const auto got = read_at(file->get(), std::as_writable_bytes(std::span(line)), 0, path);
  line.resize(got ? *got : 0);
  while (!line.empty() && line.back() == '\n') {
    line.pop_back();
  }
  return got ? core::Result<std::string>(line) : got.error();
}

core::Status write_line(const std::string& path, const std::string& line) {
  const auto file = open_file(path, O_RDWR | O_CREAT);
  if (!file) {
    return file.error();
  }
  const core::Status written = write_at(file->get(), std::as_bytes(std::span(line)), 0, path);
  return written ? sync_file(file->get(), path) : written;
}

}  // namespace

std::optional<std::string> webhook_key(std::string_view secret) {
  constexpr std::size_t kKeyBytesMin = 16;
  if (secret.substr(0, kPrefix.size()) != kPrefix || secret.size() > kSecretCharactersMax) {
    return std::nullopt;
  }
  secret.remove_prefix(kPrefix.size());
  std::vector<unsigned char> key(secret.size() / 4 * 3 + 3);
  const int length =
      EVP_DecodeBlock(key.data(), reinterpret_cast<const unsigned char*>(secret.data()),
                      static_cast<int>(secret.size()));
  if (secret.size() % 4 != 0 || length < 0) {
    return std::nullopt;
  }
  // The library counts the padding as bytes.
  std::size_t padding = 0;
  while (padding < 2 && padding < secret.size() && secret[secret.size() - 1 - padding] == '=') {
    ++padding;
  }
  key.resize(static_cast<std::size_t>(length) - padding);
  return key.size() >= kKeyBytesMin
             ? std::optional<std::string>(std::in_place, key.begin(), key.end())
             : std::nullopt;
}

core::Result<std::optional<std::string>> read_webhook_secret(const std::string& directory) {
  const std::string path = directory + kFile;
  const auto secret = line_of(path);
  const auto mark = line_of(path + "-mark");
  if (!secret || !mark) {
    return secret ? mark.error() : secret.error();
  }
  const bool is_as_written = mark->empty() || *mark == mark_of(*secret);
  if (!secret->empty() && (!is_as_written || !webhook_key(*secret))) {
    return core::Error{core::ErrorCode::kInvalidArgument,
                       "is damaged, or was changed: it must hold whsec_ and the base64 of at least "
                       "16 bytes. Write the secret into it again and remove webhook.secret-mark, "
                       "or remove both and a new secret is made",
                       path};
  }
  return secret->empty() ? std::nullopt : std::optional(*secret);
}

core::Result<std::string> stored_webhook_secret(const std::string& directory) {
  const auto known = read_webhook_secret(directory);
  if (!known) {
    return known.error();
  }
  const std::string secret = *known ? **known : fresh_webhook_secret();
  const std::string path = directory + kFile;
  core::Status kept = *known ? core::ok_status() : write_line(path, secret);
  kept = kept ? write_line(path + "-mark", mark_of(secret)) : kept;
  // Receivers are given the secret: a power failure must not take its file back.
  kept = kept ? sync_directory(directory) : kept;
  return kept ? core::Result<std::string>(secret) : kept.error();
}

std::string webhook_signature(std::string_view key, std::string_view id, std::int64_t timestamp,
                              std::string_view body) {
  std::string message(id);
  message += '.';
  message += std::to_string(timestamp);
  message += '.';
  message += body;
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  CHECK(HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
             reinterpret_cast<const unsigned char*>(message.data()), message.size(), digest.data(),
             &length) != nullptr);
  return "v1," + core::encode_base64(std::as_bytes(std::span(digest).first(length)));
}

core::Result<std::string> WebhookSecrets::of(const std::string& tenant) {
  if (is_operators(tenant)) {
    return operators_;
  }
  return table_.secret(tenant, fresh_webhook_secret());
}

core::Result<std::string> WebhookSecrets::replace(const std::string& tenant) {
  if (is_operators(tenant)) {
    return core::Error{core::ErrorCode::kConflict,
                       "this secret is set by --webhook-secret, or by the file webhook.secret in "
                       "the data directory",
                       ""};
  }
  std::string secret = fresh_webhook_secret();
  if (const auto kept = table_.replace_secret(tenant, secret); !kept) {
    return kept.error();
  }
  return secret;
}

}  // namespace server
