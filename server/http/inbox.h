/// Bytes received from a client and not yet used. What follows one request stays for the next.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "server/http/channel.h"

namespace server {

class Inbox {
 public:
  explicit Inbox(Channel& channel) : channel_(channel) {}

  /// Valid until the next call that is not const.
  std::string_view unread() const { return {buffer_.data() + begin_, end_ - begin_}; }
  void consume(std::size_t bytes) { begin_ += bytes; }

  /// Appends what arrives before the deadline, making room for at least one byte; the buffer never
  /// holds more than max_bytes unread ones (pre: fewer are there now).
  Channel::Status fill(Clock::time_point deadline, std::size_t max_bytes);
  /// The same from an idle client; pre: nothing is unread.
  Channel::Status fill_idle(std::chrono::milliseconds timeout);
  /// Gives memory back, keeping what is unread.
  void shrink();

 private:
  void make_room(std::size_t max_bytes);

  Channel& channel_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  bool is_short_of_room_ = false;  ///< The last read could have been longer.
};

}  // namespace server
