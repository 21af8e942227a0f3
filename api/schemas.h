/// JSON schemas (2020-12) of everything that crosses the interface; components of the OpenAPI
/// document.
#pragma once

#include "api/json.h"

namespace api {

// Requests, from the tables that read them.
Json job_request_schema();
Json job_patch_schema();
Json extend_schema();
Json scene_from_assets_schema();
Json comparison_request_schema();
Json merge_schema();
Json ticket_request_schema();

/// Adds the schemas of all answers to `components`.
void add_view_schemas(Json& components);

}  // namespace api
