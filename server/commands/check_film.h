/// Verification of stored films.
#pragma once

#include <string>

#include "core/base/result.h"
#include "server/jobs/job_record.h"

namespace server {

/// Reads the job's film from `path`. Errors: of FilmFile; kInternal when the job has finished with
/// another film, such as one that has lost its only checkpoint.
core::Status check_film(const JobRecord& record, const std::string& path);

}  // namespace server
