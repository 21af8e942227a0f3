/// HttpServer: an HTTP/1.1 server. Listens, parses requests strictly, calls routes, writes
/// responses.
///
/// Every connection has its own thread from an elastic pool; every size, count and wait is limited.
/// A request that is not understood exactly, or whose body was not read to its end, closes its
/// connection, so that no byte of one request can be taken for another (request smuggling).
///
/// Connections without a complete request head are limited in total and by address (lobby.h): the
/// oldest are closed. Requests in progress are limited by key, or by address without a key: 429.
/// Streams have their own limits (stream_gate.h). When all slots are taken, reserved threads still
/// answer the probes.
///
/// Only the listening socket and the accept loop of cpp-httplib are used; it hands over each
/// accepted connection. The versions in Debian 12 (0.11.4) and 13 (0.18.7) have flaws that no
/// setting fixes, measured with raw sockets: endless header lines exhaust memory (0.11: 451 MB
/// after 200 MB), a head sent byte by byte holds its thread for ever (both), chunked bodies exceed
/// the size limit (0.11), Content-Length with Transfer-Encoding is accepted (both) and a body
/// that follows an early response is taken for the next request (0.11), compressed bodies are
/// inflated past the limit (both), std::regex overflows the stack on a long Range or path (both), a
/// listen backlog of 5 drops bursts (both), and the text of an exception is sent as a header
/// (both).
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/http/client_address.h"
#include "server/http/message.h"
#include "server/http/router.h"
#include "server/http/stream_gate.h"
#include "server/http/tls.h"

namespace server {

struct HttpLimits {
  std::size_t header_bytes = 32U << 10U;            ///< Request line and headers; 431 beyond.
  std::size_t header_lines = 100;                   ///< 431 beyond.
  std::size_t target_bytes = 8U << 10U;             ///< 414 beyond.
  std::chrono::milliseconds header_deadline{5000};  ///< From first byte to last; 408 after.
  std::chrono::milliseconds body_idle{10000};       ///< Longest wait for the next piece; 408.
  /// Over the time spent waiting for the body, once that exceeds body_idle; 408 below it.
  std::uint64_t body_min_bytes_per_second = 1024;
  std::chrono::milliseconds write_stall{10000};  ///< Longest wait for a client that does not read.
  std::chrono::milliseconds keep_alive_idle{20000};  ///< Between requests.
  /// Unread body bytes up to this size are skipped after the response; beyond it the connection is
  /// closed.
  std::size_t drain_bytes = 64U << 10U;
  int max_connections = 4096;  ///< 503 with Retry-After beyond; probes are still answered.
  /// Connections without a complete request head, including idle ones between requests; beyond it
  /// the oldest are closed.
  int max_waiting = 1024;
  int max_waiting_of_address = 256;  ///< The same for one address that has presented no key.
  /// Requests in progress of one key, or of one address without a key, excluding streams and
  /// requests of workers; 429 beyond.
  int max_requests_of_client = 512;
  int backlog = 4096;  ///< Connections not yet accepted; the system may lower it.
};

/// Result of an exchange, for logs and metrics.
struct Outcome {
  int status = 0;
  double seconds = 0;  ///< From the first byte of the request to the last of the response.
  std::uint64_t bytes_received = 0;  ///< Bytes of the request body.
  std::uint64_t bytes_sent = 0;      ///< Bytes of the response body.
  bool client_gone = false;          ///< The response could not be sent completely.
  bool is_stream = false;            ///< It held a stream slot: a stream or a long poll.
  std::string internal_error = {};   ///< Text of an exception; never sent.
  std::string location = {};         ///< Location of the created resource; empty: none.
};

struct HttpHooks {
  /// Checks Host, Origin and key. Runs before routing errors; `request.route` is set. A response
  /// ends the request. May fill `request.principal`.
  std::function<std::optional<Response>(Request&)> before;
  /// Adds common headers to every response.
  std::function<void(const Request&, Response&)> decorate;
  /// Runs after the response was sent. A request that could not be parsed has empty members.
  std::function<void(const Request&, const Outcome&)> after;
};

struct HttpOptions {
  std::string host = "127.0.0.1";
  int port = 8080;  ///< 0: any free one.
  HttpLimits limits = {};
  HttpHooks hooks = {};
  std::shared_ptr<const TlsContext> tls = {};  ///< Null: plain HTTP.
  Networks trusted_proxies = {};               ///< Proxies whose X-Forwarded-* are trusted.
};

class HttpServer {
 public:
  /// streams must outlive the server.
  HttpServer(HttpOptions options, std::vector<Route> routes, StreamGate& streams);
  /// Stops without grace, then waits for handlers to return. Pre: run() has returned.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Binds the port; connections queue from here on. Returns the actual port or the error.
  core::Result<int> bind();
  /// Serves until stop(). Call once, after bind().
  void run();
  /// Accepts no more requests, asks streams and waits to end, and cuts the rest just before the
  /// grace time is over. From any thread except a handler's. Returns true if all handlers have
  /// returned.
  bool stop(std::chrono::milliseconds grace);

  /// Applies to later connections. Pre: tls is null exactly if it was null at the start.
  void set_tls(std::shared_ptr<const TlsContext> tls);
  void set_trusted_proxies(Networks trusted);

  struct Stats {
    int connections = 0;
    int threads = 0;
    std::uint64_t connections_accepted = 0;
    std::uint64_t connections_refused =
        0;  ///< Admitted for probes only, or rejected: the server was full.
    std::uint64_t connections_evicted = 0;  ///< Closed while waiting, by the total limit.
    std::uint64_t connections_evicted_of_address = 0;  ///< Closed by the limit of their address.
    std::uint64_t requests = 0;
    std::uint64_t requests_refused = 0;  ///< 429: the key or address had too many requests.
  };
  Stats stats() const;
  const std::vector<Route>& routes() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace server
