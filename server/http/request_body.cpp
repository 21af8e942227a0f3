#include "server/http/request_body.h"

#include <algorithm>
#include <limits>

#include "core/base/text.h"

namespace server {
namespace {

constexpr std::size_t kPieceBytes = 64U << 10U;
constexpr std::size_t kMaxChunkLineBytes = 256;
constexpr std::size_t kMaxTrailerLines = 32;

/// Parses `1a2B`, at most 15 digits so that sums cannot overflow; skips extensions after `;`.
std::optional<std::uint64_t> parse_chunk_size(std::string_view line) {
  std::uint64_t size = 0;
  std::size_t digits = 0;
  for (; digits < line.size(); ++digits) {
    const int value = core::hex_digit(line[digits]);
    if (value < 0) {
      break;
    }
    size = size * 16 + static_cast<unsigned>(value);
  }
  const std::string_view rest = line.substr(digits);
  const std::size_t extension = rest.find_first_not_of(" \t");
  const bool is_rest_valid =
      rest.empty() || (extension != std::string_view::npos && rest[extension] == ';');
  constexpr std::size_t kMaxDigits = 15;
  if (digits == 0 || digits > kMaxDigits || !is_rest_valid) {
    return std::nullopt;
  }
  return size;
}

bool has_control_character(std::string_view line) {
  return std::any_of(line.begin(), line.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && byte != '\t') || byte == 0x7F;
  });
}

}  // namespace

bool RequestBody::read(const Sink& sink) {
  while (true) {
    const std::string_view piece = next_piece();
    if (piece.empty()) {
      return failure_ == Failure::kNone;
    }
    // Consumed before the call: if the sink throws, the bytes must not be parsed as the next
    // request.
    inbox_.consume(piece.size());
    if (!sink(piece)) {
      return false;
    }
  }
}

std::optional<std::uint64_t> RequestBody::declared_bytes() const {
  if (framing_.body == Framing::Body::kChunked) {
    return std::nullopt;
  }
  return framing_.length;
}

bool RequestBody::is_drainable(std::uint64_t max_bytes) const {
  // Without 100 Continue the client may or may not send its body.
  const bool is_known = framing_.body == Framing::Body::kLength && failure_ == Failure::kNone &&
                        (!framing_.expects_continue || has_begun_);
  return is_complete() || (is_known && left_ <= max_bytes);
}

bool RequestBody::drain(std::uint64_t max_bytes) {
  if (!is_drainable(max_bytes)) {
    return false;
  }
  limit_bytes_ = std::numeric_limits<std::uint64_t>::max();
  return is_complete() || read([](std::string_view) { return true; });
}

std::string_view RequestBody::next_piece() {
  if (is_complete() || failure_ != Failure::kNone) {
    return {};
  }
  if (!has_begun_) {
    if (framing_.body == Framing::Body::kLength && framing_.length > limit_bytes_) {
      fail(Failure::kTooLarge);
      return {};
    }
    has_begun_ = true;
    if (framing_.expects_continue && inbox_.unread().empty() &&
        !channel_.write({"HTTP/1.1 100 Continue\r\n\r\n"})) {
      fail(Failure::kDisconnected);
      return {};
    }
  }
  if (framing_.body == Framing::Body::kChunked && left_ == 0 && !begin_chunk()) {
    return {};
  }
  const std::string_view piece = next_content(left_);
  left_ -= piece.size();
  bytes_read_ += piece.size();
  if (framing_.body == Framing::Body::kLength && left_ == 0 && !piece.empty()) {
    is_complete_ = true;
  }
  return piece;
}

std::string_view RequestBody::next_content(std::uint64_t max_bytes) {
  if (inbox_.unread().empty() && !fill()) {
    return {};
  }
  return inbox_.unread().substr(
      0, static_cast<std::size_t>(std::min<std::uint64_t>(max_bytes, kPieceBytes)));
}

bool RequestBody::begin_chunk() {
  if (is_inside_chunk_) {
    const auto after_content = take_line();
    if (!after_content || !after_content->empty()) {
      if (failure_ == Failure::kNone) {
        fail(Failure::kMalformed);
      }
      return false;
    }
  }
  is_inside_chunk_ = true;
  const auto line = take_line();
  if (!line) {
    return false;
  }
  const auto size = parse_chunk_size(*line);
  if (!size) {
    fail(Failure::kMalformed);
    return false;
  }
  if (*size > limit_bytes_ || bytes_read_ > limit_bytes_ - *size) {
    fail(Failure::kTooLarge);
    return false;
  }
  left_ = *size;
  if (*size == 0) {
    is_complete_ = read_trailers();
    return false;
  }
  return true;
}

bool RequestBody::read_trailers() {
  for (std::size_t i = 0; i <= kMaxTrailerLines; ++i) {
    const auto line = take_line();
    if (!line) {
      return false;
    }
    if (line->empty()) {
      return true;
    }
  }
  fail(Failure::kMalformed);
  return false;
}

std::optional<std::string> RequestBody::take_line() {
  while (true) {
    const std::string_view unread = inbox_.unread();
    const std::size_t newline = unread.find('\n');
    if (newline != std::string_view::npos && newline <= kMaxChunkLineBytes) {
      std::string line(unread.substr(0, newline));
      inbox_.consume(newline + 1);
      const bool has_cr = !line.empty() && line.back() == '\r';
      if (has_cr) {
        line.pop_back();
      }
      if (!has_cr || has_control_character(line)) {
        fail(Failure::kMalformed);
        return std::nullopt;
      }
      return line;
    }
    if (unread.size() > kMaxChunkLineBytes) {
      fail(Failure::kMalformed);
      return std::nullopt;
    }
    if (!fill()) {
      return std::nullopt;
    }
  }
}

bool RequestBody::fill() {
  const auto start = Clock::now();
  const std::size_t bytes_before = inbox_.unread().size();
  const Channel::Status status = inbox_.fill(start + pace_.stall, kPieceBytes);
  waited_ += Clock::now() - start;
  received_bytes_ += inbox_.unread().size() - bytes_before;
  if (status == Channel::Status::kClosed) {
    fail(Failure::kDisconnected);
    return false;
  }
  if (status == Channel::Status::kTimeout || !pace_.allows(waited_, received_bytes_)) {
    fail(Failure::kTimeout);
    return false;
  }
  return true;
}

}  // namespace server
