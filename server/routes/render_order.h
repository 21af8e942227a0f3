/// One request, one image: from settings and uploads to the job, its end and its image. Shared by
/// POST /v1/render and Drake's protocol.
#pragma once

#include <optional>
#include <string>

#include "api/queries/render_query.h"
#include "server/http/message.h"
#include "server/jobs/waiting_clients.h"
#include "server/routes/context.h"

namespace server {

struct RenderOrder {
  api::RenderQuery query;
  std::string job = {};  ///< JSON of a JobRequest; empty: none
  api::RenderUploads uploads = {};
  bool is_turntable = false;  ///< as of frame_model()
  /// The client waits for the end, however long, and no other client shares the job.
  bool is_once = false;
};

/// Returns the answer to an order for an image that there cannot be: 406, 422.
std::optional<Response> check_order(const Request& request, const RenderOrder& order);
/// Reads the stored preset that the order names. Returns the answer if there is none.
std::optional<Response> find_preset(const RouteContext& context, const Request& request,
                                    RenderOrder& order);

struct Rendered {
  Response response;
  JobPointer job = nullptr;  ///< null: refused
};
Rendered render_order(const RouteContext& context, WaitingClients& clients, Request& request,
                      RenderOrder order);

}  // namespace server
