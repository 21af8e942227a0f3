#include "server/http/request_head.h"

#include <algorithm>
#include <array>

#include "core/base/text.h"
#include "server/http/text.h"

namespace server {
namespace {

constexpr std::string_view kCrlf = "\r\n";

Refusal bad_request(std::string detail) { return {.status = 400, .detail = std::move(detail)}; }

Refusal over_limit(int status, std::string_view what, std::size_t limit, std::string_view unit) {
  std::string detail(what);
  detail += ' ';
  detail += std::to_string(limit);
  detail += unit;
  return {.status = status, .detail = std::move(detail)};
}

Refusal bad_field(std::string_view name, std::string_view complaint) {
  std::string detail("the header ");
  detail += name;
  detail += ' ';
  detail += complaint;
  return bad_request(std::move(detail));
}

/// Removes and returns a line; the scanner has checked that each ends in CRLF.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find(kCrlf);
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(text.size(), line.size() + kCrlf.size()));
  return line;
}

bool is_visible_ascii(char c) { return c > 0x20 && c < 0x7F; }

/// RFC 9110 5.5: visible characters, space, tab and bytes above 0x7F.
bool is_field_value(std::string_view value) {
  return std::all_of(value.begin(), value.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte == '\t' || (byte >= 0x20 && byte != 0x7F);
  });
}

/// `host`, `host:port`, `[v6]:port`; only characters that cannot smuggle a path or user.
bool is_authority(std::string_view text) {
  return !text.empty() && core::is_word(text, ".-_:[]%~");
}

/// Removes `http://authority` from an absolute target and sets authority. Returns false if
/// malformed.
bool take_authority(std::string_view& target, std::string& authority) {
  constexpr std::array<std::string_view, 2> kSchemes = {"http://", "https://"};
  for (const std::string_view scheme : kSchemes) {
    if (!equal_ignoring_case(target.substr(0, scheme.size()), scheme)) {
      continue;
    }
    target.remove_prefix(scheme.size());
    const std::size_t end = std::min(target.find_first_of("/?"), target.size());
    authority = target.substr(0, end);
    target.remove_prefix(end);
    return is_authority(authority);
  }
  return false;
}

std::optional<Refusal> parse_target(Request& request, std::string_view& raw_path,
                                    std::string& authority) {
  std::string_view target = request.target;
  if (!std::all_of(target.begin(), target.end(), is_visible_ascii) ||
      target.find('#') != std::string_view::npos) {
    return bad_request("the request target contains a character that must be percent-encoded");
  }
  if (target == "*" && request.method == "OPTIONS") {
    request.path.assign(1, '*');
    raw_path = target;
    return std::nullopt;
  }
  if (target.substr(0, 1) != "/" && !take_authority(target, authority)) {
    return bad_request("the request target must begin with /");
  }
  const std::size_t question = target.find('?');
  raw_path = target.substr(0, question);
  if (raw_path.empty()) {
    raw_path = "/";
  }
  auto path = percent_decode(raw_path, PlusSign::kIsPlus);
  if (!path) {
    return bad_request("the path contains a broken percent-encoding");
  }
  request.path = std::move(*path);
  if (question != std::string_view::npos) {
    auto query = parse_query(target.substr(question + 1));
    if (!query) {
      return bad_request("the query contains a broken percent-encoding");
    }
    request.query_params = std::move(*query);
  }
  return std::nullopt;
}

std::optional<Refusal> parse_request_line(std::string_view line, HeadLimits limits,
                                          Request& request, Framing& framing) {
  const std::size_t method_end = line.find(' ');
  const std::size_t target_end = line.rfind(' ');
  if (method_end == std::string_view::npos || method_end == target_end) {
    return bad_request("the request line must be METHOD TARGET HTTP/1.1");
  }
  const std::string_view method = line.substr(0, method_end);
  const std::string_view target = line.substr(method_end + 1, target_end - method_end - 1);
  const std::string_view version = line.substr(target_end + 1);
  constexpr std::size_t kMaxMethodChars = 20;
  if (!is_token(method) || method.size() > kMaxMethodChars) {
    return bad_request("the request method is malformed");
  }
  request.method = method;
  if (target.size() > limits.target_bytes) {
    return over_limit(414, "the request target is longer than", limits.target_bytes, " bytes");
  }
  request.target = target;
  framing.is_http_1_1 = version == "HTTP/1.1";
  if (!framing.is_http_1_1 && version != "HTTP/1.0") {
    const bool is_http = version.substr(0, 5) == "HTTP/";
    return Refusal{.status = is_http ? 505 : 400, .detail = "the protocol must be HTTP/1.1"};
  }
  return std::nullopt;
}

/// Fields that are ambiguous when repeated.
constexpr std::array<std::string_view, 6> kSingleFields = {
    "Host", "Content-Length", "Transfer-Encoding", "Content-Type", "Authorization", "Origin"};

std::optional<Refusal> parse_field(std::string_view line, Request& request) {
  if (line.front() == ' ' || line.front() == '\t') {
    return bad_request("folded header lines are not accepted");
  }
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon))) {
    return bad_request("a header line must be NAME: VALUE");
  }
  const std::string_view name = line.substr(0, colon);
  const std::string_view value = trim(line.substr(colon + 1));
  if (!is_field_value(value)) {
    return bad_field(name, "contains a control character");
  }
  const bool is_single = std::any_of(kSingleFields.begin(), kSingleFields.end(), [&](auto single) {
    return equal_ignoring_case(single, name);
  });
  if (is_single && request.headers.contains(name)) {
    return bad_field(name, "must not be repeated");
  }
  request.headers.add(name, value);
  return std::nullopt;
}

std::optional<Refusal> parse_body_framing(const Request& request, Framing& framing) {
  const auto length_field = request.header("Content-Length");
  const auto transfer_field = request.header("Transfer-Encoding");
  if (length_field && transfer_field) {
    return bad_request("Content-Length and Transfer-Encoding exclude each other");
  }
  if (transfer_field) {
    if (!framing.is_http_1_1) {
      return bad_request("HTTP/1.0 has no Transfer-Encoding");
    }
    if (!equal_ignoring_case(*transfer_field, "chunked")) {
      return Refusal{.status = 501, .detail = "the only Transfer-Encoding is chunked"};
    }
    framing.body = Framing::Body::kChunked;
  }
  if (length_field) {
    const auto length = parse_decimal(*length_field);
    if (!length) {
      return bad_request("Content-Length must be a decimal number");
    }
    framing.length = *length;
    framing.body = *length > 0 ? Framing::Body::kLength : Framing::Body::kNone;
  }
  if (const auto coding = request.header("Content-Encoding");
      coding && !equal_ignoring_case(*coding, "identity")) {
    return Refusal{.status = 415, .detail = "compressed request bodies are not accepted"};
  }
  if (const auto expect = request.header("Expect")) {
    if (!equal_ignoring_case(*expect, "100-continue")) {
      return Refusal{.status = 417, .detail = "the only supported expectation is 100-continue"};
    }
    framing.expects_continue = framing.is_http_1_1;
  }
  return std::nullopt;
}

bool wants_keep_alive(const Request& request, bool is_http_1_1) {
  bool is_wanted = is_http_1_1;
  if (const auto connection = request.headers.joined("Connection")) {
    for (const std::string_view option : split_list(*connection)) {
      if (equal_ignoring_case(option, "close")) {
        return false;
      }
      is_wanted = is_wanted || equal_ignoring_case(option, "keep-alive");
    }
  }
  return is_wanted;
}

std::optional<Refusal> check_host(Request& request, const Framing& framing,
                                  const std::string& authority) {
  const auto host = request.header("Host");
  if (host && !host->empty() && !is_authority(*host)) {
    return bad_request("the header Host is malformed");
  }
  if (!host && framing.is_http_1_1) {
    return bad_request("the header Host is missing");
  }
  // RFC 9112 3.2.2: an absolute target overrides Host.
  if (!authority.empty()) {
    request.headers.set("Host", authority);
  }
  return std::nullopt;
}

}  // namespace

HeadScanner::Progress HeadScanner::scan(std::string_view received) {
  const auto refuse = [](Refusal refusal) { return Progress{.refusal = std::move(refusal)}; };
  // Refused at once: other protocols (mainly TLS) may never send a line.
  if (!received.empty() && !is_visible_ascii(received.front()) && received.front() != '\r') {
    return refuse(bad_request("this is not HTTP"));
  }
  while (true) {
    const std::size_t newline = received.find('\n', scanned_);
    const std::size_t line_bytes = std::min(newline, received.size()) - line_begin_;
    // Longest method, version and spaces around the target.
    constexpr std::size_t kLineExtraBytes = 64;
    if (lines_ == 0 && line_bytes > limits_.target_bytes + kLineExtraBytes) {
      return refuse(
          over_limit(414, "the request target is longer than", limits_.target_bytes, " bytes"));
    }
    if (std::min(newline, received.size()) >= limits_.bytes) {
      return refuse(over_limit(431, "the headers are longer than", limits_.bytes, " bytes"));
    }
    if (newline == std::string_view::npos) {
      scanned_ = received.size();
      return {};
    }
    if (line_bytes == 0 || received[newline - 1] != '\r') {
      return refuse(bad_request("lines must end in CR LF"));
    }
    scanned_ = newline + 1;
    line_begin_ = scanned_;
    if (line_bytes == 1) {
      if (lines_ == 0) {
        return refuse(bad_request("the request line is empty"));
      }
      return {.head_bytes = scanned_, .refusal = std::nullopt};
    }
    if (++lines_ > limits_.lines + 1) {
      return refuse(over_limit(431, "there are more than", limits_.lines, " headers"));
    }
  }
}

ParsedHead parse_head(std::string_view head, HeadLimits limits, Request& request) {
  ParsedHead parsed;
  if (head.find('\0') != std::string_view::npos) {
    parsed.refusal = bad_request("the head contains a NUL");
    return parsed;
  }
  parsed.refusal = parse_request_line(take_line(head), limits, request, parsed.framing);
  std::string authority;
  if (!parsed.refusal) {
    parsed.refusal = parse_target(request, parsed.raw_path, authority);
  }
  while (!parsed.refusal) {
    const std::string_view line = take_line(head);
    if (line.empty()) {
      break;
    }
    parsed.refusal = parse_field(line, request);
  }
  if (!parsed.refusal) {
    parsed.refusal = check_host(request, parsed.framing, authority);
  }
  if (!parsed.refusal) {
    parsed.refusal = parse_body_framing(request, parsed.framing);
  }
  parsed.framing.wants_keep_alive = wants_keep_alive(request, parsed.framing.is_http_1_1);
  return parsed;
}

}  // namespace server
