/// Wire: a client's connection to the routes of a server, which arrives in pieces and can be cut
/// anywhere. Requests are parsed, routed and answered as server/http/connection.cpp does, without
/// a socket.
#pragma once

#include <string>

#include "tests/simulation/executor.h"
#include "tests/simulation/server.h"

namespace simulation {

struct WireRequest {
  std::string tenant;
  std::string line;  ///< "POST /v1/jobs"
  std::string body = {};
  std::string key = {};  ///< Idempotency-Key; empty: none.
  bool is_cut = false;   ///< After a part of its body.
};
struct WireAnswer {
  int status = 0;
  std::string body = {};
};

WireAnswer send(Server& server, const WireRequest& request, Random& random);

}  // namespace simulation
