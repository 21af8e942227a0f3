/// Parses a text/event-stream (WHATWG HTML, server-sent events) that arrives in pieces.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct ServerEvent {
  std::string type = "message";
  std::string data;
};

class EventParser {
 public:
  /// Returns the events completed by this piece. Line ends may be LF, CR LF or CR.
  std::vector<ServerEvent> feed(std::string_view piece);

  /// Returns the id of the last complete event that had one, for Last-Event-ID.
  const std::string& last_id() const noexcept { return last_id_; }
  std::optional<int> retry_ms() const noexcept { return retry_ms_; }
  /// Discards the incomplete event of an interrupted connection.
  void restart();

 private:
  void take_line(std::string_view line, std::vector<ServerEvent>& out);
  std::string pending_;
  ServerEvent event_;
  bool has_data_ = false;
  bool after_cr_ = false;
  std::string id_;
  std::string last_id_;
  std::optional<int> retry_ms_;
};

}  // namespace cli
