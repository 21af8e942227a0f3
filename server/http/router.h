/// The table of routes and its matcher.
///
/// Patterns: `/v1/jobs/{id}/events`. A segment is a literal, a `{name}`, or a literal with an
/// optional extension: `image{.format}` matches `image` (format "") and `image.png` (format "png").
/// A last segment `{name...}` takes the rest of the path, slashes included. Literals win over
/// parameters. Segments are split before percent-decoding, so %2F never makes a new segment.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/message.h"

namespace server {

struct BodyPolicy {
  enum class Kind : std::uint8_t {
    kNone,   ///< A body is skipped.
    kJson,   ///< Read whole into Request::body; a Content-Type other than JSON is 415.
    kStream  ///< Read by the handler through Request::body_reader; any Content-Type.
  };
  Kind kind = Kind::kNone;
  std::uint64_t limit_bytes = 0;  ///< 413 beyond.
  /// Limit of a body with Content-Type image/..., which the handler reads as with kStream; 0: not
  /// accepted.
  std::uint64_t picture_limit_bytes = 0;

  static constexpr BodyPolicy none() { return {}; }
  static constexpr BodyPolicy json(std::uint64_t limit_bytes = 1U << 20U) {
    return {.kind = Kind::kJson, .limit_bytes = limit_bytes};
  }
  static constexpr BodyPolicy json_or_picture(std::uint64_t json_bytes,
                                              std::uint64_t picture_bytes) {
    return {.kind = Kind::kJson, .limit_bytes = json_bytes, .picture_limit_bytes = picture_bytes};
  }
  static constexpr BodyPolicy stream(std::uint64_t limit_bytes) {
    return {.kind = Kind::kStream, .limit_bytes = limit_bytes};
  }
};

using Handler = std::function<Response(Request&)>;

struct Route {
  std::string method;  ///< "GET" answers HEAD too; the server handles OPTIONS.
  std::string pattern;
  std::string alias_of = {};  ///< Pattern of the route whose rights it needs, if it is another.
  Handler handler;
  BodyPolicy body = {};
  std::string summary = {};  ///< One line, for the API page.
  bool is_probe = false;     ///< Answered even when the server is full.
};

class Router {
 public:
  /// Aborts (CHECK) on a malformed pattern or two routes that match the same requests.
  explicit Router(std::vector<Route> routes);

  using Params = std::vector<std::pair<std::string, std::string>>;
  struct Match {
    const Route* route = nullptr;  ///< Null: see allow.
    Params params;
    /// Without a route: the path's methods, "GET, HEAD, OPTIONS"; empty: unknown path.
    std::string allow;
  };
  /// raw_path: well-formed path of the request target, undecoded, without query.
  Match match(std::string_view method, std::string_view raw_path) const;

  const std::vector<Route>& routes() const { return routes_; }

 private:
  struct Segment {
    enum class Kind : std::uint8_t { kLiteral, kParam, kExtension, kRest };
    Kind kind = Kind::kLiteral;
    std::string literal;
    std::string name;
  };
  using Pattern = std::vector<Segment>;

  static Pattern parse_pattern(std::string_view pattern);
  static int compare(const Pattern& a, const Pattern& b);
  static bool matches(const Pattern& pattern, const std::vector<std::string>& path, Params& params);

  std::vector<Route> routes_;
  std::vector<std::pair<Pattern, const Route*>> table_;  ///< Most specific pattern first.
};

}  // namespace server
