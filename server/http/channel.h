/// Channel: bytes to and from one client, with a limit on every wait.
///
/// Two implementations: SocketChannel, and TlsChannel in tls.h.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace server {

using Clock = std::chrono::steady_clock;

/// Limits for clients that send or read slowly.
struct Pace {
  std::chrono::milliseconds stall{10000};     ///< Longest single wait.
  std::uint64_t min_bytes_per_second = 1024;  ///< Over the time spent waiting, after one stall.

  /// Returns whether a client keeps to them. waited: for `bytes` in all.
  bool allows(Clock::duration waited, std::uint64_t bytes) const;
};

/// Returns true if an event of poll(2) occurred. Rounds up, so that a wait never ends before its
/// deadline.
bool poll_until(int fd, short events, Clock::time_point deadline);

/// Bytes that a client took, and the time spent waiting for it, since restart().
class WriteMeter {
 public:
  explicit WriteMeter(Pace pace) : pace_(pace) {}
  void restart() { *this = WriteMeter(pace_); }
  void add(std::uint64_t bytes) { bytes_ += bytes; }
  /// Waits for events of poll(2). Returns false if the client is gone or too slow.
  bool wait(int fd, short events);

 private:
  Pace pace_;
  Clock::duration waited_ = {};
  std::uint64_t bytes_ = 0;
};

class Channel {
 public:
  enum class Status : std::uint8_t { kOk, kClosed, kTimeout };
  struct Read {
    Status status = Status::kOk;
    std::size_t bytes = 0;  ///< At least 1 when status is kOk.
  };

  virtual ~Channel() = default;

  /// Waits for some bytes until the deadline.
  virtual Read read(char* into, std::size_t capacity, Clock::time_point deadline) = 0;
  /// The same for a client expected to be idle: one system call when bytes arrive in time.
  virtual Read read_idle(char* into, std::size_t capacity, std::chrono::milliseconds timeout) = 0;
  /// Writes all pieces (at most 4) in order. Returns false when the client is gone or too slow;
  /// then do not write again.
  virtual bool write(std::initializer_list<std::string_view> pieces) = 0;
  /// Sends `size` bytes of a file from `offset`. Also returns false when the file ends early.
  virtual bool write_file(int file_fd, std::uint64_t offset, std::uint64_t size) = 0;
  /// Resets the time spent waiting; call it for each response.
  virtual void restart_pace() = 0;
  /// Announces that nothing more will be written.
  virtual void finish_writing() = 0;
  virtual int fd() const = 0;
};

/// Plain TCP. The descriptor is borrowed.
class SocketChannel final : public Channel {
 public:
  SocketChannel(int fd, Pace pace) : fd_(fd), meter_(pace) {}

  Read read(char* into, std::size_t capacity, Clock::time_point deadline) override;
  Read read_idle(char* into, std::size_t capacity, std::chrono::milliseconds timeout) override;
  bool write(std::initializer_list<std::string_view> pieces) override;
  bool write_file(int file_fd, std::uint64_t offset, std::uint64_t size) override;
  void restart_pace() override;
  void finish_writing() override;
  int fd() const override { return fd_; }

 private:
  int fd_;
  WriteMeter meter_;
  std::chrono::milliseconds idle_timeout_{0};  ///< Set on the socket; 0: not yet.
};

}  // namespace server
