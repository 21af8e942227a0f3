/// RequestBody: the body of one request. Limits its size and rate, and records whether all of it
/// was read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/inbox.h"
#include "server/http/message.h"
#include "server/http/request_head.h"

namespace server {

class RequestBody final : public BodyReader {
 public:
  /// limit_bytes: of content; a larger declared size fails at the first read.
  RequestBody(Channel& channel, Inbox& inbox, Framing framing, Pace pace)
      : channel_(channel), inbox_(inbox), framing_(framing), pace_(pace), left_(framing.length) {}

  enum class Failure : std::uint8_t { kNone, kTooLarge, kTimeout, kMalformed, kDisconnected };

  void set_limit(std::uint64_t limit_bytes) { limit_bytes_ = limit_bytes; }
  bool read(const Sink& sink) override;
  std::uint64_t bytes_read() const override { return bytes_read_; }
  std::optional<std::uint64_t> declared_bytes() const override;

  /// Skips the rest of the body if it is at most max_bytes long and the client does not wait for a
  /// 100.
  bool drain(std::uint64_t max_bytes);
  /// Returns whether drain() is expected to succeed; call before the response is sent.
  bool is_drainable(std::uint64_t max_bytes) const;
  bool is_complete() const { return is_complete_ || framing_.body == Framing::Body::kNone; }
  Failure failure() const { return failure_; }
  std::uint64_t limit_bytes() const { return limit_bytes_; }

 private:
  /// Returns the next bytes of content; empty at the end and after a failure.
  std::string_view next_piece();
  std::string_view next_content(std::uint64_t max_bytes);
  /// Reads up to the content of the next chunk; sets left_. Returns false at the end or on failure.
  bool begin_chunk();
  /// Returns a line without its CRLF; empty on failure.
  std::optional<std::string> take_line();
  bool read_trailers();
  bool fill();
  void fail(Failure failure) { failure_ = failure; }

  Channel& channel_;
  Inbox& inbox_;
  Framing framing_;
  Pace pace_;
  std::uint64_t limit_bytes_ = 0;
  std::uint64_t left_;  ///< Bytes left in the body, or in the current chunk.
  std::uint64_t bytes_read_ = 0;
  std::uint64_t received_bytes_ = 0;  ///< Including framing, since the first wait.
  Clock::duration waited_ = {};
  bool is_complete_ = false;
  bool is_inside_chunk_ = false;
  bool has_begun_ = false;
  Failure failure_ = Failure::kNone;
};

}  // namespace server
