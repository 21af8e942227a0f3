// What jobs hold in memory, and how paused ones give it back.

#include <array>
#include <cstdio>
#include <utility>

#include "server/jobs/job_service.h"
#include "server/jobs/save_run.h"

namespace server {

using api::JobState;
using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

std::string in_words(std::uint64_t bytes) {
  std::array<char, 32> text{};
  static_cast<void>(
      std::snprintf(text.data(), text.size(), "%.3g GB", static_cast<double>(bytes) / 1e9));
  return text.data();
}

}  // namespace

JobMemory JobService::memory_of(const api::JobView& view) {
  JobMemory memory{.film_bytes = blank_film(view)->bytes(), .shared_bytes = {}};
  const api::JobSpec& spec = view.spec;
  const auto scene = scenes_.memory_of_scene(spec.scene, spec.time_seconds, spec.variant);
  memory.shared_bytes.emplace("scene " + scene.name, scene.bytes);
  if (spec.environment_choice == api::EnvironmentChoice::kGiven && spec.environment_asset) {
    const auto environment =
        scenes_.memory_of_environment(*spec.environment_asset, spec.environment);
    memory.shared_bytes.emplace("environment " + environment.name, environment.bytes);
  }
  return memory;
}

std::optional<std::string> JobService::too_large(const api::JobView& view) const {
  const std::uint64_t most = options_.book.memory_bytes_of(rank_of(view.spec));
  const std::uint64_t needed = blank_film(view)->bytes();
  if (options_.book.memory_max_bytes == 0 || needed <= most) {
    return std::nullopt;
  }
  return "the film would take " + in_words(needed) + " of memory; a job of this server may hold " +
         in_words(most) + " (--memory). Fewer pixels, replicates or layers make it smaller";
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
