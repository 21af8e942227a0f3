/// The server without sockets: the objects that server/app.cpp makes of the store, the jobs, what
/// reads them, and the routes.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/auth/guard.h"
#include "server/auth/key_ring.h"
#include "server/auth/tickets.h"
#include "server/config/live_config.h"
#include "server/http/router.h"
#include "server/http/stream_gate.h"
#include "server/jobs/batch_service.h"
#include "server/jobs/denoise_service.h"
#include "server/jobs/job_service.h"
#include "server/jobs/tile_frames.h"
#include "server/routes/context.h"
#include "server/store/batch_table.h"
#include "server/store/key_table.h"
#include "server/store/preset_table.h"
#include "server/store/session_store.h"
#include "server/webhooks/webhook_sender.h"
#include "tests/simulation/broker.h"
#include "tests/simulation/comparisons.h"
#include "tests/simulation/receiver.h"
#include "tests/simulation/workers.h"
#include "tests/unit/server/server_parts.h"

namespace simulation {

inline constexpr int kTenants = 4;
/// Each tenant's newest comparison is always kept: those with several lose theirs first.
inline constexpr int kComparisons = 2 * kTenants;

struct Server : test_support::ServerParts {
  std::optional<server::KeyTable> key_table;
  server::LiveConfig config{server::Config{}};
  const std::shared_ptr<const server::Config> at_start = config.now();
  std::optional<server::KeyRing> keys;
  std::optional<server::JobService> jobs;
  std::optional<server::BatchTable> batch_table;
  std::optional<server::BatchService> batches;
  std::optional<server::DenoiseService> denoising;
  std::optional<server::PresetTable> presets;
  std::optional<server::UsageTable> usage;
  std::optional<server::DeliveryTable> deliveries;
  std::optional<server::WebhookSecrets> webhook_secrets;
  std::optional<server::WebhookSender> webhooks;
  std::unique_ptr<server::SessionStore> sessions;
  std::optional<server::Guard> guard;
  server::Tickets tickets;
  server::SingleFlightCache<server::EncodedPicture> pictures{0};
  server::TileFrames frames;
  server::StreamGate streams{kTenants};
  api::ServerView about;
  std::atomic<bool> is_ready = true;
  std::optional<Comparisons> comparisons;
  std::optional<server::Router> router;
  std::int64_t run = 0;

  /// Opens the data directory. Returns what failed; empty: nothing.
  std::string open(const std::string& path) {
    std::string failed = ServerParts::open(path);
    if (failed.empty()) {
      key_table.emplace(*database);
    }
    return failed;
  }

  /// Resumes the jobs, likewise. workers: their seed; empty: there are none.
  std::string start(int build, std::optional<std::uint64_t> workers,
                    std::unique_ptr<server::WebCaller> calls) {
    load_scenes(0);
    const auto number = table->next_run();
    if (!number) {
      return number.error().message;
    }
    run = *number;
    server::JobServiceOptions options;
    options.threads = 2;
    options.book.running_max = 3;
    options.checkpoint_seconds = 60;
    options.build = "\"" + std::to_string(build) + "\"";
    if (workers) {
      options.queue = start_broker(*workers);
      options.work = Workers::options(*workers);
      options.render_threads = options.work.has_local_threads ? 1 : 0;
    }
    jobs.emplace(of_jobs(), options, run);
    batch_table.emplace(*database);
    batches.emplace(*jobs, *table, *batch_table, log);
    denoising.emplace(*jobs, *batch_table, *memory, log);
    comparisons.emplace(*database, *data, kComparisons);
    const auto resumed = jobs->resume();
    if (!resumed) {
      return resumed.error().message;
    }
    batches->resume();
    deliveries.emplace(*database);
    webhook_secrets.emplace(*deliveries, "", false);
    webhooks.emplace(server::WebhookParts{*deliveries, *webhook_secrets, log, metrics},
                     std::move(calls), server::Reach::kAnywhere);
    return open_routes();
  }

 private:
  std::string open_routes() {
    presets.emplace(*database);
    usage.emplace(*database);
    auto opened = server::SessionStore::open(*database);
    if (!opened) {
      return opened.error().message;
    }
    sessions = *std::move(opened);
    guard.emplace(config, *keys, tickets, *sessions);
    router.emplace(server::make_routes({*at_start,
                                        *data,
                                        *assets,
                                        *scenes,
                                        comparisons->table(),
                                        *quota,
                                        *jobs,
                                        *batches,
                                        *denoising,
                                        pictures,
                                        frames,
                                        streams,
                                        tickets,
                                        *key_table,
                                        *keys,
                                        *usage,
                                        *presets,
                                        *deliveries,
                                        *webhook_secrets,
                                        *memory,
                                        metrics,
                                        log,
                                        about,
                                        is_ready,
                                        *guard,
                                        [] { return server::HttpServer::Stats{}; }}));
    return "";
  }
};

}  // namespace simulation
