#include "server/observe/turns.h"

#include <algorithm>

namespace server {

using core::Error;
using core::ErrorCode;

int Turns::places_of(const std::string& tenant) const {
  const auto found = places_by_tenant_.find(tenant);
  return found == places_by_tenant_.end() ? 0 : found->second;
}

bool Turns::is_next(std::uint64_t number) const {
  const auto next = std::min_element(waiting_.begin(), waiting_.end(),
                                     [this](const Waiting& a, const Waiting& b)
                                         TESSERA_TS(no_thread_safety_analysis) {
                                           return places_of(a.tenant) < places_of(b.tenant);
                                         });
  const bool has_none = places_of(next->tenant) == 0;
  return next->number == number && taken_ < (has_none ? 2 : 1) * places_;
}

core::Result<Turns::Held> Turns::take(const std::string& tenant, const std::stop_token& stop,
                                      std::optional<std::chrono::seconds> patience) {
  const core::MutexLock lock(mutex_);
  const std::uint64_t number = ++last_number_;
  waiting_.push_back({number, tenant});
  const auto is_due = [&]() TESSERA_TS(no_thread_safety_analysis) { return is_next(number); };
  const bool came = patience ? changed_.wait_for(mutex_, stop, *patience, is_due)
                             : changed_.wait(mutex_, stop, is_due);
  std::erase_if(waiting_, [number](const Waiting& each) { return each.number == number; });
  changed_.notify_all();
  if (came) {
    ++taken_;
    ++places_by_tenant_[tenant];
    return Held(*this, tenant);
  }
  if (stop.stop_requested()) {
    return Error{ErrorCode::kCancelled, "stopped while waiting for other requests", ""};
  }
  // In pieces: GCC 14 warns of a copy out of bounds in the sum of three strings.
  std::string message = "other requests were being served for ";
  message += std::to_string(patience->count());
  message += " s, and this request waited; try again";
  return Error{ErrorCode::kUnavailable, std::move(message), ""};
}

void Turns::leave(const std::string& tenant) {
  const core::MutexLock lock(mutex_);
  --taken_;
  if (--places_by_tenant_[tenant] == 0) {
    places_by_tenant_.erase(tenant);
  }
  changed_.notify_all();
}

}  // namespace server
