/// The headers of the HTTP API, one row each: parameters and responses of the OpenAPI document, the
/// documentation page, and the headers that pages of other origins may send and read (CORS) follow
/// from these.
#pragma once

#include <span>
#include <string_view>

namespace api {

/// A header. Path parameters follow from the path, query parameters from the table that reads them.
struct HeaderRow {
  std::string_view name;
  std::string_view schema;  ///< JSON text of its schema
  std::string_view summary;
};

/// Headers that the server reads.
std::span<const HeaderRow> request_headers();
/// Headers that the server sends beside those of HTTP itself.
std::span<const HeaderRow> response_headers();

}  // namespace api
