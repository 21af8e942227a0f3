#include "server/http/client_watch.h"

#include <array>
#include <cerrno>
#include <vector>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/check.h"
#include "server/http/signal_block.h"

namespace server {
namespace {

constexpr std::uint64_t kWakeId = 0;

void set_option(int fd, int level, int name, int value) {
  ::setsockopt(fd, level, name, &value, sizeof(value));
}

/// Makes the kernel detect a peer that vanished silently within about a minute.
void probe_silent_peer(int fd) {
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, 20);
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, 10);
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
}

}  // namespace

ClientWatch::ClientWatch()
    : epoll_fd_(::epoll_create1(EPOLL_CLOEXEC)), wake_fd_(::eventfd(0, EFD_CLOEXEC)) {
  CHECK(epoll_fd_ >= 0 && wake_fd_ >= 0);
  epoll_event event = {};
  event.events = EPOLLIN;
  event.data.u64 = kWakeId;
  CHECK(::epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, wake_fd_, &event) == 0);
  const SignalBlock block;
  thread_ = std::thread([this] { run(); });
}

ClientWatch::~ClientWatch() {
  const std::uint64_t one = 1;
  CHECK(::write(wake_fd_, &one, sizeof(one)) == sizeof(one));
  thread_.join();
  ::close(wake_fd_);
  ::close(epoll_fd_);
}

ClientWatch::Registration::Registration(ClientWatch& watch, int fd) : watch_(watch), fd_(fd) {
  {
    core::MutexLock lock(watch_.mutex_);
    id_ = ++watch_.last_id_;
    watch_.states_.emplace(id_, state_);
  }
  // Checked after the insertion: either stop_all() finds the state, or the flag is seen here.
  if (watch_.is_stopping()) {
    state_->stop.request_stop();
  }
  probe_silent_peer(fd_);
  epoll_event event = {};
  event.events = EPOLLRDHUP | EPOLLONESHOT;
  event.data.u64 = id_;
  ::epoll_ctl(watch_.epoll_fd_, EPOLL_CTL_ADD, fd_, &event);
}

ClientWatch::Registration::~Registration() {
  ::epoll_ctl(watch_.epoll_fd_, EPOLL_CTL_DEL, fd_, nullptr);
  core::MutexLock lock(watch_.mutex_);
  watch_.states_.erase(id_);
}

void ClientWatch::stop_all() {
  is_stopping_ = true;
  std::vector<std::shared_ptr<State>> states;
  {
    core::MutexLock lock(mutex_);
    for (const auto& [id, state] : states_) {
      states.push_back(state);
    }
  }
  for (const auto& state : states) {
    state->stop.request_stop();
  }
}

void ClientWatch::run() {
  std::array<epoll_event, 64> events = {};
  while (true) {
    const int count =
        ::epoll_wait(epoll_fd_, events.data(), static_cast<int>(events.size()), /*timeout=*/-1);
    CHECK(count >= 0 || errno == EINTR);
    for (int i = 0; i < count; ++i) {
      const std::uint64_t id = events[static_cast<std::size_t>(i)].data.u64;
      if (id == kWakeId) {
        return;
      }
      std::shared_ptr<State> state;
      {
        core::MutexLock lock(mutex_);
        if (const auto found = states_.find(id); found != states_.end()) {
          state = found->second;
        }
      }
      if (state != nullptr) {
        state->client_gone = true;
        state->stop.request_stop();
      }
    }
  }
}

}  // namespace server
