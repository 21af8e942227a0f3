/// The HTTP/1.1 server: listens, reads requests strictly, calls routes, writes answers.
///
/// Every connection has a thread of its own from an elastic pool; every size, count and wait has a
/// limit. A request that is not understood exactly, or whose body was not read to its end, closes
/// its connection, so that no byte of one request can be taken for another.
///
/// Connections without a complete request head are limited in all and by address (lobby.h): the
/// oldest go. Requests that are being answered are limited by key, or by address where there is no
/// key: 429. Streams have limits of their own (stream_gate.h). When all places are taken, threads
/// kept back for them still answer the probes.
///
/// Of cpp-httplib only the listening socket and the accept loop are in use; it hands each accepted
/// connection over, and everything after that is ours. The versions in Debian 12 (0.11.4) and 13
/// (0.18.7) have faults there that no setting mends, measured with raw sockets: endless header
/// lines fill the memory (0.11: 451 MB after 200 MB), a head dripped byte by byte holds its thread
/// for ever (both), chunked bodies pass the size limit (0.11), Content-Length beside
/// Transfer-Encoding is accepted (both) and a body that follows an early answer is taken for the
/// next request (0.11), compressed bodies are inflated past the limit (both), std::regex overflows
/// the stack on a long Range or path (both), a listen backlog of 5 drops bursts (both), and the
/// text of an exception is sent as a header (both).
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
  /// Over the time spent waiting for the body, once that exceeds body_idle; 408 below.
  std::uint64_t body_min_bytes_per_second = 1024;
  std::chrono::milliseconds write_stall{10000};  ///< Longest wait for a client that does not read.
  std::chrono::milliseconds keep_alive_idle{20000};  ///< Between requests.
  /// What is left of a body after the answer is read past up to this size; else it is closed.
  std::size_t drain_bytes = 64U << 10U;
  int max_connections = 4096;  ///< 503 with Retry-After beyond; probes are still answered.
  /// Connections without a complete request head, idle ones between requests included; the oldest
  /// are closed beyond.
  int max_waiting = 1024;
  int max_waiting_of_address = 256;  ///< The same of one address that has brought no key.
  /// Requests of one key, or of one address without a key, that are being answered, streams apart;
  /// 429 beyond.
  int max_requests_of_client = 512;
  int backlog = 4096;  ///< Connections not yet accepted; the system may lower it.
};

/// How an exchange ended, for logs and metrics.
struct Outcome {
  int status = 0;
  double seconds = 0;  ///< From the first byte of the request to the last of the answer.
  std::uint64_t bytes_received = 0;  ///< Of the body.
  std::uint64_t bytes_sent = 0;      ///< Of the body.
  bool client_gone = false;          ///< The answer could not be sent completely.
  bool is_stream = false;            ///< It held a place among the streams: a stream, a long poll.
  std::string internal_error = {};   ///< Text of an exception; never sent.
  std::string location = {};         ///< Of what was made; empty: nothing.
};

struct HttpHooks {
  /// Host, Origin and key checks; runs before routing errors, `request.route` is known. An answer
  /// ends the request. May fill `request.principal`.
  std::function<std::optional<Response>(Request&)> before;
  /// Last look at every answer: common headers.
  std::function<void(const Request&, Response&)> decorate;
  /// After the answer was sent. A request that could not be parsed has empty members.
  std::function<void(const Request&, const Outcome&)> after;
};

struct HttpOptions {
  std::string host = "127.0.0.1";
  int port = 8080;  ///< 0: any free one.
  HttpLimits limits = {};
  HttpHooks hooks = {};
  std::shared_ptr<const TlsContext> tls = {};  ///< Null: plain HTTP.
  Networks trusted_proxies = {};               ///< Whose X-Forwarded-* are believed.
};

class HttpServer {
 public:
  /// streams must outlive the server.
  HttpServer(HttpOptions options, std::vector<Route> routes, StreamGate& streams);
  /// Stops with no grace, then waits for handlers to return. Pre: run() has returned.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Takes the port; connections queue from here on. The real port, or why not.
  core::Result<int> bind();
  /// Serves until stop(). Once, after bind().
  void run();
  /// From any thread but a handler's: takes no more requests, asks streams and waits to end, and
  /// cuts what is left just before the grace time is over. True if all handlers have returned.
  bool stop(std::chrono::milliseconds grace);

  /// For connections that come from here on. Pre: tls is null exactly when it was at the start.
  void set_tls(std::shared_ptr<const TlsContext> tls);
  void set_trusted_proxies(Networks trusted);

  struct Stats {
    int connections = 0;
    int threads = 0;
    std::uint64_t connections_accepted = 0;
    std::uint64_t connections_refused =
        0;  ///< Only for probes, or not at all: the server was full.
    std::uint64_t connections_evicted = 0;  ///< Closed while they waited, by the limit in all.
    std::uint64_t connections_evicted_of_address = 0;  ///< By the limit of their address.
    std::uint64_t requests = 0;
    std::uint64_t requests_refused = 0;  ///< 429: their key or address had too many.
  };
  Stats stats() const;
  const std::vector<Route>& routes() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace server
