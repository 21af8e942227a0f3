/// Secrets that sign webhooks, as in Standard Webhooks 1.0: each tenant has its own; the operator's
/// is a flag or a file of the data directory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "server/store/delivery_table.h"

namespace server {

/// Parses "whsec_" and base64 of at least 16 bytes; empty if it is invalid.
std::optional<std::string> webhook_key(std::string_view secret);
/// Returns the secret in the file webhook.secret of a data directory. Empty: there is none. Errors:
/// kInvalidArgument if it is not the one whose hash is in webhook.secret-mark.
core::Result<std::optional<std::string>> read_webhook_secret(const std::string& directory);
/// The same; creates the files that are missing.
core::Result<std::string> stored_webhook_secret(const std::string& directory);
/// Returns "v1," and base64 of the HMAC-SHA256 of "id.timestamp.body". key: from webhook_key().
std::string webhook_signature(std::string_view key, std::string_view id, std::int64_t timestamp,
                              std::string_view body);

class WebhookSecrets {
 public:
  /// operators: a secret that webhook_key() accepts. is_shared: signs the calls of all tenants with
  /// it. table must outlive this.
  WebhookSecrets(DeliveryTable& table, std::string operators, bool is_shared)
      : table_(table), operators_(std::move(operators)), is_shared_(is_shared) {}

  /// Returns the tenant's secret, created at the first use.
  core::Result<std::string> of(const std::string& tenant);
  /// Creates a new secret for all later calls. Errors: kConflict for the operator's.
  core::Result<std::string> replace(const std::string& tenant);

 private:
  bool is_operators(const std::string& tenant) const { return tenant.empty() || is_shared_; }

  DeliveryTable& table_;
  const std::string operators_;
  const bool is_shared_;
};

}  // namespace server
