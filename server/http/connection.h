/// One connection from its first byte to its last: reads requests, calls routes, sends answers.
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

/// What all connections of a server share. Everything outlives them.
struct ConnectionContext {
  const HttpOptions& options;
  const Router& router;
  StreamGate& streams;
  StreamGate& requests;  ///< Those being answered that are no streams, by key or address.
  ClientWatch& watch;
  std::atomic<std::uint64_t>& request_count;
  std::atomic<std::uint64_t>& refused_request_count;
  std::uint64_t request_id_seed = 0;
};

/// The settings that may change while the server runs, as they were when a connection began.
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

  /// fd is borrowed; it must stay open for as long as this lives.
  Connection(const ConnectionContext& context, ConnectionSettings settings, Lobby& lobby, int fd,
             Service service);
  void run();
  /// From another thread, after ClientWatch::stop_all(): ends it if it waits for a request.
  void stop_if_idle();
  /// From another thread: ends it now. The handler notices at its next write or read.
  void cut();

 private:
  /// False: nothing came, or the client is gone.
  bool wait_for_request();
  /// Fills request and framing; false: refused, and the answer was sent.
  bool read_head(Request& request, ParsedHead& parsed);
  /// True: the connection is in order for the next request.
  bool serve_one();
  /// What becomes of the connection after an answer.
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
  const std::string peer_group_;  ///< Empty: a proxy, which many share.
  bool is_known_ = false;         ///< A request on this connection has brought a key.
  bool is_told_to_go_ = false;    ///< By the lobby: nothing more will be read.
  std::optional<ClientWatch::Registration> registration_;  ///< Since the first wait.
  std::atomic<bool> is_idle_ = false;
  bool is_first_request_ = true;
  Clock::time_point request_start_ = {};
};

}  // namespace server
