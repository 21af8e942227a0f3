// What jobs hold in memory, and how paused ones give it back.

#include <algorithm>
#include <utility>

#include "server/jobs/job_service.h"
#include "server/jobs/save_run.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// What a job that renders takes beside its film, measured by tests/stress/memory --measure: tiles
/// that threads work on, blocks of the film file.
constexpr std::uint64_t kWorkBytes = std::uint64_t{4} << 20U;
/// While an epoch is planned, for each pixel of the crop: mean, variance and cost of a sample,
/// three tables of sums, needs, weights and counts (core/render/allocation.cpp).
constexpr std::uint64_t kPlanBytes = 112;

std::uint64_t work_bytes(const core::Film& film) {
  const core::PixelRect crop = film.crop();
  const auto pixels =
      static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height);
  // Small films have small tiles and files.
  return std::min<std::uint64_t>(kWorkBytes, film.bytes()) +
         (film.has_plan() ? pixels * kPlanBytes : 0) +
         // A checkpoint copies the sums of splats while it writes them.
         (film.has_splats()
              ? pixels * static_cast<std::uint64_t>(film.replicates()) * sizeof(core::SplatPixel)
              : 0);
}

}  // namespace

JobMemory JobService::memory_of(const api::JobView& view) {
  const auto film = blank_film(view);
  JobMemory memory{.film_bytes = film->bytes(), .work_bytes = work_bytes(*film)};
  const api::JobSpec& spec = view.spec;
  const auto hold = [&memory](const SceneService::Memory& needed) {
    memory.shared_bytes.emplace(needed.name, needed.bytes);
    memory.load_bytes = std::max(memory.load_bytes, needed.load_bytes);
  };
  hold(scenes_.memory_of_scene(spec.scene, spec.time_seconds, spec.variant));
  if (spec.environment_choice == api::EnvironmentChoice::kGiven && spec.environment_asset) {
    hold(scenes_.memory_of_environment(*spec.environment_asset, spec.environment));
  }
  return memory;
}

std::optional<api::FieldError> JobService::too_large(const api::JobView& view) {
  const std::uint64_t most = book_.memory_bytes_of(rank_of(view.spec));
  if (most == 0) {
    return std::nullopt;
  }
  const JobMemory memory = memory_of(view);
  if (memory.bytes() <= most) {
    return std::nullopt;
  }
  const std::uint64_t film_bytes = memory.film_bytes + memory.work_bytes;
  std::string detail = "the job would take " + memory_words(memory.bytes()) + " of memory, " +
                       memory_words(film_bytes) +
                       " of them for its film; a job of this server may hold " +
                       memory_words(most) + " (--memory). ";
  const bool is_film = film_bytes > most / 2;
  detail += is_film ? "Fewer pixels, replicates or layers make it smaller"
                    : "Its scene or environment is too large";
  return api::FieldError{is_film ? "/film" : "/scene", std::move(detail)};
}

void JobService::park(const JobPointer& job) {
  const auto run = job->run();
  if (run) {
    if (const Status saved = save_run(*run, quota_, job->memory_only(), false); !saved) {
      log_.write(LogLevel::kError, "film_not_saved",
                 {{"job", job->id()}, {"detail", saved.error().message}});
      book_.keep(*job);  // The next job to be admitted asks again.
      return;
    }
  }
  const Status parked =
      change(*job,
             [&](JobRecord& record) -> Status {
               if (record.view.state != JobState::kPaused || job->run() != run) {
                 return Error{ErrorCode::kCancelled, "the job goes on, or has ended", ""};
               }
               if (run) {
                 record.view.progress = progress_of(*run);
               } else {
                 job->begin_load();  // One that is under way ends in nothing.
               }
               return core::ok_status();
             },
             {.unstored = Unstored::kInMemory, .before_telling = [&](const JobRecord&) {
                job->set_run(nullptr);
                if (run) {
                  run->leave();
                }
              }});
  if (!parked) {
    return;
  }
  if (run) {
    count_work(*run);
  }
  log_.write(LogLevel::kInfo, "job_parked", {{"job", job->id()}});
}

}  // namespace server
