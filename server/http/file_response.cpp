#include "server/http/file_response.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "server/http/conditional.h"
#include "server/http/problem.h"
#include "server/http/text.h"

namespace server {
namespace {

constexpr RangeRequest kUnsatisfiable = {.kind = RangeRequest::Kind::kUnsatisfiable};

/// If-Range asks for the part only while the representation is still the same, compared strongly.
bool range_applies(const Request& request, std::string_view etag) {
  const auto if_range = request.header("If-Range");
  return !if_range || (trim(*if_range) != "*" && etag_matches_strongly(*if_range, etag));
}

}  // namespace

RangeRequest parse_range(std::string_view range, std::uint64_t total_bytes) {
  constexpr std::string_view kUnit = "bytes=";
  range = trim(range);
  if (!equal_ignoring_case(range.substr(0, kUnit.size()), kUnit)) {
    return {};
  }
  range.remove_prefix(kUnit.size());
  if (range.find(',') != std::string_view::npos) {
    return {};
  }
  range = trim(range);
  const std::size_t dash = range.find('-');
  if (dash == std::string_view::npos || total_bytes == 0) {
    return kUnsatisfiable;
  }
  const auto first = parse_decimal(range.substr(0, dash));
  auto last = parse_decimal(range.substr(dash + 1));
  const std::string_view last_text = range.substr(dash + 1);
  if (!last && !last_text.empty() &&
      last_text.find_first_not_of("0123456789") == std::string_view::npos) {
    last = UINT64_MAX;  // Too long for 64 bits, and so beyond every end.
  }
  if (dash == 0) {
    if (!last || *last == 0) {
      return kUnsatisfiable;
    }
    const std::uint64_t size = std::min(*last, total_bytes);
    return {.kind = RangeRequest::Kind::kPart, .offset = total_bytes - size, .size = size};
  }
  const bool is_open_ended = dash + 1 == range.size();
  if (!first || (!last && !is_open_ended) || *first >= total_bytes || (last && *last < *first)) {
    return kUnsatisfiable;
  }
  const std::uint64_t end = last ? std::min(*last, total_bytes - 1) : total_bytes - 1;
  return {.kind = RangeRequest::Kind::kPart, .offset = *first, .size = end - *first + 1};
}

Response file_response(const Request& request, const FileSource& source) {
  const int fd = ::open(source.path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  struct stat status = {};
  if (fd < 0 || ::fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
    if (fd >= 0) {
      ::close(fd);
    }
    return problem_response(404, "there is no such file", request.path);
  }
  const auto total_bytes = static_cast<std::uint64_t>(status.st_size);
  FileBody whole(fd, 0, total_bytes);

  Response response;
  if (!source.etag.empty()) {
    if (is_not_modified(request, source.etag)) {
      response = not_modified(source.etag);
      if (!source.cache_control.empty()) {
        response.headers.add("Cache-Control", source.cache_control);
      }
      return response;
    }
    response.headers.add("ETag", source.etag);
  }
  if (!source.cache_control.empty()) {
    response.headers.add("Cache-Control", source.cache_control);
  }
  response.headers.add("Content-Type", source.content_type);
  response.headers.add("Accept-Ranges", "bytes");

  const auto range_header = request.header("Range");
  RangeRequest range;
  if (range_header && request.method == "GET" && range_applies(request, source.etag)) {
    range = parse_range(*range_header, total_bytes);
  }
  switch (range.kind) {
    case RangeRequest::Kind::kWhole:
      response.body = std::move(whole);
      break;
    case RangeRequest::Kind::kPart: {
      response.status = 206;
      const std::uint64_t last = range.offset + range.size - 1;
      response.headers.add("Content-Range", "bytes " + std::to_string(range.offset) + "-" +
                                                std::to_string(last) + "/" +
                                                std::to_string(total_bytes));
      response.body = std::move(whole).part(range.offset, range.size);
      break;
    }
    case RangeRequest::Kind::kUnsatisfiable:
      response = problem_response(416,
                                  "the range '" + std::string(*range_header) +
                                      "' does not fit the size of " + std::to_string(total_bytes) +
                                      " bytes",
                                  request.path);
      response.headers.add("Content-Range", "bytes */" + std::to_string(total_bytes));
      break;
  }
  return response;
}

}  // namespace server
