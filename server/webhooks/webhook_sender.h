/// WebhookSender: makes the calls that jobs have requested, signed as in Standard Webhooks 1.0.
///
/// Calls are stored together with the event that causes them, so that none is lost. A call without
/// a 2xx response is repeated, eight times in all, with increasing delays; 410 ends it. A receiver
/// may get a call twice and recognizes it by its webhook-id.
///
/// Calls to different receivers (tenant, scheme, host and port) run concurrently, those to one
/// receiver one after another, and those of one job to one address in the order of its events. A
/// receiver that does not respond delays no other.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "server/http/web_post.h"
#include "server/observe/log.h"
#include "server/observe/metrics.h"
#include "server/store/delivery_table.h"
#include "server/webhooks/webhook_secrets.h"

namespace server {

/// Returns the delay after that many failed attempts; empty: no further attempt.
std::optional<double> webhook_wait_seconds(int attempts);

/// Dependencies of the sender; all must outlive it.
struct WebhookParts {
  DeliveryTable& table;
  WebhookSecrets& secrets;
  Log& log;
  Metrics& metrics;
};

class WebhookSender {
 public:
  WebhookSender(WebhookParts parts, std::unique_ptr<WebCaller> calls, Reach reach);
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;
  WebhookSender& operator=(const WebhookSender&) = delete;

  /// Aborts calls in progress; they stay in the store for the next process.
  void stop();

 private:
  void run(const std::stop_token& stop);
  void begin_due();
  void begin(const DeliveryRow& row);
  void finish(DeliveryRow row, const core::Result<int>& status);
  void forget_old();
  std::size_t open_count_of(const std::string& tenant) const;

  DeliveryTable& table_;
  WebhookSecrets& secrets_;
  Log& log_;
  Metrics& metrics_;
  const Reach reach_;
  const std::unique_ptr<WebCaller> calls_;
  std::map<std::string, DeliveryRow> open_;  ///< Deliveries by receiver; used only by the thread.
  double rests_until_ =
      0;  ///< Pause after the store failed, since calls would be repeated again and again.
  double forgot_at_ = 0;
  double mended_at_ = 0;
  std::jthread thread_;
};

}  // namespace server
