#include "tests/simulation/wire.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <initializer_list>

#include "server/http/channel.h"
#include "server/http/inbox.h"
#include "server/http/request_body.h"
#include "server/http/request_head.h"

namespace simulation {
namespace {

using server::Channel;

constexpr double kTravelMean = 0.02 * kSecond;

/// What a client sends; it comes in pieces, and ends.
class Incoming final : public Channel {
 public:
  Incoming(std::string bytes, Random& random) : bytes_(std::move(bytes)), random_(random) {}

  Read read(char* into, std::size_t capacity, server::Clock::time_point) override {
    sleep_for(static_cast<Nanoseconds>(random_.exponential(kTravelMean)));
    const std::size_t most = std::min(capacity, bytes_.size() - place_);
    if (most == 0) {
      return {.status = Status::kClosed};
    }
    const std::size_t count = 1 + random_.below(most);
    std::memcpy(into, bytes_.data() + place_, count);
    place_ += count;
    return {.bytes = count};
  }
  Read read_idle(char* into, std::size_t capacity, std::chrono::milliseconds) override {
    return read(into, capacity, {});
  }
  bool write(std::initializer_list<std::string_view>) override { return true; }
  bool write_file(int, std::uint64_t, std::uint64_t) override { return true; }
  void restart_pace() override {}
  void finish_writing() override {}
  int fd() const override { return -1; }

 private:
  const std::string bytes_;
  Random& random_;
  std::size_t place_ = 0;
};

std::string bytes_of(const WireRequest& request, Random& random) {
  const std::size_t size = request.is_cut ? random.below(request.body.size()) : request.body.size();
  return request.line + " HTTP/1.1\r\nHost: localhost\r\n" +
         (request.key.empty() ? "" : "Idempotency-Key: " + request.key + "\r\n") +
         "Content-Length: " + std::to_string(request.body.size()) + "\r\n\r\n" +
         request.body.substr(0, size);
}

WireAnswer answer_to(server::Response response) {
  WireAnswer answer{.status = response.status};
  if (auto* text = std::get_if<std::string>(&response.body)) {
    answer.body = std::move(*text);
  } else if (const auto* shared = std::get_if<server::SharedBytes>(&response.body)) {
    answer.body = **shared;
  }
  return answer;
}

}  // namespace

WireAnswer send(Server& server, const WireRequest& sent, Random& random) {
  Incoming channel(bytes_of(sent, random), random);
  server::Inbox inbox(channel);
  server::HeadScanner scanner({});
  std::size_t head = 0;
  while (head == 0) {
    if (inbox.fill({}, server::HeadLimits{}.bytes) != Channel::Status::kOk) {
      return {};
    }
    const auto progress = scanner.scan(inbox.unread());
    if (progress.refusal) {
      return {.status = progress.refusal->status, .body = progress.refusal->detail};
    }
    head = progress.head_bytes;
  }
  server::Request request;
  const auto parsed = server::parse_head(inbox.unread().substr(0, head), {}, request);
  if (parsed.refusal) {
    return {.status = parsed.refusal->status, .body = parsed.refusal->detail};
  }
  inbox.consume(head);
  auto match = server.router->match(request.method, parsed.raw_path);
  if (match.route == nullptr) {
    return {.status = 404};
  }
  request.path_params = std::move(match.params);
  request.access = server::Access::of(sent.tenant);
  server::RequestBody body(channel, inbox, parsed.framing, {});
  const server::BodyPolicy policy = match.route->body;
  body.set_limit(policy.limit_bytes);
  if (policy.kind == server::BodyPolicy::Kind::kStream) {
    request.body_reader = &body;
  } else if (policy.kind == server::BodyPolicy::Kind::kJson &&
             !body.read([&](std::string_view piece) {
               request.body += piece;
               return true;
             })) {
    return {};
  }
  return answer_to(match.route->handler(request));
}

}  // namespace simulation
