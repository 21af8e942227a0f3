/// The queue of units, in memory; it stands in for NATS JetStream below server/queue/units.h.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/queue/nats_link.h"

namespace test_support {

/// A connection to an empty queue. There is one queue at a time.
std::shared_ptr<queue::NatsLink> start_queue();
/// While it is down, no client reaches it; then it has lost everything.
void set_queue_up(bool is_up);
/// Returns the names published since the last call.
std::vector<std::string> take_published();
/// Returns the workers asked to report since the last call.
std::vector<std::string> take_requests();

}  // namespace test_support
