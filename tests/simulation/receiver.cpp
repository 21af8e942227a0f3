#include "tests/simulation/receiver.h"

#include <algorithm>
#include <utility>

#include "tests/simulation/faults.h"

namespace simulation {
namespace {

/// The sender asks twice a second for calls that are due. So many times would be most of what a
/// day costs, and nothing that is checked depends on it.
constexpr Nanoseconds kPoll = 120 * kSecond;
constexpr Nanoseconds kCallMean = kSecond / 2;

}  // namespace

void Calls::begin(std::string id, const server::WebPost& post) {
  const auto time = static_cast<Nanoseconds>(randomness().exponential(kCallMean));
  calls_.push_back({.id = std::move(id), .post = post, .end = now() + time});
}

Calls::Ended Calls::end_of(const Call& call) {
  const core::Error silence = {core::ErrorCode::kUnavailable, "no answer", ""};
  if (may_fail_() && strikes(Fault::kCallLost)) {
    return {.id = call.id, .status = silence};
  }
  if (may_fail_() && strikes(Fault::kCallRefused)) {
    return {.id = call.id, .status = 503};
  }
  receive_(call.post);
  if (may_fail_() && strikes(Fault::kCallUnanswered)) {
    return {.id = call.id, .status = silence};
  }
  return {.id = call.id, .status = 204};
}

std::vector<Calls::Ended> Calls::wait(std::chrono::milliseconds /*time*/) {
  Nanoseconds until = now() + kPoll;
  for (const Call& call : calls_) {
    until = std::min(until, call.end);
  }
  {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::nanoseconds(std::max<Nanoseconds>(until - now(), 0)),
                      [this] { return is_woken_; });
    is_woken_ = false;
  }
  std::vector<Ended> ended;
  std::erase_if(calls_, [&](const Call& call) {
    if (call.end > now()) {
      return false;
    }
    ended.push_back(end_of(call));
    return true;
  });
  return ended;
}

void Calls::wake() {
  const std::scoped_lock lock(mutex_);
  is_woken_ = true;
  changed_.notify_all();
}

}  // namespace simulation
