#include "server/http/conditional.h"

#include "server/http/text.h"

namespace server {
namespace {

struct Tag {
  std::string_view opaque;
  bool is_weak = false;
  bool is_valid = false;
};

Tag parse_tag(std::string_view text) {
  Tag tag;
  if (text.substr(0, 2) == "W/") {
    tag.is_weak = true;
    text.remove_prefix(2);
  }
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') {
    return tag;
  }
  tag.opaque = text.substr(1, text.size() - 2);
  tag.is_valid = tag.opaque.find('"') == std::string_view::npos;
  constexpr std::string_view kCodingSuffix = "-gzip";
  if (tag.opaque.size() > kCodingSuffix.size() &&
      tag.opaque.substr(tag.opaque.size() - kCodingSuffix.size()) == kCodingSuffix) {
    tag.opaque.remove_suffix(kCodingSuffix.size());
  }
  return tag;
}

enum class Comparison : std::uint8_t { kWeak, kStrong };

bool matches(std::string_view list, std::string_view etag, Comparison comparison) {
  const Tag own = parse_tag(etag);
  if (!own.is_valid) {
    return false;
  }
  if (trim(list) == "*") {
    return true;
  }
  for (const std::string_view element : split_list(list)) {
    const Tag tag = parse_tag(element);
    const bool is_comparable = comparison == Comparison::kWeak || (!tag.is_weak && !own.is_weak);
    if (tag.is_valid && is_comparable && tag.opaque == own.opaque) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::string make_etag(std::string_view opaque) {
  std::string tag = "\"";
  tag += opaque;
  tag += '"';
  return tag;
}

std::string make_weak_etag(std::string_view opaque) { return "W/" + make_etag(opaque); }

bool etag_matches_weakly(std::string_view list, std::string_view etag) {
  return matches(list, etag, Comparison::kWeak);
}

bool etag_matches_strongly(std::string_view list, std::string_view etag) {
  return matches(list, etag, Comparison::kStrong);
}

bool is_not_modified(const Request& request, std::string_view etag) {
  if (request.method != "GET" && request.method != "HEAD") {
    return false;
  }
  const auto list = request.headers.joined("If-None-Match");
  return list && etag_matches_weakly(*list, etag);
}

Response not_modified(std::string_view etag) {
  Response response = empty_response(304);
  response.headers.add("ETag", etag);
  return response;
}

bool precondition_holds(const Request& request, std::string_view etag) {
  const auto list = request.headers.joined("If-Match");
  return !list || etag_matches_strongly(*list, etag);
}

}  // namespace server
