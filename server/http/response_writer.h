/// Turns a Response into bytes on a channel.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/http/channel.h"
#include "server/http/client_watch.h"
#include "server/http/message.h"

namespace server {

/// What the writer must know of the request and of the connection.
struct WriteContext {
  const Request& request;
  bool is_http_1_1 = true;
  bool keep_alive = true;
  std::function<ClientWatch::State&()> watch_client;  ///< Called for streams only.
  const ClientWatch& watch;
};

struct Written {
  bool is_complete = false;  ///< Else the connection is of no more use.
  bool keep_alive = false;   ///< As sent to the client.
  std::uint64_t body_bytes = 0;
  std::string internal_error;  ///< Text of what a stream's producer threw.
};

/// Runs the producer of a stream. Adds the headers that are the server's business.
Written write_response(Channel& channel, Response& response, const WriteContext& context);

}  // namespace server
