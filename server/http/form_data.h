/// Bodies of type multipart/form-data (RFC 7578).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace server {

/// One part of a form; its content is a section of the body.
struct FormPart {
  std::string name;
  std::optional<std::string> filename;
  std::string content_type;  ///< Media type in lower case, without parameters; empty: not given.
  std::size_t offset = 0;
  std::size_t size = 0;

  std::string_view content(std::string_view body) const { return body.substr(offset, size); }
  /// A part without a file name is a field of text, unless its type is another one.
  bool is_file() const {
    return filename.has_value() || (!content_type.empty() && content_type != "text/plain");
  }
};

/// content_type: the request's, with the boundary. Errors: kBadSyntax; kTooLarge for more than
/// parts_max parts.
core::Result<std::vector<FormPart>> parse_form_data(std::string_view body,
                                                    std::string_view content_type,
                                                    std::size_t parts_max);

}  // namespace server
