// What else is done with jobs: webhooks, retention, figures, and who needs which scene.

#include <utility>

#include "api/events.h"
#include "server/jobs/job_service.h"
#include "server/observe/clock.h"
#include "server/store/key_table.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr int kForgottenAtATime = 64;

}  // namespace

std::vector<DeliveryRow> JobService::deliveries_of(const JobRecord& record,
                                                   const std::vector<Told>& told) {
  const api::JobView& view = record.view;
  std::vector<DeliveryRow> deliveries;
  if (!view.spec.webhook) {
    return deliveries;
  }
  const std::vector<std::string>& wanted = view.spec.webhook->events;
  for (const Told& event : told) {
    if (std::find(wanted.begin(), wanted.end(), api::to_text(event.type)) != wanted.end()) {
      const double now = unix_now();
      deliveries.push_back(DeliveryRow{.id = "msg_" + random_hex(12),
                                       .tenant = record.tenant,
                                       .job = view.id,
                                       .event = std::string(api::to_text(event.type)),
                                       .url = view.spec.webhook->url,
                                       .body = api::webhook_body(event.type, now, view),
                                       .created_at = now,
                                       .next_at = now});
    }
  }
  return deliveries;
}

void JobService::forget_expired() {
  const auto ids = table_.expired(unix_now(), options_.retention, kForgottenAtATime);
  for (const std::string& id : ids ? *ids : std::vector<std::string>()) {
    const auto job = find(id, Access::operators());
    if (job && remove(*job)) {
      log_.write(LogLevel::kInfo, "job_forgotten", {{"job", id}});
    }
  }
}

core::Result<bool> JobService::needs_scene(const std::string& scene,
                                           const std::optional<std::string>& tenant) {
  for (const JobPointer& job : book_.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && (!tenant || *tenant == job->tenant()) &&
        record.view.spec.scene == scene && !api::is_final(record.view.state)) {
      return true;
    }
  }
  return table_.scene_in_use(scene, tenant);
}

core::Result<bool> JobService::needs_asset(const std::string& asset,
                                           const std::optional<std::string>& tenant) {
  for (const JobPointer& job : book_.all()) {
    const JobRecord record = job->record();
    if (job->memory_only() && (!tenant || *tenant == job->tenant()) &&
        record.view.spec.environment_asset == asset && !api::is_final(record.view.state)) {
      return true;
    }
  }
  return table_.environment_in_use(asset, tenant);
}

void JobService::count_work(const RenderRun& run) {
  const RenderRun::Work work = run.work();
  rays_done_ += work.rays;
  samples_done_ += work.samples;
}

JobService::Counts JobService::counts() const {
  Counts counts;
  if (auto by_state = table_.count_by_state()) {
    counts.by_state = std::move(*by_state);
  }
  counts.queued = book_.queue_length();
  counts.rendering = scheduler_.active_count();
  counts.cpu_seconds = scheduler_.cpu_seconds();
  counts.film_cache_bytes = films_.bytes();
  counts.held_bytes = book_.memory_bytes();
  counts.waits_for_memory = book_.waits_for_memory();
  // In this order a run that ends meanwhile is missed for once, not counted twice.
  counts.rays = rays_done_;
  counts.samples = samples_done_;
  for (const JobPointer& job : book_.all()) {
    if (const auto run = job->run()) {
      const RenderRun::Work work = run->work();
      counts.rays += work.rays;
      counts.samples += work.samples;
    }
  }
  return counts;
}

int JobService::jobs_without_room() const {
  int count = 0;
  for (const JobPointer& job : book_.all()) {
    count += job->waits_for_disk() ? 1 : 0;
  }
  return count;
}

core::Result<CostEstimate> JobService::estimate(const api::JobSpec& spec) {
  // Scenes are loaded within the turn: many dry runs of many moments would be in memory together.
  pilots_.acquire();
  struct Release {
    std::counting_semaphore<16>& semaphore;
    ~Release() { semaphore.release(); }
  } const release{pilots_};
  auto renderer = make_renderer(pilot_spec(spec), SceneService::Admission::kNeeded);
  if (!renderer) {
    return renderer.error();
  }
  api::JobView asked;
  asked.spec = spec;
  const JobMemory memory = memory_of(asked);
  const auto held = memory_.note({.shared = memory.shared_bytes}, MemoryGate::Kind::kNeeded);
  const auto pilot = std::make_shared<Pilot>(*renderer);
  scheduler_.add(pilot, Rank{.is_preview = true, .priority = 0});
  const bool worked = pilot->wait();
  scheduler_.remove(*pilot);
  if (!worked) {
    return Error{ErrorCode::kUnavailable, "the pilot got no turn in time", ""};
  }
  CostEstimate cost = pilot->estimate(spec, scheduler_.threads(), options_.samples_max);
  cost.memory_bytes_low = static_cast<double>(memory.film_bytes);
  cost.memory_bytes_high = static_cast<double>(memory.bytes());
  cost.memory_bytes =
      cost.memory_bytes_high - static_cast<double>(memory.own_bytes() - memory.film_bytes);
  return cost;
}

}  // namespace server
