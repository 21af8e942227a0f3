/// JSON schemas (2020-12) of all requests and responses; components of the OpenAPI document.
#pragma once

#include <string_view>

#include "api/json/json.h"

namespace api {

struct Capabilities;  // api/answers/server_view.h

// Schemas of requests, from the tables that read them; as_request() and as_answer() make components
// of them.
Json job_request_schema();
Json batch_request_schema();
Json job_patch_schema();
Json extend_schema();
void add_preset_schemas(Json& components);
Json scene_from_assets_schema();
Json comparison_request_schema();
Json merge_schema();
Json ticket_request_schema();

// Query strings, from the tables that read them: lists of OpenAPI parameter objects.
Json job_list_parameters(const Capabilities& capabilities);
Json scene_list_parameters(const Capabilities& capabilities);
Json batch_list_parameters(const Capabilities& capabilities);
Json batch_submit_parameters(const Capabilities& capabilities);
Json archive_parameters(const Capabilities& capabilities);
Json sheet_parameters(const Capabilities& capabilities);
Json delivery_list_parameters(const Capabilities& capabilities);
Json scene_upload_parameters(const Capabilities& capabilities);
Json submit_parameters(const Capabilities& capabilities);
Json wait_parameters(const Capabilities& capabilities);
Json tiles_parameters(const Capabilities& capabilities);
Json job_events_parameters(const Capabilities& capabilities);
Json events_parameters(const Capabilities& capabilities);
Json meter_comparison_parameters(const Capabilities& capabilities);
Json image_parameters(const Capabilities& capabilities);
Json render_parameters(const Capabilities& capabilities);
Json picture_url_parameters(const Capabilities& capabilities);

/// Returns the schema of a request. Defaults become `x-default` and part of the description:
/// generators treat members with a `default` as always present, or send it.
Json as_request(Json schema);
/// Returns the schema of a response that prints the same rows: members are required unless they are
/// not always printed.
Json as_answer(Json schema, std::string_view doc);

/// Adds the schemas of all answers to `components`.
void add_view_schemas(Json& components);

}  // namespace api
