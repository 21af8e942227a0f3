/// Drake's glTF render protocol (Drake, geometry/render_gltf_client/render_gltf_client_doxygen.h).
#pragma once

#include "server/http/message.h"
#include "server/jobs/waiting_clients.h"
#include "server/routes/context.h"

namespace server {

Response render_drake(const RouteContext& context, WaitingClients& clients, Request& request);

}  // namespace server
