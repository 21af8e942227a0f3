/// WebhookSender: makes the calls that jobs have asked for, signed as Standard Webhooks 1.0 does.
///
/// The calls stand in the store with the event that caused them, so that none is lost. One that is
/// not answered with 2xx is made again, eight times in all, after longer and longer waits; 410 ends
/// it. The receiver may get a call twice and knows it by its webhook-id.
///
/// Calls to different receivers (tenant, scheme, host and port) are under way at the same time,
/// those to one receiver one after another, and those of one job to one address in the order of its
/// events. A receiver that does not answer holds up nobody else.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/http/web_post.h"
#include "server/observe/log.h"
#include "server/observe/metrics.h"
#include "server/store/delivery_table.h"
#include "server/webhook_secrets.h"

namespace server {

/// Seconds to wait after that many failed attempts; empty: it is given up.
std::optional<double> webhook_wait_seconds(int attempts);

/// What the sender is built on; all outlive it.
struct WebhookParts {
  DeliveryTable& table;
  WebhookSecrets& secrets;
  Log& log;
  Metrics& metrics;
};

class WebhookSender {
 public:
  WebhookSender(WebhookParts parts, Reach reach);
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;
  WebhookSender& operator=(const WebhookSender&) = delete;

  /// Breaks off what is under way; it stays in the store, to be sent by the next process.
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
  WebCalls calls_;
  std::map<std::string, DeliveryRow> open_;  ///< By receiver; of the thread alone.
  double rests_until_ = 0;  ///< The store cannot be written: calls would be made again and again.
  double forgot_at_ = 0;
  std::jthread thread_;
};

}  // namespace server
