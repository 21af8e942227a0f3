/// Files with everything a client may ask of them: Range, If-Range, If-None-Match, HEAD.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

/// What a Range header asks of a representation of a known size.
struct RangeRequest {
  enum class Kind : std::uint8_t { kWhole, kPart, kUnsatisfiable };
  Kind kind = Kind::kWhole;
  std::uint64_t offset = 0;  ///< Of kPart: offset + size <= the whole.
  std::uint64_t size = 0;
};
/// Several ranges and unknown units ask for the whole, as RFC 9110 section 14.2 allows; a malformed
/// or unsatisfiable `bytes=` range is kUnsatisfiable.
RangeRequest parse_range(std::string_view range, std::uint64_t total_bytes);

struct FileSource {
  std::string path;  ///< A symbolic link as its last part is refused.
  std::string content_type = "application/octet-stream";
  std::string etag = {};           ///< With quotes; may be empty.
  std::string cache_control = {};  ///< May be empty.
};
/// 200, 206, 304, 404 (not there, not a regular file) or 416. Reads nothing yet: the file is opened
/// here and may be unlinked before it has been sent.
Response file_response(const Request& request, const FileSource& source);

/// Content of a known size that is made anew, and the same, whenever it is asked for.
struct MadeSource {
  /// Receives it piece by piece; false ends the making.
  using Sink = std::function<bool(std::string_view piece)>;
  std::uint64_t bytes = 0;
  std::function<void(const Sink&)> make;  ///< Runs while the answer is sent.
  std::string content_type = "application/octet-stream";
  std::string etag = {};
  std::string cache_control = {};
};
/// 200, 206, 304 or 416, as for a file.
Response made_response(const Request& request, MadeSource source);

}  // namespace server
