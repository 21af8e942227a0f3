/// Objects shared by all handlers. All outlive the HTTP server.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <string_view>

#include "api/answers/server_view.h"
#include "server/auth/guard.h"
#include "server/auth/key_ring.h"
#include "server/auth/tickets.h"
#include "server/config/config.h"
#include "server/http/http_server.h"
#include "server/http/message.h"
#include "server/http/router.h"
#include "server/http/stream_gate.h"
#include "server/jobs/batch_service.h"
#include "server/jobs/denoise_service.h"
#include "server/jobs/job_service.h"
#include "server/jobs/tile_frames.h"
#include "server/observe/log.h"
#include "server/observe/memory_gate.h"
#include "server/observe/metrics.h"
#include "server/pictures/picture.h"
#include "server/routes/answers.h"
#include "server/scenes/scene_service.h"
#include "server/scenes/single_flight_cache.h"
#include "server/store/assets.h"
#include "server/store/comparison_store.h"
#include "server/store/data_dir.h"
#include "server/store/storage_quota.h"
#include "server/store/usage_table.h"
#include "server/webhooks/webhook_secrets.h"

namespace server {

class PresetTable;

struct RouteContext {
  const Config& config;
  const DataDir& data;
  Assets& assets;
  SceneService& scenes;
  ComparisonStore& comparisons;
  StorageQuota& quota;
  JobService& jobs;
  BatchService& batches;
  DenoiseService& denoising;
  SingleFlightCache<EncodedPicture>& pictures;  ///< of ended jobs
  TileFrames& tile_frames;
  StreamGate& streams;
  Tickets& tickets;
  KeyTable& keys;
  KeyRing& key_ring;
  UsageTable& usage;
  PresetTable& presets;
  DeliveryTable& deliveries;
  WebhookSecrets& webhook_secrets;
  MemoryGate& memory;
  Metrics& metrics;
  Log& log;
  const api::ServerView& about;
  std::atomic<bool>& ready;
  Guard& guard;
  std::function<HttpServer::Stats()> http_stats;
};

/// A handler without its path and parameters, which come from api::operations().
struct RouteHandler {
  std::function<Response(const RouteContext&, Request&)> handler = {};
  /// Instead, for an operation without query on the job `{id}`: called if the request may see it.
  std::function<Response(const RouteContext&, Request&, const JobPointer&)> of_job = {};
  Needs needs = Needs::kJob;  ///< of_job
  BodyPolicy body = {};
  bool is_probe = false;
};
/// Handlers by operation id.
using HandlerTable = std::map<std::string_view, RouteHandler>;

void add_system_handlers(HandlerTable& table);
void add_asset_handlers(const RouteContext& context, HandlerTable& table);
void add_scene_handlers(const RouteContext& context, HandlerTable& table);
void add_preset_handlers(HandlerTable& table);
void add_render_handlers(const RouteContext& context, HandlerTable& table);
void add_job_handlers(const RouteContext& context, HandlerTable& table);
void add_batch_handlers(HandlerTable& table);
void add_result_handlers(HandlerTable& table);
void add_meter_handlers(HandlerTable& table);
void add_film_handlers(HandlerTable& table);
void add_comparison_handlers(HandlerTable& table);
void add_stream_handlers(HandlerTable& table);
void add_lab_handlers(const RouteContext& context, HandlerTable& table);
void add_webhook_handlers(HandlerTable& table);
void add_key_handlers(HandlerTable& table);
void add_work_handlers(HandlerTable& table);

/// Returns all routes: one for each row of api::operations(), and the files of the page.
/// Aborts (CHECK) when a row has no handler, or a handler no row.
std::vector<Route> make_routes(const RouteContext& context);

}  // namespace server
