/// Turns a Response into bytes on a channel.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/http/channel.h"
#include "server/http/client_watch.h"
#include "server/http/message.h"

namespace server {

/// Facts about the request and the connection that the writer needs.
struct WriteContext {
  const Request& request;
  bool is_http_1_1 = true;
  bool keep_alive = true;
  std::function<ClientWatch::State&()> watch_client;  ///< Called for streams only.
  const ClientWatch& watch;
};

struct Written {
  bool is_complete = false;  ///< Otherwise the connection is no longer usable.
  bool keep_alive = false;   ///< As sent to the client.
  std::uint64_t body_bytes = 0;
  std::string internal_error;  ///< Text of the exception that a stream's producer threw.
};

/// Runs the producer of a stream. Adds the headers that the server sets.
Written write_response(Channel& channel, Response& response, const WriteContext& context);

}  // namespace server
