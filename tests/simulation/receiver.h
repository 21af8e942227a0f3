/// Calls: the network to the receivers of webhooks, in virtual time. A call may be lost, remain
/// without an answer, or be refused.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "server/http/web_post.h"
#include "tests/simulation/executor.h"

namespace simulation {

class Calls final : public server::WebCaller {
 public:
  using Receive = std::function<void(const server::WebPost& post)>;
  /// receive: called with each call that arrives. may_fail: whether calls may fail now.
  Calls(Receive receive, std::function<bool()> may_fail)
      : receive_(std::move(receive)), may_fail_(std::move(may_fail)) {}

  void begin(std::string id, const server::WebPost& post) override;
  std::vector<Ended> wait(std::chrono::milliseconds time) override;
  void wake() override;

 private:
  struct Call {
    std::string id;
    server::WebPost post;
    Nanoseconds end = 0;
  };
  Ended end_of(const Call& call);

  const Receive receive_;
  const std::function<bool()> may_fail_;
  std::vector<Call> calls_;  ///< Used only by the thread that waits.
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_woken_ = false;
};

}  // namespace simulation
