#include "clients/cli/sse.h"

#include <charconv>

namespace cli {

std::vector<ServerEvent> EventParser::feed(std::string_view piece) {
  std::vector<ServerEvent> out;
  for (const char c : piece) {
    if (c == '\n' && after_cr_) {
      after_cr_ = false;
      continue;
    }
    after_cr_ = c == '\r';
    if (c == '\n' || c == '\r') {
      take_line(pending_, out);
      pending_.clear();
    } else {
      pending_ += c;
    }
  }
  return out;
}

void EventParser::take_line(std::string_view line, std::vector<ServerEvent>& out) {
  if (line.empty()) {
    if (has_data_) {
      last_id_ = id_;
      out.push_back(std::move(event_));
    }
    event_ = ServerEvent();
    has_data_ = false;
    return;
  }
  const auto colon = line.find(':');
  const std::string_view field = line.substr(0, colon);
  std::string_view value = colon == std::string_view::npos ? "" : line.substr(colon + 1);
  if (!value.empty() && value.front() == ' ') {
    value.remove_prefix(1);
  }
  if (field == "event") {
    event_.type = value;
  } else if (field == "data") {
    event_.data += has_data_ ? "\n" : "";
    event_.data += value;
    has_data_ = true;
  } else if (field == "id") {
    id_ = value;
  } else if (field == "retry") {
    int ms = 0;
    if (std::from_chars(value.data(), value.data() + value.size(), ms).ec == std::errc()) {
      retry_ms_ = ms;
    }
  }
}

void EventParser::restart() {
  pending_.clear();
  event_ = ServerEvent();
  has_data_ = false;
  after_cr_ = false;
  id_ = last_id_;
}

}  // namespace cli
