/// gzip for responses, at the fastest level.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace server {

/// Produces a gzip stream incrementally.
class GzipEncoder {
 public:
  GzipEncoder();
  ~GzipEncoder();
  GzipEncoder(const GzipEncoder&) = delete;
  GzipEncoder& operator=(const GzipEncoder&) = delete;

  /// Appends to `out` all output that a decoder needs for the bytes so far.
  void encode(std::string_view bytes, std::string& out);
  /// Appends the end of the stream. No call may follow.
  void finish(std::string_view last_bytes, std::string& out);

 private:
  void run(std::string_view bytes, int flush, std::string& out);

  struct State;
  std::unique_ptr<State> state_;
};

std::string gzip(std::string_view bytes);

}  // namespace server
