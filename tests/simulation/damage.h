/// Damage: bits of a stopped server's files that flip.
#pragma once

#include <string>

#include "tests/simulation/executor.h"

namespace simulation {

/// Flips a bit of a film's file; returns its job. Empty: there is none.
std::string damage_film(const std::string& data, Random& random);
/// Flips a bit of the changes that the write-ahead log holds; returns false if it holds none, or if
/// the process ended while they were written back, when a loss cannot be noticed
/// (server/store/database_mark.h).
bool damage_log(const std::string& data, Random& random);

}  // namespace simulation
