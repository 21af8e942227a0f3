#include "server/http/form_data.h"

#include <algorithm>
#include <utility>

#include "server/http/text.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::string_view kCrlf = "\r\n";
/// RFC 2046, 5.1.1.
constexpr std::size_t kBoundaryBytesMax = 70;
/// Of the headers of one part.
constexpr std::size_t kHeadBytesMax = 8192;

Error malformed(std::string detail) {
  return Error{ErrorCode::kBadSyntax, "the form is malformed: " + std::move(detail), ""};
}

/// Returns the parameter of a header field, without quotes; in quotes `\"` and `\\` are escapes.
/// Other backslashes stay, since paths of Windows contain them.
std::optional<std::string> parameter(std::string_view field, std::string_view name) {
  bool is_name = false;  // what precedes the first semicolon is no parameter
  for (std::size_t at = 0; at < field.size();) {
    std::string text;
    const std::size_t begin = at;
    std::size_t value_begin = std::string_view::npos;
    bool is_quoted = false;
    for (; at < field.size() && (is_quoted || field[at] != ';'); ++at) {
      const char c = field[at];
      if (value_begin == std::string_view::npos) {
        value_begin = c == '=' ? at + 1 : value_begin;
        continue;
      }
      if (c == '"') {
        is_quoted = !is_quoted;
        continue;
      }
      const bool is_escape = is_quoted && c == '\\' && at + 1 < field.size() &&
                             (field[at + 1] == '"' || field[at + 1] == '\\');
      at += is_escape ? 1 : 0;
      text += field[at];
    }
    if (is_name && value_begin != std::string_view::npos &&
        equal_ignoring_case(trim(field.substr(begin, value_begin - 1 - begin)), name)) {
      return is_quoted ? std::nullopt : std::optional(std::string(trim(text)));
    }
    is_name = true;
    ++at;
  }
  return std::nullopt;
}

core::Result<FormPart> parse_head(std::string_view head) {
  FormPart part;
  bool is_form_data = false;
  while (!head.empty()) {
    const std::size_t end = head.find(kCrlf);
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(head.size(), line.size() + kCrlf.size()));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) {
      return malformed("a header line of a part must be NAME: VALUE");
    }
    const std::string_view name = line.substr(0, colon);
    const std::string_view value = trim(line.substr(colon + 1));
    if (equal_ignoring_case(name, "Content-Type")) {
      part.content_type = media_type(value);
    } else if (equal_ignoring_case(name, "Content-Disposition")) {
      const auto given = parameter(value, "name");
      is_form_data = media_type(value) == "form-data" && given;
      part.name = given.value_or("");
      part.filename = parameter(value, "filename");
    } else if (equal_ignoring_case(name, "Content-Transfer-Encoding") &&
               !equal_ignoring_case(value, "binary") && !equal_ignoring_case(value, "8bit") &&
               !equal_ignoring_case(value, "7bit")) {
      return malformed("a part is encoded; send its bytes as they are");
    }
  }
  return is_form_data ? core::Result<FormPart>(std::move(part))
                      : malformed("a part lacks Content-Disposition: form-data with a name");
}

}  // namespace

core::Result<std::vector<FormPart>> parse_form_data(std::string_view body,
                                                    std::string_view content_type,
                                                    std::size_t parts_max) {
  const auto boundary = parameter(content_type, "boundary");
  if (!boundary || boundary->empty() || boundary->size() > kBoundaryBytesMax) {
    return malformed("its Content-Type has no valid boundary");
  }
  const std::string delimiter = "--" + *boundary;
  const std::string line_delimiter = std::string(kCrlf) + delimiter;
  std::size_t at = body.substr(0, delimiter.size()) == delimiter ? 0 : body.find(line_delimiter);
  if (at == std::string_view::npos) {
    return malformed("it does not contain its boundary");
  }
  at += at == 0 ? delimiter.size() : line_delimiter.size();
  std::vector<FormPart> parts;
  while (body.substr(at, 2) != "--") {
    const std::size_t line_end = body.find(kCrlf, at);
    if (line_end == std::string_view::npos || !trim(body.substr(at, line_end - at)).empty()) {
      return malformed("it is cut short");
    }
    // The headers may be missing, so that the empty line follows at once.
    const std::size_t head_end =
        body.substr(0, line_end + kHeadBytesMax).find("\r\n\r\n", line_end);
    if (head_end == std::string_view::npos) {
      return malformed("the headers of a part do not end");
    }
    const std::size_t head_begin = line_end + kCrlf.size();
    auto part = parse_head(head_end < head_begin ? std::string_view()
                                                 : body.substr(head_begin, head_end - head_begin));
    if (!part) {
      return part.error();
    }
    part->offset = head_end + 2 * kCrlf.size();
    // The line end after the headers may be that of the delimiter: an empty part.
    const std::size_t next = body.find(line_delimiter, part->offset - kCrlf.size());
    if (next == std::string_view::npos) {
      return malformed("it is cut short");
    }
    part->size = next < part->offset ? 0 : next - part->offset;
    if (parts.size() == parts_max) {
      return Error{ErrorCode::kTooLarge,
                   "the form has more than " + std::to_string(parts_max) + " parts", ""};
    }
    parts.push_back(*std::move(part));
    at = next + line_delimiter.size();
  }
  return parts;
}

}  // namespace server
