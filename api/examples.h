/// Examples of bodies for the documentation, made by the printers that write the real ones.
#pragma once

#include <string_view>

#include "api/job_view.h"
#include "api/json.h"

namespace api {

/// A body of that schema (a name in components/schemas); null when there is none.
Json example_of(std::string_view schema);

/// A job that is half done.
JobView example_job();

}  // namespace api
