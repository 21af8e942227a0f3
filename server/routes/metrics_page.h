/// GET /metrics: the metrics of the process in Prometheus' text format.
#pragma once

#include <string>

#include "server/routes/context.h"

namespace server {

std::string metrics_text(const RouteContext& context);

}  // namespace server
