#include "server/http/sse.h"

#include <algorithm>
#include <limits>

#include "server/http/text.h"

namespace server {
namespace {

constexpr std::size_t kMaxStreamChars = 64;

void append_line(std::string& text, std::string_view name, std::string_view value) {
  text += name;
  text += ": ";
  std::copy_if(value.begin(), value.end(), std::back_inserter(text),
               [](char c) { return c != '\r' && c != '\n' && c != '\0'; });
  text += '\n';
}

/// Appends one field per line of value, for any kind of line break.
void append_lines(std::string& text, std::string_view prefix, std::string_view value) {
  while (true) {
    const std::size_t end = value.find_first_of("\r\n");
    text += prefix;
    text += value.substr(0, end);
    text += '\n';
    if (end == std::string_view::npos) {
      return;
    }
    const bool is_crlf = value.substr(end, 2) == "\r\n";
    value.remove_prefix(end + (is_crlf ? 2 : 1));
  }
}

bool is_stream_name(std::string_view text) {
  return !text.empty() && text.size() <= kMaxStreamChars &&
         std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z'); });
}

}  // namespace

std::string format_sse(const SseEvent& event) {
  std::string text;
  text.reserve(event.data.size() + event.id.size() + event.event.size() + 48);
  if (!event.id.empty()) {
    append_line(text, "id", event.id);
  }
  if (!event.event.empty()) {
    append_line(text, "event", event.event);
  }
  if (event.retry_ms) {
    append_line(text, "retry", std::to_string(*event.retry_ms));
  }
  append_lines(text, "data: ", event.data);
  text += '\n';
  return text;
}

std::string format_sse_comment(std::string_view text) {
  std::string comment;
  append_lines(comment, ": ", text);
  comment += '\n';
  return comment;
}

std::string format_sse_id(std::string_view stream, std::uint64_t seq) {
  std::string id(stream);
  id += '-';
  id += std::to_string(seq);
  return id;
}

std::optional<SseId> parse_sse_id(std::string_view text) {
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos || !is_stream_name(text.substr(0, dash))) {
    return std::nullopt;
  }
  const auto seq = parse_decimal(text.substr(dash + 1));
  constexpr auto kMaxSeq = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (!seq || *seq > kMaxSeq) {
    return std::nullopt;
  }
  return SseId{.stream = std::string(text.substr(0, dash)), .seq = *seq};
}

std::optional<SseId> last_event_id(const Request& request) {
  if (const auto header = request.header("Last-Event-ID")) {
    return parse_sse_id(*header);
  }
  if (const auto param = request.query("last_event_id")) {
    return parse_sse_id(*param);
  }
  return std::nullopt;
}

}  // namespace server
