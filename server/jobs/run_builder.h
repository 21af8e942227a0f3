/// RunBuilder: loads the inputs of a job, and computes its memory requirement.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "api/job/job_spec.h"
#include "api/problem.h"
#include "core/base/result.h"
#include "core/render/task/render_task.h"
#include "server/jobs/film_library.h"
#include "server/jobs/job_book.h"
#include "server/jobs/journal.h"
#include "server/jobs/render_run.h"
#include "server/scenes/scene_service.h"

namespace server {

Rank rank_of(const api::JobSpec& spec);

class RunBuilder {
 public:
  /// All members must outlive it.
  struct Parts {
    SceneService& scenes;
    const DataDir& data;
    Log& log;
    JobBook& book;
    Journal& journal;
    FilmLibrary& films;
  };
  /// samples_max: per pixel; arithmetic: core::arithmetic_class() of this process; build: as JSON
  /// text.
  RunBuilder(Parts parts, int samples_max, std::string arithmetic, std::string build)
      : parts_(parts),
        samples_max_(samples_max),
        arithmetic_(std::move(arithmetic)),
        build_(std::move(build)) {}

  /// Returns the rank of a job, and the upper bounds of its film file and of the memory used from
  /// loading on.
  Admission admission_of(const api::JobSpec& spec) const;
  /// Returns empty if the job fits into the memory that one job may hold. needed: by
  /// admission_of().
  std::optional<api::FieldError> too_large(const api::JobSpec& spec, const JobMemory& needed) const;
  /// Loads the scene and the environment. Errors: of loading.
  core::Result<core::View> view(const api::JobSpec& spec, const LoadTerms& terms) const;
  /// Also renders the pilots of the job's settings. Errors: of loading; of core::settle().
  core::Result<std::shared_ptr<const core::Renderer>> renderer(const api::JobSpec& spec,
                                                               const LoadTerms& terms) const;
  /// Loads all inputs of the job and opens its film. Errors: of loading, of the film file;
  /// kUnavailable when it is too large for the server; kCancelled when the job was deleted, or a
  /// stop was requested.
  core::Result<std::shared_ptr<RenderRun>> build(const std::shared_ptr<JobBook::Slot>& slot,
                                                 RenderRun::Owner& owner,
                                                 const std::stop_token& stop);
  const std::string& arithmetic() const { return arithmetic_; }
  const std::string& build_text() const { return build_; }
  /// As core::TaskOptions::denoised_bound, for the job's film.
  using DenoisedBound =
      std::function<double(const JobPointer&, const core::Film&, double confidence)>;
  /// local must outlive the runs.
  void set_local_threads(LocalThreads* local) { local_ = local; }
  /// Warns that the job waits for that reason, or removes the warning if there is none.
  void note_waiting(Job& job, const std::string& reason);
  /// Call before the first build().
  void set_denoised_bound(DenoisedBound bound) { denoised_bound_ = std::move(bound); }

 private:
  /// Adds the scenes and environments that the job shares. view_direction: of the resolved camera,
  /// when everything is loaded.
  void add_shared(const api::JobSpec& spec, std::optional<core::Vec3> view_direction,
                  JobMemory& memory) const;
  core::Result<core::View> admitted_view(const api::JobSpec& spec,
                                         const std::stop_token& stop) const;
  /// Adds the warnings about the scene's file to the job's.
  core::Status tell_of_scene(Job& job, const core::Scene& scene);
  /// Resolves the integrator `auto` and records the choice in the job.
  core::Result<std::shared_ptr<const core::Renderer>> settled_renderer(Job& job,
                                                                       const std::stop_token& stop);
  /// Null: workers do not render the job, since a result of theirs might be too large to be taken.
  core::Result<LocalThreads*> threads_beside_workers(Job& job, const core::Film& film);
  core::Result<FilmFile> open_film(Job& job, core::Film& film, core::TaskOptions& options);
  /// Adds a warning. Errors: kCancelled when the job was deleted.
  core::Status warn(Job& job, const std::string& warning);

  const Parts parts_;
  const int samples_max_;
  const std::string arithmetic_;
  const std::string build_;
  DenoisedBound denoised_bound_;
  LocalThreads* local_ = nullptr;
};

}  // namespace server
