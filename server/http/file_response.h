/// Responses from files, with Range, If-Range, If-None-Match and HEAD.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

/// The part of a representation that a Range header requests.
struct RangeRequest {
  enum class Kind : std::uint8_t { kWhole, kPart, kUnsatisfiable };
  Kind kind = Kind::kWhole;
  std::uint64_t offset = 0;  ///< For kPart: offset + size <= total size.
  std::uint64_t size = 0;
};
/// Several ranges and unknown units request the whole, as RFC 9110 section 14.2 allows; a malformed
/// or unsatisfiable `bytes=` range is kUnsatisfiable.
RangeRequest parse_range(std::string_view range, std::uint64_t total_bytes);

struct FileSource {
  std::string path;  ///< A symbolic link as the last component is refused.
  std::string content_type = "application/octet-stream";
  std::string etag = {};           ///< With quotes; may be empty.
  std::string cache_control = {};  ///< May be empty.
};
/// Returns 200, 206, 304, 404 (missing or not a regular file) or 416. Opens the file but reads
/// nothing; it may be unlinked before it has been sent.
Response file_response(const Request& request, const FileSource& source);

/// Returns the same for a file without a name. Owns the descriptor.
Response file_response(const Request& request, FileBody whole, const FileSource& source);

/// Cuts a response of status 200, whose body is SharedBytes, to the range that the request asks
/// for: 206 with the same headers, or 416. Its ETag, if it has one, counts for If-Range.
Response ranged(const Request& request, Response whole);

/// Generated content of known size; every call of `make` must produce the same bytes.
struct MadeSource {
  /// Receives a piece; returns false to cancel generation.
  using Sink = std::function<bool(std::string_view piece)>;
  std::uint64_t bytes = 0;
  std::function<void(const Sink&)> make;  ///< Called while the response is sent.
  std::string content_type = "application/octet-stream";
  std::string etag = {};
  std::string cache_control = {};
};
/// Returns 200, 206, 304 or 416, as for a file.
Response made_response(const Request& request, MadeSource source);

}  // namespace server
