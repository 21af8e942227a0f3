/// Query strings of uploads and of the streams of one job; the others are in api/requests.h.
#pragma once

#include <string>

#include "api/requests.h"

namespace api {

/// POST /v1/scenes?name=.
struct SceneUploadQuery {
  std::string name;  ///< empty: the name inside the file
  bool strict = false;
};
Parsed<SceneUploadQuery> parse_scene_upload_query(QueryParams query);

/// GET /v1/comparisons?a=&b=.
struct MeterComparisonQuery {
  std::string a;  ///< job id
  std::string b;
};
Parsed<MeterComparisonQuery> parse_meter_comparison_query(QueryParams query);

/// GET /v1/jobs/{id}/events?last_event_id=.
struct JobEventsQuery {
  std::string last_event_id;  ///< replaces the header; empty: from now on
};
Parsed<JobEventsQuery> parse_job_events_query(QueryParams query);

}  // namespace api
