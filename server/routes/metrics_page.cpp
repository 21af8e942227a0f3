#include "server/routes/metrics_page.h"

#include "server/jobs/work_board.h"

namespace server {
namespace {

void write_jobs(MetricsText& text, const RouteContext& context) {
  const JobService::Counts counts = context.jobs.counts();
  text.family("tessera_jobs", "gauge", "Stored jobs by state.");
  for (const auto& [state, count] : counts.by_state) {
    text.sample("tessera_jobs", metric_label("state", state), static_cast<double>(count));
  }
  text.gauge("tessera_queue_jobs", "Queued jobs.", counts.queued);
  text.gauge("tessera_queue_limit_jobs",
             "Number of queued jobs above which submissions are refused.",
             context.config.queue_max);
  text.gauge("tessera_rendering_jobs", "Jobs that are rendering.", counts.rendering);
  text.gauge("tessera_jobs_without_room", "Jobs paused until the disk has space.",
             context.jobs.jobs_without_room());
  text.gauge("tessera_render_threads", "Render threads.", context.jobs.threads());
  text.counter("tessera_render_cpu_seconds_total", "CPU time of all slices.",
               counts.threads.cpu_seconds);
  text.counter("tessera_render_idle_seconds_total",
               "Time that render threads waited for a slice while there were jobs.",
               counts.threads.idle_seconds);
  text.counter("tessera_render_lock_wait_seconds_total",
               "Time that render threads waited for the scheduler's lock.",
               counts.threads.lock_wait_seconds);
  text.counter("tessera_rays_total", "Rays traced since the process began.",
               static_cast<double>(counts.rays));
  text.counter("tessera_samples_total", "Pixel samples since the process began.",
               static_cast<double>(counts.samples));
  text.gauge("tessera_film_cache_bytes", "Memory of cached films.",
             static_cast<double>(counts.film_cache_bytes));
  text.gauge("tessera_cached_images", "Encoded images of ended jobs in memory.",
             static_cast<double>(context.pictures.count()));
  text.gauge("tessera_scene_cache_bytes", "Memory of cached scenes.",
             static_cast<double>(context.scenes.cached_bytes()));
  text.gauge("tessera_held_memory_bytes",
             "Memory of films and scenes of jobs, from start to end including pauses.",
             static_cast<double>(counts.held_bytes));
  text.gauge("tessera_held_memory_limit_bytes", "Memory above which jobs wait.",
             static_cast<double>(context.memory.bytes_max()));
  text.gauge("tessera_memory_bytes", "Memory reserved by jobs, requests and caches together.",
             static_cast<double>(context.memory.used_bytes()));
  text.gauge("tessera_queue_waits_for_memory", "1: the next job waits only for memory.",
             counts.waits_for_memory ? 1 : 0);
}

/// Without a queue, families without samples and counts of 0 are written, so that alerts find their
/// metrics.
void write_workers(MetricsText& text, const RouteContext& context) {
  const WorkBoard* board = context.jobs.board();
  const auto workers = board == nullptr ? std::vector<api::WorkerView>() : board->workers();
  std::map<std::string, int> states;
  double rate = 0;
  for (const api::WorkerView& worker : workers) {
    ++states[worker.state];
    rate += worker.state == "working" ? worker.rate : 0;
  }
  text.family("tessera_workers", "gauge", "Workers seen recently, by state.");
  for (const auto& [state, count] : states) {
    text.sample("tessera_workers", metric_label("state", state), count);
  }
  const auto write_each = [&](const char* name, const char* type, const char* help, auto value) {
    text.family(name, type, help);
    for (const api::WorkerView& worker : workers) {
      text.sample(name, metric_label("worker", worker.id), static_cast<double>(value(worker)));
    }
  };
  write_each("tessera_worker_leases", "gauge", "Units that the worker holds.",
             [](const api::WorkerView& w) { return w.leases; });
  write_each("tessera_worker_samples_per_second", "gauge",
             "Pixel samples per second while rendering.",
             [](const api::WorkerView& w) { return w.rate; });
  write_each("tessera_worker_units_total", "counter", "Results that were accepted.",
             [](const api::WorkerView& w) { return w.units; });
  write_each("tessera_worker_faults_total", "counter",
             "Units that the worker lost or failed, or whose results were wrong.",
             [](const api::WorkerView& w) { return w.faults; });
  text.family("tessera_worker_build", "gauge", "1, with the build of the worker.");
  for (const api::WorkerView& worker : workers) {
    text.sample("tessera_worker_build",
                metric_label("worker", worker.id) + "," + metric_label("build", worker.build), 1);
  }
  const WorkBoard::Counts counts = board == nullptr ? WorkBoard::Counts() : board->counts();
  text.gauge("tessera_workers_samples_per_second",
             "Pixel samples per second of all active workers.", rate);
  text.gauge("tessera_units_open", "Units without a result.", counts.open);
  text.family("tessera_queue_connected", "gauge", "1: the broker of --queue is connected.");
  if (board != nullptr) {
    text.sample("tessera_queue_connected", "", counts.has_broker ? 1 : 0);
  }
  text.counter("tessera_units_taken_total", "Results added to a film.",
               static_cast<double>(counts.taken));
  text.counter("tessera_units_expired_total", "Expired leases.",
               static_cast<double>(counts.expired));
  text.counter("tessera_units_refused_total", "Refused results.",
               static_cast<double>(counts.refused));
  text.counter("tessera_units_doubled_total",
               "Units given to a second worker at the end of a pass.",
               static_cast<double>(counts.doubled));
  text.counter("tessera_units_verified_total", "Units whose two results were equal.",
               static_cast<double>(counts.verified));
  text.counter("tessera_units_differing_total", "Units whose two results were not equal.",
               static_cast<double>(counts.differing));
  text.counter("tessera_units_own_total", "Units that the server rendered after workers failed.",
               static_cast<double>(counts.own));
  text.counter("tessera_workers_suspended_total", "Workers suspended for wrong results.",
               static_cast<double>(counts.suspended));
}

void write_storage(MetricsText& text, const RouteContext& context) {
  if (const auto stored = context.quota.total()) {
    text.family("tessera_stored_bytes", "gauge", "Bytes stored in the data directory.");
    text.sample("tessera_stored_bytes", metric_label("kind", "assets"),
                static_cast<double>(stored->asset_bytes));
    text.sample("tessera_stored_bytes", metric_label("kind", "films"),
                static_cast<double>(stored->film_bytes));
  }
  text.gauge("tessera_stored_limit_bytes",
             "Bytes above which films are evicted and uploads refused; 0: no limit.",
             static_cast<double>(context.quota.limits().total_bytes));
  if (const auto space = disk_space(context.data.path())) {
    text.gauge("tessera_disk_free_bytes", "Free space of the data directory's disk.",
               static_cast<double>(space->free_bytes));
    text.gauge("tessera_disk_total_bytes", "Size of the data directory's disk.",
               static_cast<double>(space->total_bytes));
  }
}

void write_connections(MetricsText& text, const RouteContext& context) {
  const HttpServer::Stats stats = context.http_stats();
  text.gauge("tessera_http_connections", "Open connections.", stats.connections);
  text.gauge("tessera_http_threads", "Threads for connections, idle ones included.", stats.threads);
  text.counter("tessera_http_connections_accepted_total", "Connections accepted.",
               static_cast<double>(stats.connections_accepted));
  text.family("tessera_http_connections_refused_total", "counter",
              "Connections closed by a limit: of one address without a complete request, of all "
              "without one, and of all that are served.");
  text.sample("tessera_http_connections_refused_total", metric_label("limit", "address"),
              static_cast<double>(stats.connections_evicted_of_address));
  text.sample("tessera_http_connections_refused_total", metric_label("limit", "waiting"),
              static_cast<double>(stats.connections_evicted));
  text.sample("tessera_http_connections_refused_total", metric_label("limit", "served"),
              static_cast<double>(stats.connections_refused));
  text.gauge("tessera_streams", "Open event and tile streams, and requests that wait for a job.",
             context.streams.open_count());
  text.gauge("tessera_streams_limit", "Number of streams above which more are refused.",
             context.streams.limit());
}

}  // namespace

std::string metrics_text(const RouteContext& context) {
  MetricsText text;
  const api::BuildView& build = context.about.build;
  text.family("tessera_build_info", "gauge", "Always 1; the labels describe the running build.");
  text.sample("tessera_build_info",
              metric_label("version", context.about.version) + "," +
                  metric_label("build", build.id) + "," + metric_label("commit", build.commit) +
                  "," + metric_label("compiler", build.compiler) + "," +
                  metric_label("embree", build.embree) + "," + metric_label("isa", build.isa),
              1);
  write_process_metrics(text);
  write_jobs(text, context);
  write_workers(text, context);
  write_storage(text, context);
  write_connections(text, context);
  context.metrics.write(text);
  return text.take();
}

}  // namespace server
