/// The OpenAPI 3.1 document, generated from the tables that validate requests and name routes.
#pragma once

#include <string>
#include <string_view>

#include "api/answers/server_view.h"
#include "api/json/json.h"

namespace api {

/// Contains only available operations. version: of the program. base_path: "/render" for a server
/// that a proxy places below a path.
Json openapi_document(const Capabilities& capabilities, std::string_view version,
                      const std::string& base_path = "");
/// Returns its text: GET /openapi.json.
std::string openapi_json(const Capabilities& capabilities, std::string_view version,
                         const std::string& base_path);

}  // namespace api
