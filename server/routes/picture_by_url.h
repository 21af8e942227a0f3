/// GET /i/...: images by URL.
#pragma once

#include "server/jobs/url_jobs.h"
#include "server/jobs/waiting_clients.h"
#include "server/routes/context.h"

namespace server {

/// What requests of images by URL share, with POST /v1/render too.
struct UrlVisitors {
  WaitingClients& clients;
  UrlJobs& started;
};

Response picture_by_url(const RouteContext& context, const UrlVisitors& shared, Request& request);

}  // namespace server
