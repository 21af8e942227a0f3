/// Handles of the NATS library that belong to a link, for the sources of this folder.
#pragma once

#include <string>

#include <nats/nats.h>

#include "server/queue/nats_link.h"

namespace queue {

struct NatsLink::Handles {
  natsConnection* connection = nullptr;
  jsCtx* jetstream = nullptr;
};

inline core::Error nats_error(const std::string& what, natsStatus status) {
  return core::Error{core::ErrorCode::kUnavailable, what + ": " + natsStatus_GetText(status), ""};
}

inline constexpr const char* kStream = "TESSERA_UNITS";
inline constexpr const char* kSubject = "tessera.units";
inline constexpr const char* kConsumer = "tessera-workers";
/// Followed by the worker's id.
inline constexpr const char* kReportSubject = "tessera.workers.";

}  // namespace queue
