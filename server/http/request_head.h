/// Parses the head of a request strictly, so that all readers of the same bytes agree (RFC 9112).
///
/// Refused: lines that do not end in CRLF, folded lines, NUL and other control characters, spaces
/// before the colon, a Content-Length that is repeated, not a number or together with
/// Transfer-Encoding, any transfer coding other than `chunked`, content codings, two Host fields,
/// HTTP other than 1.0 and 1.1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

struct HeadLimits {
  std::size_t bytes = 32U << 10U;
  std::size_t lines = 100;  ///< Headers, without the request line.
  std::size_t target_bytes = 8U << 10U;
};

/// Why a request is refused before routing.
struct Refusal {
  int status = 400;
  std::string detail;
};

/// Finds the end of a head as it arrives; examines each byte once.
class HeadScanner {
 public:
  explicit HeadScanner(HeadLimits limits) : limits_(limits) {}

  struct Progress {
    std::size_t head_bytes = 0;  ///< Length of the whole head, 0 while it is incomplete.
    std::optional<Refusal> refusal;
  };
  /// received: all bytes since the start of the request; longer at each call.
  Progress scan(std::string_view received);

 private:
  HeadLimits limits_;
  std::size_t line_begin_ = 0;
  std::size_t scanned_ = 0;
  std::size_t lines_ = 0;  ///< Complete lines, including the request line.
};

/// Framing of the body, and whether the connection may be reused.
struct Framing {
  enum class Body : std::uint8_t { kNone, kLength, kChunked };
  Body body = Body::kNone;
  std::uint64_t length = 0;  ///< For kLength; above 0.
  bool is_http_1_1 = true;
  bool wants_keep_alive = true;
  bool expects_continue = false;
};

/// Fills method, target, path, query_params and headers of the request, as far as parsing succeeds.
/// head: from HeadScanner, including the final empty line.
struct ParsedHead {
  Framing framing;
  std::string_view raw_path;  ///< Undecoded, without query; points into request.target.
  std::optional<Refusal> refusal;
};
ParsedHead parse_head(std::string_view head, HeadLimits limits, Request& request);

}  // namespace server
