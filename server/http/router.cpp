#include "server/http/router.h"

#include <algorithm>
#include <array>

#include "core/base/check.h"
#include "core/base/text.h"
#include "server/http/text.h"

namespace server {
namespace {

/// Removes and returns the next segment of a path that begins with '/'.
std::string_view take_segment(std::string_view& path) {
  path.remove_prefix(1);
  const std::size_t end = path.find('/');
  const std::string_view segment = path.substr(0, end);
  path = end == std::string_view::npos ? std::string_view() : path.substr(end);
  return segment;
}

bool is_extension(std::string_view text) { return !text.empty() && core::is_word(text); }

constexpr std::array<std::string_view, 6> kMethodOrder = {"GET", "HEAD",  "POST",
                                                          "PUT", "PATCH", "DELETE"};

/// Returns "GET, HEAD, OPTIONS" from the methods of one path's routes.
std::string make_allow(const std::vector<std::string_view>& methods) {
  std::string allow;
  for (const std::string_view method : kMethodOrder) {
    const std::string_view needed = method == "HEAD" ? std::string_view("GET") : method;
    if (std::find(methods.begin(), methods.end(), needed) != methods.end()) {
      allow += method;
      allow += ", ";
    }
  }
  return allow + "OPTIONS";
}

}  // namespace

Router::Pattern Router::parse_pattern(std::string_view pattern) {
  CHECK(!pattern.empty() && pattern.front() == '/');
  Pattern segments;
  while (!pattern.empty()) {
    const std::string_view text = take_segment(pattern);
    const std::size_t open = text.find('{');
    Segment segment;
    if (open == std::string_view::npos) {
      segment.literal = text;
      segments.push_back(std::move(segment));
      continue;
    }
    CHECK(text.back() == '}');
    std::string_view name = text.substr(open + 1, text.size() - open - 2);
    if (name.substr(0, 1) == ".") {
      CHECK(open > 0);
      segment.kind = Segment::Kind::kExtension;
      segment.literal = text.substr(0, open);
      name.remove_prefix(1);
    } else if (name.size() > 3 && name.substr(name.size() - 3) == "...") {
      CHECK(open == 0 && pattern.empty());
      segment.kind = Segment::Kind::kRest;
      name.remove_suffix(3);
    } else {
      CHECK(open == 0);
      segment.kind = Segment::Kind::kParam;
    }
    CHECK(is_token(name));
    segment.name = name;
    segments.push_back(std::move(segment));
  }
  return segments;
}

/// Returns a negative number if a is tried before b, 0 if they match the same paths.
int Router::compare(const Pattern& a, const Pattern& b) {
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    if (a[i].kind != b[i].kind) {
      return a[i].kind < b[i].kind ? -1 : 1;
    }
    if (const int order = a[i].literal.compare(b[i].literal); order != 0) {
      return order;
    }
  }
  return static_cast<int>(b.size()) - static_cast<int>(a.size());
}

Router::Router(std::vector<Route> routes) : routes_(std::move(routes)) {
  for (const Route& route : routes_) {
    CHECK(route.handler != nullptr);
    CHECK(std::find(kMethodOrder.begin(), kMethodOrder.end(), route.method) != kMethodOrder.end());
    table_.emplace_back(parse_pattern(route.pattern), &route);
  }
  std::stable_sort(table_.begin(), table_.end(),
                   [](const auto& a, const auto& b) { return compare(a.first, b.first) < 0; });
  for (std::size_t i = 1; i < table_.size(); ++i) {
    for (std::size_t j = i; j-- > 0 && compare(table_[i].first, table_[j].first) == 0;) {
      CHECK(table_[i].second->method != table_[j].second->method);
    }
  }
}

bool Router::matches(const Pattern& pattern, const std::vector<std::string>& path, Params& params) {
  params.clear();
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const Segment& segment = pattern[i];
    if (i >= path.size()) {
      return false;
    }
    switch (segment.kind) {
      case Segment::Kind::kLiteral:
        if (path[i] != segment.literal) {
          return false;
        }
        break;
      case Segment::Kind::kParam:
        if (path[i].empty()) {
          return false;
        }
        params.emplace_back(segment.name, path[i]);
        break;
      case Segment::Kind::kExtension: {
        const std::string_view text = path[i];
        if (text.substr(0, segment.literal.size()) != segment.literal) {
          return false;
        }
        const std::string_view rest = text.substr(segment.literal.size());
        if (!rest.empty() && (rest.front() != '.' || !is_extension(rest.substr(1)))) {
          return false;
        }
        params.emplace_back(segment.name, rest.empty() ? rest : rest.substr(1));
        break;
      }
      case Segment::Kind::kRest: {
        std::string rest = path[i];
        for (std::size_t j = i + 1; j < path.size(); ++j) {
          rest += '/';
          rest += path[j];
        }
        params.emplace_back(segment.name, std::move(rest));
        return true;
      }
    }
  }
  return pattern.size() == path.size();
}

Router::Match Router::match(std::string_view method, std::string_view raw_path) const {
  std::vector<std::string> path;
  while (!raw_path.empty() && raw_path.front() == '/') {
    auto segment = percent_decode(take_segment(raw_path), PlusSign::kIsPlus);
    if (!segment) {
      return {};
    }
    path.push_back(std::move(*segment));
  }
  const std::string_view wanted = method == "HEAD" ? std::string_view("GET") : method;
  Match match;
  Params params;
  std::vector<std::string_view> methods;
  const Pattern* found = nullptr;
  for (const auto& [pattern, route] : table_) {
    // Only routes of the most specific pattern are considered: a more general one is another
    // resource.
    if (found != nullptr && compare(*found, pattern) != 0) {
      break;
    }
    if (!matches(pattern, path, params)) {
      continue;
    }
    found = &pattern;
    methods.push_back(route->method);
    if (route->method == wanted) {
      match.route = route;
      match.params = std::move(params);
      return match;
    }
  }
  if (found != nullptr) {
    match.allow = make_allow(methods);
  }
  return match;
}

}  // namespace server
