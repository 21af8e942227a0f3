#include "server/http/file_response.h"

#include <algorithm>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/http/conditional.h"
#include "server/http/problem.h"
#include "server/http/text.h"

namespace server {
namespace {

constexpr RangeRequest kUnsatisfiable = {.kind = RangeRequest::Kind::kUnsatisfiable};

/// If-Range requests the part only if the representation is unchanged, by strong comparison.
bool range_applies(const Request& request, std::string_view etag) {
  const auto if_range = request.header("If-Range");
  return !if_range || (trim(*if_range) != "*" && etag_matches_strongly(*if_range, etag));
}

RangeRequest asked_range(const Request& request, std::string_view etag, std::uint64_t total_bytes) {
  const auto header = request.header("Range");
  return header && request.method == "GET" && range_applies(request, etag)
             ? parse_range(*header, total_bytes)
             : RangeRequest{};
}

/// Sets the headers shared by 200, 206 and 304. Returns true for 304.
bool is_answered(const Request& request, const std::string& etag, const std::string& cache_control,
                 Response& response) {
  const bool is_known = !etag.empty() && is_not_modified(request, etag);
  if (is_known) {
    response = not_modified(etag);
  } else if (!etag.empty()) {
    response.headers.add("ETag", etag);
  }
  if (!cache_control.empty()) {
    response.headers.add("Cache-Control", cache_control);
  }
  return is_known;
}

Response unsatisfiable(const Request& request, std::uint64_t total_bytes) {
  Response response =
      problem_response(416,
                       "the range '" + std::string(request.header("Range").value_or("")) +
                           "' does not fit the size of " + std::to_string(total_bytes) + " bytes",
                       request.path);
  response.headers.add("Content-Range", "bytes */" + std::to_string(total_bytes));
  return response;
}

/// Pre: range is of kind kPart.
void announce_part(const RangeRequest& range, std::uint64_t total_bytes, Response& response) {
  response.status = 206;
  response.headers.add("Content-Range", "bytes " + std::to_string(range.offset) + "-" +
                                            std::to_string(range.offset + range.size - 1) + "/" +
                                            std::to_string(total_bytes));
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
    last = UINT64_MAX;  // Does not fit in 64 bits, so beyond any end.
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

Response ranged(const Request& request, Response whole) {
  const auto bytes = std::get<SharedBytes>(whole.body);
  whole.headers.set("Accept-Ranges", "bytes");
  const RangeRequest range =
      asked_range(request, whole.headers.find("ETag").value_or(""), bytes->size());
  if (range.kind == RangeRequest::Kind::kUnsatisfiable) {
    return unsatisfiable(request, bytes->size());
  }
  if (range.kind == RangeRequest::Kind::kPart) {
    announce_part(range, bytes->size(), whole);
    whole.body =
        StreamBody{.producer =
                       [bytes, range](StreamWriter& writer) {
                         writer.write(std::string_view(*bytes).substr(range.offset, range.size));
                       },
                   .bytes = range.size};
  }
  return whole;
}

Response made_response(const Request& request, MadeSource source) {
  Response response;
  if (is_answered(request, source.etag, source.cache_control, response)) {
    return response;
  }
  const RangeRequest range = asked_range(request, source.etag, source.bytes);
  if (range.kind == RangeRequest::Kind::kUnsatisfiable) {
    return unsatisfiable(request, source.bytes);
  }
  const bool is_part = range.kind == RangeRequest::Kind::kPart;
  const std::uint64_t begin = is_part ? range.offset : 0;
  const std::uint64_t size = is_part ? range.size : source.bytes;
  response.headers.add("Content-Type", source.content_type);
  response.headers.add("Accept-Ranges", "bytes");
  if (is_part) {
    announce_part(range, source.bytes, response);
  }
  StreamBody body;
  body.bytes = size;
  body.producer = [make = std::move(source.make), begin, size](StreamWriter& writer) {
    std::uint64_t at = 0;
    make([&](std::string_view piece) {
      const std::uint64_t first = at;
      at += piece.size();
      const std::uint64_t from = std::max(first, begin);
      const std::uint64_t to = std::min(at, begin + size);
      if (from < to && !writer.write(piece.substr(from - first, to - from))) {
        return false;
      }
      return at < begin + size;
    });
  };
  response.body = std::move(body);
  return response;
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
  return file_response(request, FileBody(fd, 0, static_cast<std::uint64_t>(status.st_size)),
                       source);
}

Response file_response(const Request& request, FileBody whole, const FileSource& source) {
  const std::uint64_t total_bytes = whole.size();
  Response response;
  if (is_answered(request, source.etag, source.cache_control, response)) {
    return response;
  }
  const RangeRequest range = asked_range(request, source.etag, total_bytes);
  if (range.kind == RangeRequest::Kind::kUnsatisfiable) {
    return unsatisfiable(request, total_bytes);
  }
  response.headers.add("Content-Type", source.content_type);
  response.headers.add("Accept-Ranges", "bytes");
  if (range.kind == RangeRequest::Kind::kPart) {
    announce_part(range, total_bytes, response);
    response.body = std::move(whole).part(range.offset, range.size);
  } else {
    response.body = std::move(whole);
  }
  return response;
}

}  // namespace server
