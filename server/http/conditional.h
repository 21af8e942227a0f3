/// Entity tags and conditional requests (RFC 9110 section 13).
///
/// Tags include their quotes: `"abc"` or weak `W/"abc"`. The server appends `-gzip` inside the
/// quotes when it compresses a body; comparisons ignore this suffix.
#pragma once

#include <string>
#include <string_view>

#include "server/http/message.h"

namespace server {

/// Returns `"opaque"` or `W/"opaque"`. opaque: no quotes, spaces or control characters.
std::string make_etag(std::string_view opaque);
std::string make_weak_etag(std::string_view opaque);

/// Compares weakly against the list of an If-None-Match; `*` matches everything.
bool etag_matches_weakly(std::string_view list, std::string_view etag);
/// Compares strongly against the list of an If-Match: a weak tag on either side never matches.
bool etag_matches_strongly(std::string_view list, std::string_view etag);

/// True for GET or HEAD whose If-None-Match names this tag: answer not_modified().
bool is_not_modified(const Request& request, std::string_view etag);
/// Returns a 304 with the tag.
Response not_modified(std::string_view etag);

/// True if If-Match is absent or names this tag; otherwise answer 412.
bool precondition_holds(const Request& request, std::string_view etag);

}  // namespace server
