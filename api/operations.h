/// The operations of the HTTP API, one row each: the server's route table, the OpenAPI document and
/// the documentation page are generated from these.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "api/header_rows.h"
#include "api/json/json.h"

namespace api {

struct Capabilities;  // api/answers/server_view.h

/// Returns the list of OpenAPI parameter objects of a query string (api/json/schemas.h).
using QueryParameters = Json (*)(const Capabilities&);

/// No row, one, or a constant table of several.
template <typename Row>
class Rows {
 public:
  constexpr Rows() = default;
  constexpr Rows(Row only) : only_(only), size_(1) {}  // NOLINT(google-explicit-constructor)
  template <std::size_t N>
  constexpr Rows(const std::array<Row, N>& table)  // NOLINT(google-explicit-constructor)
      : table_(table.data()), size_(N) {}

  constexpr bool empty() const { return size_ == 0; }
  constexpr const Row* begin() const { return table_ == nullptr ? &only_ : table_; }
  constexpr const Row* end() const { return begin() + size_; }

 private:
  Row only_ = {};
  const Row* table_ = nullptr;
  std::size_t size_ = 0;
};

struct ContentRow {
  std::string_view media_type;
  std::string_view schema;  ///< name in components/schemas; "" for bytes; JSON text of a schema if
                            ///< it begins with '{'
};

struct ResponseRow {
  int status;
  std::string_view summary;
  Rows<ContentRow> content;
};

struct Operation {
  std::string_view id;      ///< operationId, by which the server finds its handler
  std::string_view method;  ///< "GET"; a GET also answers HEAD
  std::string_view path;    ///< with {name} for a segment
  std::string_view tag;
  std::string_view summary;
  std::string_view description;
  std::string_view scope;  ///< required scope of the key: "", "read", "write", "admin" or "worker";
                           ///< "" needs no key
  Rows<ContentRow> request;
  Rows<ResponseRow> responses;
  std::span<const int> problems = {};  ///< statuses of problem responses besides 401 403 429 503
  QueryParameters query = nullptr;     ///< null: no query
  std::span<const std::string_view> headers = {};  ///< names of api/header_rows.h
};

std::span<const Operation> operations();

}  // namespace api
