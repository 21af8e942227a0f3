/// Parts of the job object, for the job itself and for the events that tell its changes.
#pragma once

#include "api/job_view.h"
#include "api/json.h"

namespace api {

Json progress_part(const JobView& job);
Json error_part(const JobView& job);
Json statistics_part(const JobView& job);
/// null while there is none.
Json stop_reason_part(const JobView& job);
Json failure_part(const JobView& job);
Json digest_part(const JobView& job);
/// The whole object.
Json job_part(const JobView& job);

}  // namespace api
