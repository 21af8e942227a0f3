/// Sees that clients have gone while their handlers wait for something else.
///
/// One thread and one epoll set for all; a silent stream costs nothing until its client leaves.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <thread>
#include <unordered_map>

#include "core/base/mutex.h"

namespace server {

class ClientWatch {
 public:
  struct State {
    std::stop_source stop;  ///< Asked when the client has gone or the server ends.
    std::atomic<bool> client_gone = false;
  };

  ClientWatch();
  ~ClientWatch();
  ClientWatch(const ClientWatch&) = delete;
  ClientWatch& operator=(const ClientWatch&) = delete;

  /// Watches until the result is destroyed, which must happen before the descriptor is closed.
  class Registration {
   public:
    Registration(ClientWatch& watch, int fd);
    ~Registration();
    Registration(const Registration&) = delete;
    Registration& operator=(const Registration&) = delete;
    State& state() const { return *state_; }

   private:
    ClientWatch& watch_;
    int fd_;
    std::uint64_t id_ = 0;
    std::shared_ptr<State> state_ = std::make_shared<State>();
  };

  /// The server ends: asks all clients' tokens to stop, and those of later registrations.
  void stop_all() EXCLUDES(mutex_);
  bool is_stopping() const { return is_stopping_.load(); }

 private:
  void run();

  int epoll_fd_ = -1;
  int wake_fd_ = -1;
  core::Mutex mutex_;
  std::unordered_map<std::uint64_t, std::shared_ptr<State>> states_ GUARDED_BY(mutex_);
  std::uint64_t last_id_ GUARDED_BY(mutex_) = 0;  ///< Not the fd, which may be reused.
  std::atomic<bool> is_stopping_ = false;
  std::thread thread_;
};

}  // namespace server
