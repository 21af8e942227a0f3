#include "tests/simulation/comparisons.h"

#include "tests/simulation/faults.h"

namespace simulation {

void Comparisons::flood(Random& random) {
  const auto held = turns_.take("flood", {}, std::nullopt);
  if (held) {
    sleep_for(static_cast<Nanoseconds>(random.exponential(kOutage)));
  }
}

Comparisons::Stored Comparisons::store(const std::string& tenant, const std::string& id,
                                       const std::string& body) {
  const Nanoseconds asked = now();
  const Nanoseconds shared = shared_time();
  const auto held = turns_.take(tenant, {}, std::nullopt);
  if (!held) {
    return {};
  }
  Stored stored;
  stored.starved = now() - asked - (shared_time() - shared);
  if (holders_++ == 0) {
    since_ = now();
  }
  stored.is_stored = static_cast<bool>(
      store_.insert({.id = id, .body = body, .tenant = tenant, .created_at = 0}, {}));
  shared_ = shared_time();
  since_ = now();
  --holders_;
  return stored;
}

}  // namespace simulation
