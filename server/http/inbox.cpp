#include "server/http/inbox.h"

#include <algorithm>
#include <cstring>

#include "core/base/check.h"

namespace server {
namespace {

constexpr std::size_t kFirstBytes = 4U << 10U;

}  // namespace

Channel::Status Inbox::fill(Clock::time_point deadline, std::size_t max_bytes) {
  make_room(max_bytes);
  const std::size_t capacity = std::min(buffer_.size() - end_, max_bytes - (end_ - begin_));
  const Channel::Read read = channel_.read(buffer_.data() + end_, capacity, deadline);
  end_ += read.bytes;
  is_short_of_room_ = end_ == buffer_.size();
  return read.status;
}

Channel::Status Inbox::fill_idle(std::chrono::milliseconds timeout) {
  CHECK(begin_ == end_);
  make_room(kFirstBytes);
  const Channel::Read read =
      channel_.read_idle(buffer_.data() + end_, buffer_.size() - end_, timeout);
  end_ += read.bytes;
  return read.status;
}

void Inbox::shrink() {
  if (buffer_.size() > kFirstBytes && end_ - begin_ <= kFirstBytes) {
    std::vector<char> small(kFirstBytes);
    std::memcpy(small.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    buffer_ = std::move(small);
    is_short_of_room_ = false;
  }
}

void Inbox::make_room(std::size_t max_bytes) {
  const std::size_t unread_bytes = end_ - begin_;
  CHECK(unread_bytes < max_bytes);
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, unread_bytes);
    begin_ = 0;
    end_ = unread_bytes;
  }
  if (end_ == buffer_.size() || (is_short_of_room_ && buffer_.size() < max_bytes)) {
    buffer_.resize(std::min(max_bytes, std::max(kFirstBytes, buffer_.size() * 2)));
  }
}

}  // namespace server
