/// Comparisons of finished jobs, as the route makes them, beside a tenant that floods.
///
/// While the flood holds a place for minutes, the comparison of a tenant that holds none waits only
/// for those of other such tenants (server/observe/turns.h).
#pragma once

#include <string>

#include "server/access.h"
#include "server/observe/turns.h"
#include "server/store/comparison_store.h"
#include "tests/simulation/executor.h"

namespace simulation {

class Comparisons {
 public:
  /// Both must outlive this. keeps: how many comparisons are stored.
  Comparisons(server::Database& database, const server::DataDir& data, int keeps)
      : store_(database, data, {.count = keeps}) {}

  /// Holds a place for long, if it gets one.
  void flood(Random& random);
  /// Waits for a place and stores `body`. Returns how long it waited although no other tenant held
  /// a place, except the one that floods.
  struct Stored {
    bool is_stored = false;
    Nanoseconds starved = 0;
  };
  Stored store(const std::string& tenant, const std::string& id, const std::string& body);
  server::ComparisonStore& table() { return store_; }

 private:
  /// Time during which a tenant that does not flood held a place.
  Nanoseconds shared_time() const { return shared_ + (holders_ > 0 ? now() - since_ : 0); }

  server::Turns turns_{1};
  server::ComparisonStore store_;
  int holders_ = 0;
  Nanoseconds since_ = 0;  ///< Pre: holders_ > 0.
  Nanoseconds shared_ = 0;
};

}  // namespace simulation
