/// Connection: one connection from first byte to last. Reads requests, calls routes, sends
/// responses.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/http/channel.h"
#include "server/http/client_watch.h"
#include "server/http/http_server.h"
#include "server/http/inbox.h"
#include "server/http/lobby.h"
#include "server/http/request_body.h"
#include "server/http/request_head.h"
#include "server/http/response_writer.h"

namespace server {

/// State shared by all connections of a server. All members outlive the connections.
struct ConnectionContext {
  const HttpOptions& options;
  const Router& router;
  StreamGate& streams;
  StreamGate& requests;  ///< Requests in progress other than streams, by key or address.
  ClientWatch& watch;
  std::atomic<std::uint64_t>& request_count;
  std::atomic<std::uint64_t>& refused_request_count;
  std::uint64_t request_id_seed = 0;
};

/// Settings that may change while the server runs, as of the start of the connection.
struct ConnectionSettings {
  std::shared_ptr<const TlsContext> tls;
  std::shared_ptr<const Networks> trusted_proxies;
};

class Connection {
 public:
  enum class Service : std::uint8_t {
    kFull,
    kProbesOnly  ///< The server is full: one request; 503 unless its route is a probe.
  };

  /// Borrows fd, which must stay open as long as this object exists.
  Connection(const ConnectionContext& context, ConnectionSettings settings, Lobby& lobby, int fd,
             Service service);
  void run();
  /// Closes the connection if it is idle. From another thread, after ClientWatch::stop_all().
  void stop_if_idle();
  /// Closes the connection now. From another thread; the handler notices at its next read or write.
  void cut();

 private:
  /// Returns false when nothing arrived or the client is gone.
  bool wait_for_request();
  /// Fills request and framing. Returns false when the request was refused; the response is sent.
  bool read_head(Request& request, ParsedHead& parsed);
  /// Returns true when the connection can take another request.
  bool serve_one();
  /// Use of the connection after a response.
  enum class Next : std::uint8_t { kReuse, kClose, kDiscardAndClose };
  Next serve(Request& request, const ParsedHead& parsed, Outcome& outcome);
  Response make_response(Request& request, const ParsedHead& parsed, RequestBody& body,
                         Outcome& outcome);
  std::optional<Response> read_json_body(Request& request, RequestBody& body) const;
  void prepare(Request& request, Response& response) const;
  void refuse(Request& request, const Refusal& refusal);
  void close_politely();
  ClientWatch::State& watch_client();
  std::string make_request_id(std::uint64_t number) const;

  const ConnectionContext& context_;
  const HttpLimits& limits_;
  const ConnectionSettings settings_;
  const Service service_;
  const std::unique_ptr<Channel> owned_channel_;
  Channel& channel_;
  Inbox inbox_;
  Lobby::Guest guest_;
  const std::string peer_;
  const std::string peer_group_;  ///< Empty: a trusted proxy, shared by many clients.
  bool is_known_ = false;         ///< A request on this connection has presented a key.
  bool is_told_to_go_ = false;    ///< Evicted by the lobby: nothing more will be read.
  std::optional<ClientWatch::Registration> registration_;  ///< Since the first wait.
  std::atomic<bool> is_idle_ = false;
  bool is_first_request_ = true;
  Clock::time_point request_start_ = {};
};

}  // namespace server
