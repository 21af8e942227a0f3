/// ClientWatch: detects clients that disconnect while their handlers wait for something else.
///
/// Uses one thread and one epoll set for all connections; an idle stream costs nothing until its
/// client disconnects.
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
    ///< Stop requested when the client disconnects or the server shuts down.
    std::stop_source stop;
    std::atomic<bool> client_gone = false;
  };

  ClientWatch();
  ~ClientWatch();
  ClientWatch(const ClientWatch&) = delete;
  ClientWatch& operator=(const ClientWatch&) = delete;

  /// Watches until the result is destroyed; destroy it before closing the descriptor.
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

  /// Requests a stop of all clients' tokens, current and future, when the server shuts down.
  void stop_all() EXCLUDES(mutex_);
  bool is_stopping() const { return is_stopping_.load(); }

 private:
  void run();

  int epoll_fd_ = -1;
  int wake_fd_ = -1;
  core::Mutex mutex_;
  std::unordered_map<std::uint64_t, std::shared_ptr<State>> states_ GUARDED_BY(mutex_);
  std::uint64_t last_id_ GUARDED_BY(mutex_) = 0;  ///< Instead of the fd, which may be reused.
  std::atomic<bool> is_stopping_ = false;
  std::thread thread_;
};

}  // namespace server
