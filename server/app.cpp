#include "server/app.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include "api/job/job_spec.h"
#include "api/json/limits.h"
#include "core/accel/arithmetic.h"
#include "core/base/paged_memory.h"
#include "core/base/shown_address.h"
#include "core/base/text.h"
#include "server/arrival.h"
#include "server/auth/guard.h"
#include "server/auth/key_ring.h"
#include "server/auth/tickets.h"
#include "server/config/about.h"
#include "server/config/live_config.h"
#include "server/http/http_server.h"
#include "server/job_setup.h"
#include "server/jobs/batch_service.h"
#include "server/jobs/denoise_service.h"
#include "server/jobs/job_service.h"
#include "server/observe/log.h"
#include "server/observe/machine_memory.h"
#include "server/observe/metrics.h"
#include "server/request_log.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/first_images.h"
#include "server/scenes/scene_service.h"
#include "server/store/assets.h"
#include "server/store/batch_table.h"
#include "server/store/blob_store.h"
#include "server/store/comparison_store.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/job_table.h"
#include "server/store/key_table.h"
#include "server/store/preset_table.h"
#include "server/store/scene_table.h"
#include "server/store/session_store.h"
#include "server/store/storage_quota.h"
#include "server/store/usage_table.h"
#include "server/webhooks/webhook_sender.h"

namespace server {
namespace {

using std::chrono::milliseconds;

/// Ends the process successfully after `time`, unless stopped earlier.
void end_after(milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock<std::mutex> lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
  if (!stop.stop_requested()) {
    std::fputs("tessera: the grace time is over\n", stderr);
    std::_Exit(0);
  }
}

/// Raises the limit of open files: every stream needs one, and shells allow few.
void allow_open_files() {
  rlimit limit = {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < limit.rlim_max) {
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
}

/// Returns large blocks to the system when they are freed: by default glibc keeps blocks below a
/// threshold that grows to 32 MiB with the freed blocks (mallopt(3)).
void give_back_large_blocks() { ::mallopt(M_MMAP_THRESHOLD, 1 << 20); }

/// All objects of a running server, in the order of their construction; destroyed in reverse.
class App {
 public:
  App(const Config& config, const std::string& isa, DataDir data,
      std::unique_ptr<Database> database, BlobStore blobs, std::unique_ptr<SessionStore> sessions)
      : config_(config),
        live_(config),
        memory_(memory_limits(config, usable_memory_bytes())),
        about_(about_server(config, memory_, isa)),
        log_(config.log_level),
        request_log_(log_, metrics_, config.audit_log),
        data_(std::move(data)),
        database_(std::move(database)),
        blobs_(std::move(blobs)),
        assets_(*database_, blobs_),
        job_table_(*database_),
        scene_table_(*database_),
        key_table_(*database_),
        deliveries_(*database_),
        batch_table_(*database_),
        usage_(*database_),
        presets_(*database_),
        comparisons_(*database_, data_,
                     {.count = api::limits::kComparisons, .bytes = api::limits::kComparisonBytes}),
        quota_(*database_, storage_limits(config)),
        memory_gate_(memory_.gate_bytes),
        scenes_(assets_, scene_table_, quota_, memory_gate_,
                {.cache_bytes = memory_.scene_cache_bytes,
                 .threads = render_threads(config),
                 .isa = config.isa == "native" ? std::string() : isa,
                 .converters = {.helper = core::find_converter(),
                                .commands = converter_commands(config)},
                 .convert_time = std::chrono::seconds(config.convert_seconds)}),
        stream_memory_(memory_gate_.note({}, MemoryGate::Kind::kNeeded)),
        streams_(config.streams_max, config.quota_streams,
                 [this](int open) {
                   MemoryGate::change(stream_memory_,
                                      {.bytes = kUnsentBytes * static_cast<std::uint64_t>(open)});
                 }),
        keys_(live_, key_table_,
              [this](KeyRing::Change change, const KeyRow& key) {
                request_log_.note_key(change, key);
              }),
        sessions_(std::move(sessions)),
        guard_(live_, keys_, tickets_, *sessions_) {}

  /// Opens the store and builds the objects. Errors: an unavailable instruction set, an unusable
  /// directory, an unreadable store, an address that needs a key but has none.
  static core::Result<std::unique_ptr<App>> create(const Config& config) {
    auto isa = core::resolve_isa(config.isa);
    if (!isa) {
      return core::Error{isa.error().code, isa.error().message, "--isa"};
    }
    auto data = DataDir::open(config.data_dir);
    if (!data) {
      return data.error();
    }
    core::set_paging_folder(data->path());
    auto database = Database::open(data->database_path());
    if (!database) {
      return database.error();
    }
    auto blobs = BlobStore::open(data->assets_path());
    if (!blobs) {
      return blobs.error();
    }
    auto sessions = SessionStore::open(**database);
    if (!sessions) {
      return sessions.error();
    }
    auto app = std::make_unique<App>(config, *isa, *std::move(data), *std::move(database),
                                     *std::move(blobs), *std::move(sessions));
    if (const std::string& damage = app->database_->damage(); !damage.empty()) {
      app->log_.write(LogLevel::kError, "database_damaged", {{"detail", damage}});
    }
    if (const auto keyed = app->check_keys(config); !keyed) {
      return keyed.error();
    }
    if (const auto audited = app->request_log_.check(); !audited) {
      return audited.error();
    }
    const auto run = app->job_table_.next_run();
    if (!run) {
      return run.error();
    }
    auto options = job_options(config, app->memory_, app->about_);
    if (!options) {
      return options.error();
    }
    app->jobs_ = std::make_unique<JobService>(
        JobServiceParts{app->job_table_, app->scenes_, app->data_, app->log_, app->metrics_,
                        app->quota_, app->memory_gate_},
        *std::move(options), *run);
    app->batches_ =
        std::make_unique<BatchService>(*app->jobs_, app->job_table_, app->batch_table_, app->log_);
    app->denoising_ = std::make_unique<DenoiseService>(*app->jobs_, app->batch_table_,
                                                       app->memory_gate_, app->log_);
    app->pictures_ = std::make_unique<SingleFlightCache<EncodedPicture>>(
        std::min(kPictureCacheBytes, app->memory_.film_cache_bytes),
        SingleFlightCache<EncodedPicture>::Oversized::kNotKept);
    app->memory_gate_.add_reclaimer(
        [&pictures = *app->pictures_] { return pictures.drop_unused(); });
    app->jobs_->set_denoised_bound([&denoising = *app->denoising_](const JobPointer& job,
                                                                   const core::Film& film,
                                                                   double confidence) {
      return denoising.bound(job, film, confidence);
    });
    if (const auto started = app->start_webhooks(); !started) {
      return started.error();
    }
    return app;
  }

  core::Result<int> bind() {
    HttpOptions options;
    options.host = config_.listen;
    options.port = config_.port;
    auto tls = load_tls(config_);
    if (!tls) {
      return tls.error();
    }
    options.tls = *std::move(tls);
    options.limits.max_connections = std::max(4096, config_.streams_max + 1024);
    options.trusted_proxies = Networks::parse(config_.trusted_proxies).value();
    options.hooks.before = [this](Request& request) {
      auto refused = has_resumed(request);
      return refused ? std::move(refused) : guard_.check(request);
    };
    options.hooks.decorate = [this](const Request& request, Response& response) {
      guard_.decorate(request, response);
    };
    options.hooks.after = [this](const Request& request, const Outcome& outcome) {
      request_log_.note(request, outcome);
    };
    const RouteContext context{config_,
                               data_,
                               assets_,
                               scenes_,
                               comparisons_,
                               quota_,
                               *jobs_,
                               *batches_,
                               *denoising_,
                               *pictures_,
                               tile_frames_,
                               streams_,
                               tickets_,
                               key_table_,
                               keys_,
                               usage_,
                               presets_,
                               deliveries_,
                               *webhook_secrets_,
                               memory_gate_,
                               metrics_,
                               log_,
                               about_,
                               ready_,
                               guard_,
                               [this] { return http_->stats(); }};
    if (memory_.film_cache_bytes > 0) {
      first_images_ = std::make_unique<FirstImages>(context);
    }
    http_ = std::make_unique<HttpServer>(std::move(options), make_routes(context), streams_);
    return http_->bind();
  }

  /// Resumes earlier jobs, adds the demo, serves until a signal. SIGHUP only calls on_hangup.
  int run(const sigset_t& signals, const std::function<void()>& on_hangup) {
    // The probes answer from the start; other requests wait until the jobs are known.
    std::thread serving([this] { http_->run(); });
    if (const auto resumed = jobs_->resume(); !resumed) {
      log_.write(LogLevel::kError, "resume failed", {{"reason", resumed.error().message}});
      http_->stop(milliseconds(100));
      serving.join();
      return 1;
    }
    batches_->resume();
    submit_demo();
    ready_ = true;
    resumed_.arrive();
    int signal = 0;
    while (sigwait(&signals, &signal) == 0 && signal == SIGHUP) {
      on_hangup();
    }
    ready_ = false;
    log_.write(LogLevel::kInfo, "stopping", {{"signal", std::int64_t{signal}}});
    const auto grace = milliseconds(static_cast<std::int64_t>(config_.grace_seconds * 1000));
    const auto start = std::chrono::steady_clock::now();
    // Loading a scene cannot be interrupted. Everything acknowledged is on disk, so the process may
    // be ended at any moment; the watchdog does so at the end of the grace time.
    std::jthread watchdog([grace](const std::stop_token& stop) { end_after(grace, stop); });
    // Saves films first: an interrupted response can be requested again, but samples would be lost.
    std::thread saving([this] {
      jobs_->stop();
      webhooks_->stop();
    });
    const bool quiet = http_->stop(std::max(grace - milliseconds(500), milliseconds(100)));
    saving.join();
    serving.join();
    first_images_.reset();  // Waits for the image that is being encoded.
    watchdog.request_stop();
    log_.write(LogLevel::kInfo, "stopped",
               {{"seconds",
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()},
                {"clean", std::int64_t{quiet ? 1 : 0}}});
    return 0;
  }

  /// Applies the settings that may change while the server runs.
  void reload(const core::Result<Config>& read) {
    const auto refuse = [this](const core::Error& error) {
      log_.write(LogLevel::kError, "reload_refused",
                 {{"where", error.where}, {"detail", error.message}});
    };
    if (!read) {
      return refuse(read.error());
    }
    const auto now = live_.now();
    Config next = *now;
    next.key = read->key;
    next.worker_key = read->worker_key;
    next.metrics_key = read->metrics_key;
    next.hosts = read->hosts;
    next.origins = read->origins;
    next.embed_origins = read->embed_origins;
    next.rate_limit = read->rate_limit;
    next.log_level = read->log_level;
    next.trusted_proxies = read->trusted_proxies;
    next.tls_cert = now->tls_cert.empty() ? "" : read->tls_cert;
    next.tls_key = now->tls_cert.empty() ? "" : read->tls_key;
    auto trusted = Networks::parse(next.trusted_proxies);
    auto tls = load_tls(next);
    const auto keyed = check_keys(next);
    if (!trusted || !tls || !keyed) {
      return refuse(!trusted ? trusted.error() : !tls ? tls.error() : keyed.error());
    }
    http_->set_trusted_proxies(*std::move(trusted));
    if (*tls != nullptr) {
      http_->set_tls(*std::move(tls));
    }
    log_.set_level(next.log_level);
    const std::string changed = core::joined(changed_flags(*now, next), ", ");
    const std::string waiting = core::joined(changed_flags(next, *read), ", ");
    live_.set(std::move(next));
    log_.write(LogLevel::kWarning, "reloaded", {{"changed", changed}, {"needs_restart", waiting}});
  }

  void log_start(int port) {
    log_.write(LogLevel::kInfo, "started",
               {{"version", about_.version},
                {"build", about_.build.id},
                {"listen", config_.listen},
                {"port", std::int64_t{port}},
                {"data", config_.data_dir},
                {"threads", std::int64_t{render_threads(config_)}}});
  }

 private:
  /// Waits until the previous process's jobs are known; returns a response if that takes too long.
  std::optional<Response> has_resumed(const Request& request) {
    if (resumed_.has_come() || is_probe(request.path) || resumed_.wait(request.stop_token())) {
      return std::nullopt;
    }
    return error_answer(request, core::ErrorCode::kUnavailable, "the server is starting");
  }

  /// Returns null without a certificate.
  static core::Result<std::shared_ptr<const TlsContext>> load_tls(const Config& config) {
    return config.tls_cert.empty() ? core::Result<std::shared_ptr<const TlsContext>>(nullptr)
                                   : TlsContext::load(config.tls_cert, config.tls_key);
  }

  core::Status check_keys(const Config& config) {
    const auto keys = key_table_.list();
    if (!keys) {
      return keys.error();
    }
    if (config.key.empty() && keys->empty() && !is_loopback(config.listen)) {
      return core::Error{core::ErrorCode::kInvalidArgument,
                         "listening on " + config.listen +
                             " needs a key: set --key or TESSERA_KEY, or `tessera keys add`",
                         "--listen"};
    }
    return core::ok_status();
  }

  core::Status start_webhooks() {
    auto secret = config_.webhook_secret.empty()
                      ? stored_webhook_secret(data_.path())
                      : core::Result<std::string>(config_.webhook_secret);
    if (!secret) {
      return secret.error();
    }
    if (!webhook_key(*secret)) {
      return core::Error{core::ErrorCode::kInvalidArgument,
                         "expected whsec_ followed by the base64 of at least 16 bytes",
                         "--webhook-secret"};
    }
    webhook_secrets_ =
        std::make_unique<WebhookSecrets>(deliveries_, *std::move(secret), config_.shared);
    webhooks_ = std::make_unique<WebhookSender>(
        WebhookParts{deliveries_, *webhook_secrets_, log_, metrics_}, std::make_unique<WebCalls>(),
        config_.webhook_private ? Reach::kAnywhere : Reach::kPublicOnly);
    return core::ok_status();
  }

  void submit_demo() {
    if (!config_.demo || jobs_->any_job()) {
      return;
    }
    constexpr std::string_view kDemo =
        // Requested jobs are more urgent.
        R"({"scene": "still-life", "name": "Welcome to Tessera", "labels": {"demo": "1"},)"
        R"( "priority": -10,
            "film": {"width": 960, "height": 540}, "stop": {"samples_per_pixel": 512}})";
    auto parsed = api::parse_job(kDemo);
    CHECK(parsed);
    const auto submitted = jobs_->submit(*std::move(parsed), {.access = Access::operators()});
    if (!submitted) {
      log_.write(LogLevel::kWarning, "no demo job", {{"reason", submitted.problem().detail}});
    }
  }

  const Config& config_;
  LiveConfig live_;
  const MemoryLimits memory_;
  const api::ServerView about_;
  Log log_;
  Metrics metrics_;
  RequestLog request_log_;
  DataDir data_;
  std::unique_ptr<Database> database_;
  BlobStore blobs_;
  Assets assets_;
  JobTable job_table_;
  SceneTable scene_table_;
  KeyTable key_table_;
  DeliveryTable deliveries_;
  BatchTable batch_table_;
  UsageTable usage_;
  PresetTable presets_;
  ComparisonStore comparisons_;
  StorageQuota quota_;
  MemoryGate memory_gate_;
  TileFrames tile_frames_;
  SceneService scenes_;
  MemoryGate::Lease stream_memory_;  ///< Changed under the lock of streams_.
  StreamGate streams_;
  KeyRing keys_;
  Tickets tickets_;
  const std::unique_ptr<SessionStore> sessions_;
  Guard guard_;
  std::atomic<bool> ready_ = false;
  Arrival resumed_;
  std::unique_ptr<JobService> jobs_;
  std::unique_ptr<BatchService> batches_;
  std::unique_ptr<DenoiseService> denoising_;
  std::unique_ptr<SingleFlightCache<EncodedPicture>> pictures_;
  std::unique_ptr<WebhookSecrets> webhook_secrets_;
  std::unique_ptr<WebhookSender> webhooks_;
  std::unique_ptr<HttpServer> http_;
  std::unique_ptr<FirstImages> first_images_;
};

std::string url_host(const std::string& host) {
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

int report(const core::Error& error) {
  std::fprintf(stderr, "tessera: %s%s%s\n", error.where.empty() ? "" : error.where.c_str(),
               error.where.empty() ? "" : ": ", error.message.c_str());
  return 1;
}

}  // namespace

int serve(const Config& config, const std::function<core::Result<Config>()>& read_again) {
  // This thread takes signals by sigwait(); threads created from here on inherit the mask.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  if (::isatty(STDIN_FILENO) == 0) {
    sigaddset(&signals, SIGHUP);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // A write to a closed connection or beyond the file size limit must fail, not end the process.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);

  allow_open_files();
  give_back_large_blocks();
  auto app = App::create(config);
  if (!app) {
    return report(app.error());
  }
  const auto port = (*app)->bind();
  if (!port) {
    return report(port.error());
  }
  const char* scheme = config.tls_cert.empty() ? "http" : "https";
  std::printf("listening on %s://%s:%d\n", scheme, url_host(config.listen).c_str(), *port);
  if (!config.announce.empty()) {
    std::printf("open %s in a browser\n", core::shown_address(config.announce).c_str());
  } else if (config.demo) {
    std::printf("open %s://localhost:%d/ in a browser\n", scheme, *port);
  }
  std::fflush(stdout);
  (*app)->log_start(*port);
  return (*app)->run(signals, [&] { (*app)->reload(read_again()); });
}

}  // namespace server
