/// Inbox: bytes received from a client and not yet consumed. Bytes after one request stay for the
/// next.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "server/http/channel.h"

namespace server {

class Inbox {
 public:
  explicit Inbox(Channel& channel) : channel_(channel) {}

  /// Valid until the next non-const call.
  std::string_view unread() const { return {buffer_.data() + begin_, end_ - begin_}; }
  void consume(std::size_t bytes) { begin_ += bytes; }

  /// Appends bytes that arrive before the deadline, making room for at least one. The buffer never
  /// holds more than max_bytes unread bytes (pre: it holds fewer now).
  Channel::Status fill(Clock::time_point deadline, std::size_t max_bytes);
  /// The same for an idle client. Pre: nothing is unread.
  Channel::Status fill_idle(std::chrono::milliseconds timeout);
  /// Frees memory and keeps the unread bytes.
  void shrink();

 private:
  void make_room(std::size_t max_bytes);

  Channel& channel_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  bool is_short_of_room_ = false;  ///< The last read filled the buffer.
};

}  // namespace server
