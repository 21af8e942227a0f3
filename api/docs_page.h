/// GET /docs: the API page, one HTML document without any other file.
#pragma once

#include <string>
#include <string_view>

#include "api/json.h"
#include "api/server_view.h"

namespace api {

/// openapi: made by openapi_document(). Anchors: "#" + operationId, "#schema-NAME",
/// "#problem-SLUG".
std::string docs_page(const Json& openapi);
std::string docs_page(const Capabilities& capabilities, std::string_view version);

}  // namespace api
