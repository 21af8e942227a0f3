/// Server-sent events (HTML standard, section 9.2).
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
/// Returns the event ready to send, with its final empty line. Drops line breaks in id and event.
std::string format_sse(const SseEvent& event);
/// Returns `: text`, which clients ignore. For keep-alives.
std::string format_sse_comment(std::string_view text);

/// Id of an event: `STREAM-SEQ`, STREAM of [0-9a-z], SEQ decimal.
struct SseId {
  std::string stream;
  std::uint64_t seq = 0;
};
std::string format_sse_id(std::string_view stream, std::uint64_t seq);
/// Returns empty unless it has that form: up to 64 characters of stream, a sequence below 2^63.
std::optional<SseId> parse_sse_id(std::string_view text);
/// Returns the Last-Event-ID header or query parameter `last_event_id`; empty if absent or
/// malformed.
std::optional<SseId> last_event_id(const Request& request);

}  // namespace server
