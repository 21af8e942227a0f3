/// Text of server-sent events (HTML standard, section 9.2).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

struct SseEvent {
  std::string_view id = {};     ///< Empty: none. No line breaks, no NUL.
  std::string_view event = {};  ///< Empty: "message". No line breaks.
  std::string_view data = {};   ///< Line breaks of any kind make several `data:` lines.
  std::optional<std::uint32_t> retry_ms = {};
};
/// Ready to send, with the empty line at its end. Line breaks in id and event are dropped.
std::string format_sse(const SseEvent& event);
/// `: text`, which clients skip. For pings.
std::string format_sse_comment(std::string_view text);

/// Identity of an event on the wire: `STREAM-SEQ`, STREAM of [0-9a-z], SEQ decimal.
struct SseId {
  std::string stream;
  std::uint64_t seq = 0;
};
std::string format_sse_id(std::string_view stream, std::uint64_t seq);
/// Empty when it is not of that form: up to 64 characters of stream, a sequence below 2^63.
std::optional<SseId> parse_sse_id(std::string_view text);
/// The Last-Event-ID header, or the query parameter `last_event_id`; empty if absent or malformed.
std::optional<SseId> last_event_id(const Request& request);

}  // namespace server
