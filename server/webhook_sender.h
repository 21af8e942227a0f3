/// WebhookSender: makes the calls that jobs have asked for, signed as Standard Webhooks 1.0 does.
///
/// The calls stand in the store with the event that caused them, so that none is lost. One that is not
/// answered with 2xx is made again, eight times in all, after longer and longer waits; 410 ends it. The
/// receiver may get a call twice and knows it by its webhook-id.
#pragma once

#include <chrono>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "core/base/mutex.h"
#include "server/http/web_post.h"
#include "server/jobs/background.h"
#include "server/observe/log.h"
#include "server/store/job_table.h"

namespace server {

/// "whsec_" and base64 of at least 16 bytes; empty when it is not that.
std::optional<std::string> webhook_key(std::string_view secret);
/// The secret of a data directory, made when there is none: its file webhook.secret.
core::Result<std::string> stored_webhook_secret(const std::string& directory);
/// "v1," and base64 of the HMAC-SHA256 of "id.timestamp.body". key: as webhook_key() gives it.
std::string webhook_signature(std::string_view key, std::string_view id, std::int64_t timestamp,
                              std::string_view body);
/// Seconds to wait after that many failed attempts; empty: it is given up.
std::optional<double> webhook_wait_seconds(int attempts);

class WebhookSender {
 public:
  /// table and log must outlive it. key: as webhook_key() gives it.
  WebhookSender(JobTable& table, Log& log, std::string key, Reach reach);
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;
  WebhookSender& operator=(const WebhookSender&) = delete;

  /// Begins no more calls; what was not sent stays in the store.
  void stop();

 private:
  void look(const std::stop_token& stop);
  void deliver(const DeliveryRow& row);
  void finish(const DeliveryRow& row, const core::Result<int>& status);

  JobTable& table_;
  Log& log_;
  const std::string key_;
  const Reach reach_;
  std::stop_source stop_;
  core::Mutex mutex_;
  std::set<std::string> in_flight_ GUARDED_BY(mutex_);
  Background callers_;
  std::jthread looker_;
};

}  // namespace server
