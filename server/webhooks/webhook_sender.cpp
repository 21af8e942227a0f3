#include "server/webhooks/webhook_sender.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "server/observe/clock.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

constexpr std::chrono::milliseconds kPoll{500};
/// Limits on concurrent calls, each of which holds a socket and its body. Unresponsive receivers
/// hold theirs for the whole deadline; those of one tenant must not block the others.
constexpr std::size_t kOpenMax = 256;
constexpr int kOpenOfTenantMax = 32;
/// How long ended calls are kept in the list.
constexpr double kKeptSeconds = 7 * kDaySeconds;
constexpr double kForgetSeconds = 600;
constexpr double kRestSeconds = 30;
/// Time between checks for calls whose next attempt a changed clock has put too far ahead. Short
/// beside the pauses between attempts.
constexpr double kMendSeconds = 20;
/// About the delays of the specification's example, with an earlier second attempt.
constexpr std::array kWaitSeconds = {1.0, 5.0, 30.0, 300.0, 1800.0, 7200.0, 18000.0};

}  // namespace

std::optional<double> webhook_wait_seconds(int attempts) {
  const auto index = static_cast<std::size_t>(attempts - 1);
  return index < kWaitSeconds.size() ? std::optional<double>(kWaitSeconds[index]) : std::nullopt;
}

WebhookSender::WebhookSender(WebhookParts parts, std::unique_ptr<WebCaller> calls, Reach reach)
    : table_(parts.table),
      secrets_(parts.secrets),
      log_(parts.log),
      metrics_(parts.metrics),
      reach_(reach),
      calls_(std::move(calls)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

WebhookSender::~WebhookSender() { stop(); }

void WebhookSender::stop() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void WebhookSender::run(const std::stop_token& stop) {
  const std::stop_callback wake(stop, [this] { calls_->wake(); });
  while (!stop.stop_requested()) {
    begin_due();
    for (const WebCaller::Ended& ended : calls_->wait(kPoll)) {
      const auto found = std::find_if(open_.begin(), open_.end(),
                                      [&](const auto& call) { return call.second.id == ended.id; });
      DeliveryRow row = std::move(found->second);
      open_.erase(found);
      finish(std::move(row), ended.status);
    }
    forget_old();
  }
}

std::size_t WebhookSender::open_count_of(const std::string& tenant) const {
  return static_cast<std::size_t>(std::count_if(
      open_.begin(), open_.end(), [&](const auto& call) { return call.second.tenant == tenant; }));
}

void WebhookSender::begin_due() {
  const double now = unix_now();
  if (now < rests_until_ && rests_until_ <= now + kRestSeconds) {
    return;
  }
  if (now < mended_at_ || now > mended_at_ + kMendSeconds) {
    for (int attempts = 0; attempts <= static_cast<int>(kWaitSeconds.size()); ++attempts) {
      const double wait = attempts == 0 ? 0 : webhook_wait_seconds(attempts).value_or(0);
      static_cast<void>(table_.bring_forward(attempts, now, wait));  // Retried later.
    }
    mended_at_ = now;
  }
  const auto due = table_.due(now, kOpenOfTenantMax);
  for (const DeliveryRow& row : due ? *due : std::vector<DeliveryRow>()) {
    if (open_.size() < kOpenMax && !open_.contains(row.receiver) &&
        open_count_of(row.tenant) < kOpenOfTenantMax) {
      begin(row);
    }
  }
}

void WebhookSender::begin(const DeliveryRow& row) {
  const auto secret = secrets_.of(row.tenant);
  const auto key = secret ? webhook_key(*secret) : std::nullopt;
  if (!key || !parse_web_target(row.url)) {
    finish(row, Error{ErrorCode::kInvalidArgument,
                      key      ? "not an address: " + row.url
                      : secret ? "the secret is not whsec_ and base64"
                               : secret.error().message,
                      ""});
    return;
  }
  const auto timestamp = static_cast<std::int64_t>(unix_now());
  WebPost post;
  post.url = row.url;
  post.body = row.body;
  post.headers = {{"Content-Type", "application/json"},
                  {"User-Agent", "Tessera"},
                  {"webhook-id", row.id},
                  {"webhook-timestamp", std::to_string(timestamp)},
                  {"webhook-signature", webhook_signature(*key, row.id, timestamp, row.body)}};
  post.reach = reach_;
  calls_->begin(row.id, post);
  open_[row.receiver] = row;
}

void WebhookSender::finish(DeliveryRow row, const core::Result<int>& status) {
  row.attempts += 1;
  row.status = status ? *status : 0;
  const bool delivered = status && *status >= 200 && *status < 300;
  const bool refused =
      (status && *status == 410) || (!status && status.error().code == ErrorCode::kForbidden);
  // A test reports its outcome at once.
  const auto wait =
      refused || row.event == "test" ? std::nullopt : webhook_wait_seconds(row.attempts);
  row.detail = !status     ? status.error().message
               : delivered ? std::string()
                           : "status " + std::to_string(*status);
  if (delivered || !wait) {
    row.state = delivered ? "delivered" : "failed";
    row.ended_at = unix_now();
  } else {
    row.next_at = unix_now() + *wait;
  }
  const bool given_up = row.state == "failed";
  metrics_.count(delivered  ? Counter::kWebhookDelivered
                 : given_up ? Counter::kWebhookGivenUp
                            : Counter::kWebhookFailed);
  // If the store refuses, the call is made again; its receiver can recognize the repetition.
  const core::Status kept = table_.update(row);
  rests_until_ = kept ? rests_until_ : unix_now() + kRestSeconds;
  log_.write(
      given_up ? LogLevel::kWarning : LogLevel::kInfo,
      delivered  ? "webhook_delivered"
      : given_up ? "webhook_given_up"
                 : "webhook_failed",
      {{"job", row.job},
       {"webhook_id", row.id},
       {"attempt", std::int64_t{row.attempts}},
       {"detail", kept ? std::string_view(row.detail) : std::string_view(kept.error().message)}});
}

void WebhookSender::forget_old() {
  const double now = unix_now();
  if (now - forgot_at_ > kForgetSeconds && table_.forget_before(now - kKeptSeconds)) {
    forgot_at_ = now;
  }
}

}  // namespace server
