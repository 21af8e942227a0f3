/// The operations of the HTTP API, one row each: the server's route table, the OpenAPI document and
/// the documentation page are generated from these.
#pragma once

#include <algorithm>
#include <span>
#include <string_view>

#include "api/header_rows.h"
#include "api/json/json.h"

namespace api {

struct Capabilities;  // api/answers/server_view.h

/// Returns the list of OpenAPI parameter objects of a query string (api/json/schemas.h).
using QueryParameters = Json (*)(const Capabilities&);

struct ContentRow {
  std::string_view media_type;
  std::string_view schema;  ///< name in components/schemas; "" for bytes; JSON text of a schema if
                            ///< it begins with '{'
};

struct ResponseRow {
  int status;
  std::string_view summary;
  std::span<const ContentRow> content;
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
  std::span<const std::string_view> headers;  ///< names of api/header_rows.h
  std::span<const ContentRow> request;
  std::span<const ResponseRow> responses;
  std::span<const int> problems;    ///< statuses of problem responses besides 401 403 429 503
  bool available;                   ///< false: reserved; answers 404
  QueryParameters query = nullptr;  ///< null: no query
};

std::span<const Operation> operations();
/// Returns null if there is none.
inline const Operation* find_operation(std::string_view id) {
  const auto all = operations();
  const auto found =
      std::find_if(all.begin(), all.end(), [id](const Operation& each) { return each.id == id; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace api
