/// GET /docs: the API page, one HTML document without any other file.
#pragma once

#include <string>

#include "api/json.h"

namespace api {

/// openapi: made by openapi_document(). Anchors: "#" + operationId, "#schema-NAME", "#problem-SLUG".
std::string docs_page(const Json& openapi);

}  // namespace api
