#include "server/webhook_sender.h"

#include <array>
#include <cmath>
#include <condition_variable>
#include <span>
#include <utility>

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

#include "core/base/base64.h"
#include "server/observe/clock.h"
#include "server/store/files.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

constexpr std::string_view kPrefix = "whsec_";
constexpr std::chrono::milliseconds kLook{500};
constexpr int kCallers = 4;
constexpr int kAtATime = 32;
/// About those of the specification's example, with a second try that comes sooner.
constexpr std::array kWaitSeconds = {1.0, 5.0, 30.0, 300.0, 1800.0, 7200.0, 18000.0};

}  // namespace

std::optional<std::string> webhook_key(std::string_view secret) {
  constexpr std::size_t kKeyBytesMin = 16;
  constexpr std::size_t kSecretCharactersMax = 256;
  if (secret.substr(0, kPrefix.size()) != kPrefix || secret.size() > kSecretCharactersMax) {
    return std::nullopt;
  }
  secret.remove_prefix(kPrefix.size());
  std::string key(secret.size() / 4 * 3 + 3, '\0');
  const int length = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(key.data()),
                                     reinterpret_cast<const unsigned char*>(secret.data()),
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
  return key.size() >= kKeyBytesMin ? std::optional<std::string>(std::move(key)) : std::nullopt;
}

core::Result<std::string> stored_webhook_secret(const std::string& directory) {
  const std::string path = directory + "/webhook.secret";
  auto file = open_file(path, O_RDWR | O_CREAT);
  if (!file) {
    return file.error();
  }
  std::string secret(256, '\0');
  const auto got = read_at(file->get(), std::as_writable_bytes(std::span(secret)), 0, path);
  if (!got) {
    return got.error();
  }
  secret.resize(*got);
  while (!secret.empty() && secret.back() == '\n') {
    secret.pop_back();
  }
  if (!secret.empty()) {
    return secret;
  }
  std::array<unsigned char, 24> random{};
  CHECK(RAND_bytes(random.data(), static_cast<int>(random.size())) == 1);
  secret = std::string(kPrefix) + core::encode_base64(std::as_bytes(std::span(random)));
  if (const auto written = write_at(file->get(), std::as_bytes(std::span(secret)), 0, path); !written) {
    return written.error();
  }
  if (const auto synced = sync_file(file->get(), path); !synced) {
    return synced.error();
  }
  return secret;
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

std::optional<double> webhook_wait_seconds(int attempts) {
  const auto index = static_cast<std::size_t>(attempts - 1);
  return index < kWaitSeconds.size() ? std::optional<double>(kWaitSeconds[index]) : std::nullopt;
}

WebhookSender::WebhookSender(JobTable& table, Log& log, std::string key, Reach reach)
    : table_(table),
      log_(log),
      key_(std::move(key)),
      reach_(reach),
      callers_(kCallers),
      looker_([this](const std::stop_token& stop) { look(stop); }) {}

WebhookSender::~WebhookSender() { stop(); }

void WebhookSender::stop() {
  looker_.request_stop();
  stop_.request_stop();
  if (looker_.joinable()) {
    looker_.join();
  }
  callers_.stop(Background::Waiting::kDrop);
}

void WebhookSender::look(const std::stop_token& stop) {
  core::Mutex mutex;
  core::CondVar never;
  while (!stop.stop_requested()) {
    {
      const core::MutexLock lock(mutex);
      never.wait_for(mutex, stop, kLook, [] { return false; });
    }
    // Looked at before the store: a call that ends while the store is read may still stand in the
    // rows, and is not to be made again.
    std::set<std::string> under_way;
    {
      const core::MutexLock lock(mutex_);
      under_way = in_flight_;
    }
    const auto due = table_.due_deliveries(unix_now(), kAtATime);
    if (!due || stop.stop_requested()) {
      continue;
    }
    for (const DeliveryRow& row : *due) {
      if (under_way.contains(row.id)) {
        continue;
      }
      {
        const core::MutexLock lock(mutex_);
        in_flight_.insert(row.id);
      }
      callers_.post([this, row] { deliver(row); });
    }
  }
}

void WebhookSender::deliver(const DeliveryRow& row) {
  const auto target = parse_web_target(row.url);
  core::Result<int> status = Error{ErrorCode::kInvalidArgument, "not an address", row.url};
  if (target) {
    const auto timestamp = static_cast<std::int64_t>(unix_now());
    WebPost post;
    post.body = row.body;
    post.content_type = "application/json";
    post.headers = {{"webhook-id", row.id},
                    {"webhook-timestamp", std::to_string(timestamp)},
                    {"webhook-signature", webhook_signature(key_, row.id, timestamp, row.body)},
                    {"User-Agent", "Tessera"}};
    post.reach = reach_;
    post.stop = stop_.get_token();
    status = post_to_web(*target, post);
  }
  finish(row, status);
  const core::MutexLock lock(mutex_);
  in_flight_.erase(row.id);
}

void WebhookSender::finish(const DeliveryRow& row, const core::Result<int>& status) {
  const int attempts = row.attempts + 1;
  const bool delivered = status && *status >= 200 && *status < 300;
  const bool refused = (status && *status == 410) ||
                       (!status && status.error().code == ErrorCode::kForbidden);
  const auto wait = refused ? std::nullopt : webhook_wait_seconds(attempts);
  // A store that refuses lets the call be made once more, which its receiver can tell.
  const core::Status kept = delivered || !wait
                                ? table_.remove_delivery(row.id)
                                : table_.postpone_delivery(row.id, attempts, unix_now() + *wait);
  const bool given_up = !delivered && !wait;
  const std::string reason = !status ? status.error().message
                             : delivered ? std::string()
                                         : "status " + std::to_string(*status);
  log_.write(given_up ? LogLevel::kWarning : LogLevel::kInfo,
             delivered ? "webhook_delivered" : given_up ? "webhook_given_up" : "webhook_failed",
             {{"job", row.job},
              {"webhook_id", row.id},
              {"attempt", std::int64_t{attempts}},
              {"detail", kept ? std::string_view(reason) : std::string_view(kept.error().message)}});
}

}  // namespace server
