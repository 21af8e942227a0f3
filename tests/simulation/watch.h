/// A client that follows a job's tiles and its events for a while.
#pragma once

#include <string>

#include "server/routes/tile_stream.h"
#include "tests/simulation/executor.h"

namespace simulation {

/// Returns what the client received wrongly: a revision of a tile twice, or after a newer one, or
/// anything after the end; empty: nothing. until: when it leaves.
std::string watch_tiles(const server::TileStream::Parts& parts, const server::JobPointer& job,
                        Nanoseconds until);
/// The same for the numbered events, of which each must have a higher number than the one before.
std::string watch_events(const server::JobPointer& job, Nanoseconds until);

}  // namespace simulation
