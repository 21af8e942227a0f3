#include "server/http/channel.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <limits>

#include <fcntl.h>
#include <poll.h>
#include <sys/sendfile.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/uio.h>

#include "core/base/check.h"

namespace server {

bool Pace::allows(Clock::duration waited, std::uint64_t bytes) const {
  const double seconds = std::chrono::duration<double>(waited).count();
  return waited <= stall ||
         static_cast<double>(bytes) >= seconds * static_cast<double>(min_bytes_per_second);
}

bool poll_until(int fd, short events, Clock::time_point deadline) {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    const auto timeout_ms = std::clamp<std::int64_t>(left, 0, std::numeric_limits<int>::max());
    pollfd entry = {.fd = fd, .events = events, .revents = 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(timeout_ms));
    if (ready > 0) {
      return true;
    }
    if (ready == 0 || errno != EINTR) {
      return false;
    }
  }
}

bool WriteMeter::wait(int fd, short events) {
  const auto start = Clock::now();
  if (!poll_until(fd, events, start + pace_.stall)) {
    return false;
  }
  waited_ += Clock::now() - start;
  return pace_.allows(waited_, bytes_);
}

namespace {

bool would_block() { return errno == EAGAIN; }  // The same as EWOULDBLOCK on Linux.

}  // namespace

Channel::Read SocketChannel::read(char* into, std::size_t capacity, Clock::time_point deadline) {
  while (true) {
    const ssize_t bytes = ::recv(fd_, into, capacity, MSG_DONTWAIT);
    if (bytes > 0) {
      return {.status = Status::kOk, .bytes = static_cast<std::size_t>(bytes)};
    }
    if (bytes < 0 && errno == EINTR) {
      continue;
    }
    if (bytes == 0 || !would_block()) {
      return {.status = Status::kClosed};
    }
    if (!poll_until(fd_, POLLIN, deadline)) {
      return {.status = Status::kTimeout};
    }
  }
}

Channel::Read SocketChannel::read_idle(char* into, std::size_t capacity,
                                       std::chrono::milliseconds timeout) {
  if (timeout != idle_timeout_) {
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(timeout);
    const auto rest = std::chrono::duration_cast<std::chrono::microseconds>(timeout - seconds);
    const timeval value = {.tv_sec = seconds.count(), .tv_usec = rest.count()};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &value, sizeof(value));
    idle_timeout_ = timeout;
  }
  while (true) {
    const ssize_t bytes = ::recv(fd_, into, capacity, 0);
    if (bytes > 0) {
      return {.status = Status::kOk, .bytes = static_cast<std::size_t>(bytes)};
    }
    if (bytes < 0 && errno == EINTR) {
      continue;
    }
    return {.status = bytes < 0 && would_block() ? Status::kTimeout : Status::kClosed};
  }
}

bool SocketChannel::write(std::initializer_list<std::string_view> pieces) {
  constexpr std::size_t kMaxPieces = 4;
  CHECK(pieces.size() <= kMaxPieces);
  std::array<iovec, kMaxPieces> vectors = {};
  std::size_t count = 0;
  for (const std::string_view piece : pieces) {
    if (!piece.empty()) {
      // sendmsg only reads through this pointer; the C interface lacks const.
      vectors[count++] = {.iov_base = const_cast<char*>(piece.data()), .iov_len = piece.size()};
    }
  }
  iovec* next = vectors.data();
  while (count > 0) {
    msghdr message = {};
    message.msg_iov = next;
    message.msg_iovlen = count;
    const ssize_t sent = ::sendmsg(fd_, &message, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno == EINTR || (would_block() && meter_.wait(fd_, POLLOUT))) {
        continue;
      }
      return false;
    }
    auto left = static_cast<std::size_t>(sent);
    meter_.add(left);
    while (count > 0 && left >= next->iov_len) {
      left -= next->iov_len;
      ++next;
      --count;
    }
    if (count > 0) {
      next->iov_base = static_cast<char*>(next->iov_base) + left;
      next->iov_len -= left;
    }
  }
  return true;
}

bool SocketChannel::write_file(int file_fd, std::uint64_t offset, std::uint64_t size) {
  constexpr std::uint64_t kPieceBytes = 1U << 20U;
  // sendfile has no non-blocking flag.
  const int flags = ::fcntl(fd_, F_GETFL);
  ::fcntl(fd_, F_SETFL, flags | O_NONBLOCK);
  auto position = static_cast<off_t>(offset);
  bool is_ok = true;
  while (size > 0 && is_ok) {
    const ssize_t sent =
        ::sendfile(fd_, file_fd, &position, static_cast<std::size_t>(std::min(size, kPieceBytes)));
    if (sent > 0) {
      size -= static_cast<std::uint64_t>(sent);
      meter_.add(static_cast<std::uint64_t>(sent));
    } else {
      is_ok = sent < 0 && (errno == EINTR || (would_block() && meter_.wait(fd_, POLLOUT)));
    }
  }
  ::fcntl(fd_, F_SETFL, flags);
  return is_ok;
}

void SocketChannel::restart_pace() { meter_.restart(); }

void SocketChannel::finish_writing() { ::shutdown(fd_, SHUT_WR); }

}  // namespace server
