#include "server/http/connection.h"

#include <array>
#include <cstdio>
#include <exception>
#include <new>
#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "core/base/text.h"
#include "server/http/problem.h"
#include "server/http/text.h"

namespace server {
namespace {

constexpr std::chrono::milliseconds kProbeDeadline(1000);
constexpr std::chrono::milliseconds kLingerTime(1000);
constexpr std::string_view kToldToGo = "too many connections wait for a request";

bool is_request_id(std::string_view text) {
  constexpr std::size_t kMaxChars = 128;
  return !text.empty() && text.size() <= kMaxChars && core::is_word(text, "-_.");
}

/// Bytes not yet sent above which writing waits (tcp(7), TCP_NOTSENT_LOWAT): a record of TLS.
constexpr int kUnsentLowBytes = 16 << 10;

/// Finaliser of splitmix64: adjacent counters give unrelated numbers.
std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

bool is_json(std::string_view content_type) {
  const std::string type = media_type(content_type);
  constexpr std::string_view kSuffix = "+json";
  return type == "application/json" ||
         (type.size() > kSuffix.size() && type.substr(0, 12) == "application/" &&
          type.substr(type.size() - kSuffix.size()) == kSuffix);
}

std::unique_ptr<Channel> make_channel(const HttpLimits& limits, const TlsContext* tls, int fd) {
  const Pace pace = {.stall = limits.write_stall};
  if (tls != nullptr) {
    return std::make_unique<TlsChannel>(*tls, fd, pace);
  }
  return std::make_unique<SocketChannel>(fd, pace);
}

Response body_failure_response(const RequestBody& body, const Request& request) {
  switch (body.failure()) {
    case RequestBody::Failure::kTooLarge:
      return problem_response(
          413, "the body is larger than " + std::to_string(body.limit_bytes()) + " bytes",
          request.path);
    case RequestBody::Failure::kTimeout:
      return problem_response(408, "the body did not arrive in time", request.path);
    case RequestBody::Failure::kMalformed:
    case RequestBody::Failure::kDisconnected:
    case RequestBody::Failure::kNone:
      break;
  }
  return problem_response(400, "the body is malformed or cut short", request.path);
}

}  // namespace

Connection::Connection(const ConnectionContext& context, ConnectionSettings settings, Lobby& lobby,
                       int fd, Service service)
    : context_(context),
      limits_(context.options.limits),
      settings_(std::move(settings)),
      service_(service),
      owned_channel_(make_channel(limits_, settings_.tls.get(), fd)),
      channel_(*owned_channel_),
      inbox_(channel_),
      guest_(lobby, fd),
      peer_(peer_address(fd)),
      peer_group_(settings_.trusted_proxies->contains(peer_) ? std::string()
                                                             : address_group(peer_)) {}

void Connection::run() {
  const int on = 1;
  ::setsockopt(channel_.fd(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  // The system would let 4 MB wait for a client that does not read. What is on its way to one that
  // does is not limited.
  ::setsockopt(channel_.fd(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentLowBytes,
               sizeof(kUnsentLowBytes));
  while (wait_for_request() && serve_one() && service_ == Service::kFull) {
    registration_.reset();
    is_first_request_ = false;
  }
  registration_.reset();
}

void Connection::stop_if_idle() {
  if (is_idle_.load()) {
    ::shutdown(channel_.fd(), SHUT_RD);
  }
}

void Connection::cut() { ::shutdown(channel_.fd(), SHUT_RDWR); }

bool Connection::wait_for_request() {
  guest_.enter(is_known_ ? std::string() : peer_group_);
  if (!inbox_.unread().empty()) {
    request_start_ = Clock::now();
    return true;
  }
  inbox_.shrink();
  is_idle_ = true;
  // Checked after setting the flag: either stop_if_idle() sees the flag, or the stop is seen here.
  if (context_.watch.is_stopping()) {
    return false;
  }
  Channel::Status status = Channel::Status::kOk;
  if (service_ == Service::kProbesOnly) {
    status = inbox_.fill_idle(kProbeDeadline);
  } else {
    status =
        inbox_.fill_idle(is_first_request_ ? limits_.header_deadline : limits_.keep_alive_idle);
  }
  is_idle_ = false;
  request_start_ = Clock::now();
  return status == Channel::Status::kOk;
}

bool Connection::read_head(Request& request, ParsedHead& parsed) {
  const HeadLimits head_limits = {.bytes = limits_.header_bytes,
                                  .lines = limits_.header_lines,
                                  .target_bytes = limits_.target_bytes};
  const auto deadline =
      request_start_ + (service_ == Service::kFull ? limits_.header_deadline : kProbeDeadline);
  HeadScanner scanner(head_limits);
  bool may_skip_line = true;
  while (true) {
    // RFC 9112 2.2: one empty line before a request is skipped.
    if (may_skip_line && inbox_.unread().substr(0, 2) == "\r\n") {
      inbox_.consume(2);
      may_skip_line = false;
    }
    const std::string_view received = inbox_.unread();
    HeadScanner::Progress progress = scanner.scan(received);
    if (progress.refusal) {
      refuse(request, *progress.refusal);
      return false;
    }
    if (progress.head_bytes > 0) {
      parsed = parse_head(received.substr(0, progress.head_bytes), head_limits, request);
      inbox_.consume(progress.head_bytes);
      break;
    }
    const Channel::Status status = Clock::now() < deadline
                                       ? inbox_.fill(deadline, limits_.header_bytes + 1)
                                       : Channel::Status::kTimeout;
    if (status == Channel::Status::kTimeout) {
      refuse(request, {.status = 408, .detail = "the headers did not arrive in time"});
    }
    if (status != Channel::Status::kOk) {
      return false;
    }
  }
  is_told_to_go_ = !guest_.leave();
  note_client(request, peer_, settings_.tls != nullptr, *settings_.trusted_proxies);
  if (const auto id = request.header("X-Request-Id"); id && is_request_id(*id)) {
    request.request_id = *id;
  }
  if (is_told_to_go_ && !parsed.refusal) {
    parsed.framing.wants_keep_alive = false;
    // A body may have arrived in part, and no more of it will.
    if (parsed.framing.body != Framing::Body::kNone) {
      parsed.refusal = Refusal{.status = 503, .detail = std::string(kToldToGo)};
    }
  }
  if (parsed.refusal) {
    refuse(request, *parsed.refusal);
    return false;
  }
  return true;
}

bool Connection::serve_one() {
  Request request;
  request.remote_addr = peer_;
  request.request_id =
      make_request_id(context_.request_count.fetch_add(1, std::memory_order_relaxed));
  ParsedHead parsed;
  if (!read_head(request, parsed)) {
    return false;
  }
  Outcome outcome;
  const Next next = serve(request, parsed, outcome);
  outcome.seconds = std::chrono::duration<double>(Clock::now() - request_start_).count();
  if (context_.options.hooks.after) {
    context_.options.hooks.after(request, outcome);
  }
  if (next == Next::kDiscardAndClose) {
    close_politely();
  }
  return next == Next::kReuse;
}

Connection::Next Connection::serve(Request& request, const ParsedHead& parsed, Outcome& outcome) {
  RequestBody body(
      channel_, inbox_, parsed.framing,
      {.stall = limits_.body_idle, .min_bytes_per_second = limits_.body_min_bytes_per_second});
  request.watch_client = [this] { return watch_client().stop.get_token(); };
  StreamSlot place;
  request.place = &place;
  Response response = make_response(request, parsed, body, outcome);
  if (body.failure() != RequestBody::Failure::kNone) {
    response = body_failure_response(body, request);
  }
  auto* stream = std::get_if<StreamBody>(&response.body);
  if (stream != nullptr && is_told_to_go_) {
    // The stream would end at once, since its client appears to be gone.
    response = problem_response(503, kToldToGo, request.path);
  } else if (stream != nullptr && !stream->slot) {
    stream->slot = context_.streams.try_enter(request.access.tenant);
    if (!stream->slot) {
      response = no_stream_response(request.path);
    }
  }
  outcome.is_stream = place.is_of(context_.streams);
  if (const auto* body_stream = std::get_if<StreamBody>(&response.body)) {
    // Generated content of known length counts as an ordinary response.
    outcome.is_stream = outcome.is_stream || !body_stream->bytes;
    place = StreamSlot();
  }
  prepare(request, response);
  outcome.status = response.status;
  outcome.location = response.headers.find("Location").value_or("");

  const bool keep_alive = parsed.framing.wants_keep_alive && service_ == Service::kFull &&
                          !context_.watch.is_stopping() && body.is_drainable(limits_.drain_bytes);
  const Written written =
      write_response(channel_, response,
                     {.request = request,
                      .is_http_1_1 = parsed.framing.is_http_1_1,
                      .keep_alive = keep_alive,
                      .watch_client = [this]() -> ClientWatch::State& { return watch_client(); },
                      .watch = context_.watch});
  outcome.bytes_received = body.bytes_read();
  outcome.bytes_sent = written.body_bytes;
  outcome.client_gone = !written.is_complete && written.internal_error.empty();
  if (!written.internal_error.empty()) {
    outcome.internal_error = written.internal_error;
  }
  if (!written.is_complete) {
    return Next::kClose;
  }
  if (written.keep_alive && body.drain(limits_.drain_bytes)) {
    return Next::kReuse;
  }
  return body.is_complete() ? Next::kClose : Next::kDiscardAndClose;
}

Response Connection::make_response(Request& request, const ParsedHead& parsed, RequestBody& body,
                                   Outcome& outcome) try {
  Router::Match match = context_.router.match(request.method, parsed.raw_path);
  if (match.route != nullptr) {
    const Route& route = *match.route;
    request.route = route.alias_of.empty() ? route.pattern : route.alias_of;
    request.path_params = std::move(match.params);
  }
  if (service_ == Service::kProbesOnly && (match.route == nullptr || !match.route->is_probe)) {
    return problem_response(503, "too many connections are open", request.path);
  }
  if (context_.options.hooks.before) {
    if (std::optional<Response> answer = context_.options.hooks.before(request)) {
      return std::move(*answer);
    }
  }
  is_known_ = is_known_ || !request.principal_name.empty();
  // All workers of a farm may share a key; only max_connections limits them.
  if (!request.is_of_worker && (match.route == nullptr || !match.route->is_probe)) {
    const bool has_key = !request.principal.empty();
    *request.place = context_.requests.try_enter(has_key ? request.principal
                                                         : address_group(request.remote_addr));
    if (!*request.place) {
      context_.refused_request_count.fetch_add(1, std::memory_order_relaxed);
      return problem_response(429,
                              "more than " + std::to_string(limits_.max_requests_of_client) +
                                  " requests of this " + (has_key ? "key" : "address") +
                                  " are being answered",
                              request.path);
    }
  }
  if (match.route == nullptr) {
    if (match.allow.empty() && parsed.raw_path != "*") {
      return problem_response(404, "there is nothing at this path", request.path);
    }
    Response response =
        request.method == "OPTIONS"
            ? empty_response()
            : problem_response(405, "the method " + request.method + " is not among " + match.allow,
                               request.path);
    response.headers.add("Allow", match.allow.empty() ? "OPTIONS" : std::string_view(match.allow));
    return response;
  }
  BodyPolicy policy = match.route->body;
  if (policy.picture_limit_bytes > 0 &&
      media_type(request.header("Content-Type").value_or("")).starts_with("image/")) {
    policy = BodyPolicy::stream(policy.picture_limit_bytes);
  }
  body.set_limit(policy.limit_bytes);
  if (policy.kind == BodyPolicy::Kind::kJson) {
    if (std::optional<Response> answer = read_json_body(request, body)) {
      return std::move(*answer);
    }
  } else if (policy.kind == BodyPolicy::Kind::kStream) {
    if (body.declared_bytes().value_or(0) > policy.limit_bytes) {
      return problem_response(413,
                              "the body of " + std::to_string(*body.declared_bytes()) +
                                  " bytes is larger than " + std::to_string(policy.limit_bytes),
                              request.path);
    }
    request.body_reader = &body;
  }
  return match.route->handler(request);
} catch (const std::bad_alloc&) {
  outcome.internal_error = "out of memory";
  return problem_response(503, "the server has not enough memory for this request; try it later",
                          request.path);
} catch (const std::exception& error) {
  outcome.internal_error = error.what();
  return problem_response(500, "the server failed on this request", request.path);
} catch (...) {
  outcome.internal_error = "unknown exception";
  return problem_response(500, "the server failed on this request", request.path);
}

std::optional<Response> Connection::read_json_body(Request& request, RequestBody& body) const {
  const auto content_type = request.header("Content-Type");
  if (!body.is_complete() && content_type && !is_json(*content_type)) {
    return problem_response(415,
                            "the Content-Type '" + std::string(*content_type) +
                                "' is not accepted here; send application/json",
                            request.path);
  }
  const auto declared = body.declared_bytes();
  if (declared && *declared <= body.limit_bytes()) {
    request.body.reserve(static_cast<std::size_t>(*declared));
  }
  const bool is_read = body.read([&](std::string_view piece) {
    request.body += piece;
    return true;
  });
  return is_read ? std::nullopt : std::optional<Response>(body_failure_response(body, request));
}

void Connection::prepare(Request& request, Response& response) const {
  if (context_.options.hooks.decorate) {
    context_.options.hooks.decorate(request, response);
  }
}

void Connection::refuse(Request& request, const Refusal& refusal) {
  Response response = problem_response(refusal.status, refusal.detail, request.path);
  prepare(request, response);
  const Written written =
      write_response(channel_, response,
                     {.request = request,
                      .keep_alive = false,
                      .watch_client = [this]() -> ClientWatch::State& { return watch_client(); },
                      .watch = context_.watch});
  if (context_.options.hooks.after) {
    context_.options.hooks.after(
        request, {.status = refusal.status,
                  .seconds = std::chrono::duration<double>(Clock::now() - request_start_).count(),
                  .bytes_sent = written.body_bytes,
                  .client_gone = !written.is_complete,
                  .internal_error = {},
                  .location = {}});
  }
  if (written.is_complete) {
    close_politely();
  }
}

/// If bytes are unread when the socket closes, the kernel resets the connection, and the client may
/// never see the response. Therefore reads and discards further input for a moment.
void Connection::close_politely() {
  channel_.finish_writing();
  const auto deadline = Clock::now() + kLingerTime;
  inbox_.consume(inbox_.unread().size());
  constexpr std::size_t kDiscardBytes = 64U << 10U;
  while (Clock::now() < deadline && !context_.watch.is_stopping() &&
         inbox_.fill(deadline, kDiscardBytes) == Channel::Status::kOk) {
    inbox_.consume(inbox_.unread().size());
  }
}

ClientWatch::State& Connection::watch_client() {
  if (!registration_) {
    registration_.emplace(context_.watch, channel_.fd());
  }
  return registration_->state();
}

std::string Connection::make_request_id(std::uint64_t number) const {
  const std::uint64_t value = mix(context_.request_id_seed + number * 0x9E3779B97F4A7C15U);
  std::array<char, 17> text = {};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

}  // namespace server
