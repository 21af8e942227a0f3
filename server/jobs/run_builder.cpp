#include "server/jobs/run_builder.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "api/answers/film_view.h"
#include "api/job/view_of.h"
#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/integrators/registry.h"
#include "core/lights/made_environment.h"
#include "core/render/task/allocation.h"
#include "core/render/task/reference_images.h"
#include "core/render/task/settle.h"
#include "core/render/units/result_size.h"
#include "server/store/files.h"
#include "server/store/film_file.h"
#include "server/workers/work_options.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Memory of a rendering job besides its film, measured by tests/stress/memory --measure: tiles and
/// splats in progress, and blocks of the film file. Includes the chains of mlt: a thread has one at
/// a time, with the numbers of two subpaths, below 1 MB at the greatest depth.
constexpr std::uint64_t kWorkBytes = std::uint64_t{4} << 20U;

/// Returns the most that an integrator takes that may render the job. bytes_of(settings): with that
/// integrator.
template <typename BytesOf>
std::uint64_t most_bytes(const api::JobSpec& spec, const BytesOf& bytes_of) {
  core::RenderSettings settings = spec.render;
  settings.caustics = core::CausticsType::kOff;
  std::uint64_t most = 0;
  for (const auto name : core::candidates_of(spec.render, spec.stop.has_error_target())) {
    settings.integrator = name;
    most = std::max<std::uint64_t>(most, bytes_of(settings));
  }
  return most;
}

std::uint64_t bytes_of_prepass(const api::JobSpec& spec) {
  return most_bytes(spec, [](const core::RenderSettings& settings) {
    const core::IntegratorEntry* row = core::find_integrator(settings.integrator);
    return row->prepass_bytes != nullptr ? row->prepass_bytes(settings) : 0;
  });
}

std::uint64_t work_bytes(const core::FilmShape& film) {
  const core::PixelRect crop = film.crop();
  const auto pixels =
      static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height);
  // Small films have small tiles and files.
  return std::min<std::uint64_t>(kWorkBytes, film.bytes()) +
         (film.has_plan() ? pixels * core::kPlanWorkBytes : 0) +
         // A checkpoint copies the splat sums while it writes them.
         (film.has_splats() ? pixels * static_cast<std::uint64_t>(film.replicates()) *
                                  (1 + film.shares().size()) * sizeof(core::SplatPixel)
                            : 0);
}

/// A part of a job's memory, and what a request can do about it.
struct MemoryPart {
  std::uint64_t bytes = 0;
  std::string pointer;
  std::string name;
  std::string remedy;
};

/// Photons are in proportion to the depth, records to the replicates.
MemoryPart prepass_part(const api::JobSpec& spec) {
  const std::uint64_t bytes = bytes_of_prepass(spec);
  if (spec.render.integrator == core::kAutomaticIntegrator) {
    return {bytes, "/integrator/type", "photons, should sppm or path-caustics be chosen",
            "Choose path or bdpt"};
  }
  const core::IntegratorEntry* row =
      core::find_integrator(core::with_caustics(spec.render).integrator);
  const bool is_of_photons = row != nullptr && core::accepts(*row, "/integrator/photons");
  return is_of_photons
             ? MemoryPart{bytes, "/integrator/photons", "photons", "Reduce photons or max_depth"}
             : MemoryPart{bytes, "/integrator/records", "records", "Reduce records or replicates"};
}

/// The inputs of a job from the caches of the server.
class CachedInputs final : public api::ViewInputs {
 public:
  CachedInputs(SceneService& scenes, const api::JobSpec& spec, const LoadTerms& terms)
      : scenes_(scenes), spec_(spec), terms_(terms) {}

  core::Result<Model> model() override {
    const auto scene = scenes_.load(spec_.scene, api::model_moment(spec_), terms_);
    if (!scene) {
      return scene.error();
    }
    const core::SceneSummary& summary = (*scene)->summary();
    return Model{summary.bounds, summary.origin, summary.cameras};
  }
  core::Result<std::shared_ptr<const core::Scene>> scene(core::Vec3 view_direction) override {
    return scenes_.load(spec_.scene, api::scene_moment(spec_), terms_,
                        {spec_.render.ground, view_direction});
  }
  core::Result<std::shared_ptr<const core::MotionTarget>> later(double time_seconds,
                                                                core::Place origin) override {
    return scenes_.later(spec_.scene, api::later_moment(spec_, time_seconds, origin), terms_);
  }
  core::Result<std::shared_ptr<const core::Environment>> environment(
      const std::optional<std::string>& asset, const core::EnvironmentSettings& settings) override {
    return scenes_.environment(asset, settings, terms_);
  }

 private:
  SceneService& scenes_;
  const api::JobSpec& spec_;
  const LoadTerms& terms_;
};

/// A restart may revert a film to its last checkpoint. Revisions are never reused: a client that
/// has seen the lost ones would miss tiles. Fewer revisions than this occur between checkpoints.
constexpr std::uint32_t kRevisionGap = 1U << 16U;
constexpr int kLoadTries = 3;

/// Calls make() until it succeeds or fails for another reason than want of something for now.
template <typename Make>
auto with_patience(const Make& make) {
  auto made = make();
  for (int tries = 1; tries < kLoadTries && !made && made.error().code == ErrorCode::kUnavailable;
       ++tries) {
    made = make();
  }
  return made;
}

}  // namespace

Rank rank_of(const api::JobSpec& spec) {
  return Rank{.is_preview = spec.job_class == api::JobClass::kPreview, .priority = spec.priority};
}

Admission RunBuilder::admission_of(const api::JobSpec& spec) const {
  const core::FilmShape film = core::film_shape(spec.render);
  Admission admission{.rank = rank_of(spec),
                      .memory = {.film_bytes = film.bytes(),
                                 .work_bytes = work_bytes(film) + bytes_of_prepass(spec) +
                                               most_bytes(spec, &core::reference_bytes) +
                                               core::made_environment_bytes(spec.environment)},
                      .film_file_bytes = FilmFile::disk_bytes_max(film)};
  add_shared(spec, {}, admission.memory);
  return admission;
}

void RunBuilder::add_shared(const api::JobSpec& spec, std::optional<core::Vec3> view_direction,
                            JobMemory& memory) const {
  const auto hold = [&memory](const SceneService::Memory& needed) {
    memory.shared_bytes.emplace(needed.name, needed.bytes);
    memory.load_bytes = std::max(memory.load_bytes, needed.load_bytes);
  };
  SceneStand stand = {.ground = spec.render.ground};
  if (stand.ground.type == core::GroundType::kSweep && view_direction) {
    stand.view_direction = *view_direction;
  } else if (stand.ground.type == core::GroundType::kSweep) {
    // Includes the scene without the ground, from which the camera is placed.
    hold(parts_.scenes.memory_of_scene(spec.scene, api::model_moment(spec)));
  }
  hold(parts_.scenes.memory_of_scene(spec.scene, api::scene_moment(spec), stand));
  if (const auto seconds = api::later_seconds(spec)) {
    hold(parts_.scenes.memory_of_later(spec.scene, api::later_moment(spec, *seconds, {})));
  }
  if (spec.environment_choice == api::EnvironmentChoice::kGiven && spec.environment_asset) {
    hold(parts_.scenes.memory_of_environment(*spec.environment_asset, spec.environment));
  }
}

std::optional<api::FieldError> RunBuilder::too_large(const api::JobSpec& spec,
                                                     const JobMemory& needed) const {
  const std::uint64_t most = parts_.book.memory_bytes_of(rank_of(spec));
  if (most == 0) {
    return std::nullopt;
  }
  if (needed.bytes() <= most) {
    return std::nullopt;
  }
  const MemoryPart prepass = prepass_part(spec);
  const std::uint64_t film = needed.film_bytes + needed.work_bytes - prepass.bytes -
                             core::made_environment_bytes(spec.environment);
  const MemoryPart largest = std::max(
      {MemoryPart{film, "/film", "film", "Reduce its pixels, replicates or layers"}, prepass,
       MemoryPart{needed.bytes() - std::min(needed.bytes(), film + prepass.bytes), "/scene",
                  "scene and environment", "They are too large"}},
      [](const MemoryPart& a, const MemoryPart& b) { return a.bytes < b.bytes; });
  return api::FieldError{largest.pointer,
                         "the job would take " + memory_words(needed.bytes()) + " of memory, " +
                             memory_words(largest.bytes) + " of it for its " + largest.name +
                             "; a job on this server may use " + memory_words(most) +
                             " (--memory). " + largest.remedy};
}

core::Result<core::View> RunBuilder::view(const api::JobSpec& spec, const LoadTerms& terms) const {
  CachedInputs inputs(parts_.scenes, spec, terms);
  auto made = api::view_of(spec, inputs);
  if (made) {
    made->is_quick = spec.job_class == api::JobClass::kPreview;
  }
  return made;
}

core::Result<std::shared_ptr<const core::Renderer>> RunBuilder::renderer(
    const api::JobSpec& spec, const LoadTerms& terms) const {
  auto made = view(spec, terms);
  if (!made) {
    return made.error();
  }
  return core::settled_renderer(*std::move(made), spec.stop, terms.stop);
}

core::Result<core::View> RunBuilder::admitted_view(const api::JobSpec& spec,
                                                   const std::stop_token& stop) const {
  const LoadTerms terms = {LoadTerms::Admission::kGiven, stop};
  // A concurrent dry run may have loaded the same scene and failed for lack of memory that the job
  // has.
  return with_patience([&] { return view(spec, terms); });
}

core::Status RunBuilder::tell_of_scene(Job& job, const core::Scene& scene) {
  const std::vector<core::Warning>& warnings = scene.summary().warnings;
  const std::vector<core::Warning> told = job.record().view.warning_details;
  const auto is_told = [&](const core::Warning& warning) {
    return std::find(told.begin(), told.end(), warning) != told.end();
  };
  if (std::all_of(warnings.begin(), warnings.end(), is_told)) {
    return core::ok_status();
  }
  const auto modify = [&](JobRecord& record) -> Verdict {
    for (const core::Warning& warning : warnings) {
      api::add_warning(record.view, warning);
    }
    return {};
  };
  const Verdict noted =
      parts_.journal.change(job, modify, {.unstored = Journal::Unstored::kInMemory});
  return noted ? core::ok_status()
               : core::Status(Error{ErrorCode::kCancelled, "the job was deleted", ""});
}

core::Result<std::shared_ptr<const core::Renderer>> RunBuilder::settled_renderer(
    Job& job, const std::stop_token& stop) {
  auto view = admitted_view(job.record().view.spec, stop);
  if (!view) {
    return view.error();
  }
  if (auto told = tell_of_scene(job, *view->scene); !told) {
    return told.error();
  }
  const bool leaves_a_choice = core::leaves_a_choice(view->settings);
  auto settled = core::settle(*view, job.record().view.spec.stop, stop);
  if (!settled) {
    return settled.error();
  }
  if (leaves_a_choice || !settled->empty()) {
    // Stored before the film exists, so that a restart does not choose again.
    const auto modify = [&](JobRecord& record) -> Verdict {
      core::adopt_settled(record.view.spec.render, view->settings);
      if (!settled->empty()) {
        record.view.warnings.push_back(*settled);
      }
      return {};
    };
    const Verdict noted =
        parts_.journal.change(job, modify, {.unstored = Journal::Unstored::kInMemory});
    if (!noted) {
      return Error{ErrorCode::kCancelled, "the job was deleted", ""};
    }
  }
  return core::Renderer::create(*std::move(view));
}

core::Result<std::shared_ptr<RenderRun>> RunBuilder::build(
    const std::shared_ptr<JobBook::Slot>& slot, RenderRun::Owner& owner,
    const std::stop_token& stop) {
  const JobPointer& job = slot->job();
  const api::JobSpec queued = job->record().view.spec;
  JobMemory needed = slot->needed();
  needed.shared_bytes.clear();  // More may be known of the scene than when the job was queued.
  add_shared(queued, {}, needed);
  if (auto fault = too_large(queued, needed)) {
    return Error{ErrorCode::kUnavailable, std::move(fault->detail), ""};
  }
  auto renderer = settled_renderer(*job, stop);
  if (!renderer) {
    return renderer.error();
  }
  const JobRecord record = job->record();
  const api::JobSpec& spec = record.view.spec;
  // From here on, memory is charged under the names of the loaded scene in the scene cache.
  const core::View& loaded = (*renderer)->view();
  const core::SceneSummary& summary = loaded.scene->summary();
  const auto camera = core::Camera::create(loaded.camera, summary.cameras, summary.bounds,
                                           spec.render.film.width, spec.render.film.height);
  if (!camera) {
    return camera.error();
  }
  if (spec.environment_asset) {
    const std::string warning = parts_.scenes.environment_warning(*spec.environment_asset);
    if (const auto warned = warn(*job, warning); !warned) {
      return warned.error();
    }
  }
  JobMemory shared;
  add_shared(spec, camera->forward(), shared);
  parts_.book.end_load(*job, std::move(shared.shared_bytes));
  RenderRun::Contents contents;
  contents.job = job;
  contents.slot = slot;
  contents.age = job->sequence();
  contents.renderer = std::move(*renderer);
  contents.film = core::make_film(spec.render);
  contents.scene_bytes = contents.renderer->view().scene->summary().bytes;
  contents.arithmetic = arithmetic_;
  const auto local = threads_beside_workers(*job, *contents.film);
  if (!local) {
    return local.error();
  }
  contents.local = *local;
  contents.options.stop = spec.stop;
  contents.options.samples_limit = samples_max_;
  contents.options.counts_particles = true;
  contents.options.light_not_found_before = job->record().view.progress.light_not_found;
  // The run belongs to the job: a shared pointer here would keep both alive.
  contents.options.denoised_bound = [ask = denoised_bound_, weak = contents.job](
                                        const core::Film& film, double confidence) {
    const JobPointer asked = weak.lock();
    return asked != nullptr && ask ? ask(asked, film, confidence)
                                   : std::numeric_limits<double>::infinity();
  };
  if (!job->memory_only()) {
    auto file = open_film(*job, *contents.film, contents.options);
    if (!file) {
      return file.error();
    }
    contents.file.emplace(std::move(*file));
    parts_.films.drop(*job);
  }
  if (const std::uint32_t seen = std::max(contents.film->revision(), record.view.progress.revision);
      seen > 0) {
    contents.film->restore(0, contents.film->tile(0), seen + kRevisionGap);
  }
  return std::make_shared<RenderRun>(std::move(contents), job->shared_log(), owner);
}

Status RunBuilder::warn(Job& job, const std::string& warning) {
  const std::vector<std::string> told = job.record().view.warnings;
  if (warning.empty() || std::find(told.begin(), told.end(), warning) != told.end()) {
    return core::ok_status();
  }
  const auto modify = [&](JobRecord& record) -> Verdict {
    record.view.warnings.push_back(warning);
    return {};
  };
  const Verdict warned =
      parts_.journal.change(job, modify, {.unstored = Journal::Unstored::kInMemory});
  return warned ? core::ok_status()
                : Status(Error{ErrorCode::kCancelled, "the job was deleted", ""});
}

core::Result<LocalThreads*> RunBuilder::threads_beside_workers(Job& job, const core::Film& film) {
  // An eighth of the memory is reserved for requests; a result must fit into it.
  const std::uint64_t share = parts_.book.memory_bytes_of(Rank{}) / 7;
  const std::uint64_t most = share == 0 ? kResultBytesMax : std::min(kResultBytesMax, share);
  const std::uint64_t needed = core::result_bytes_max(film, 1);
  if (local_ == nullptr || needed <= most) {
    return local_;
  }
  const std::string warning = "Workers cannot render this job: one of their results could have " +
                              memory_words(needed) + ", and this server accepts " +
                              memory_words(most) + ". The server renders the job alone.";
  if (const auto warned = warn(job, warning); !warned) {
    return warned.error();
  }
  return static_cast<LocalThreads*>(nullptr);
}

void RunBuilder::note_waiting(Job& job, const std::string& reason) {
  const std::string intro = "The job is waiting: ";
  const std::string warning = intro + reason + ".";
  const auto is_other = [&](const std::string& each) {
    return each.starts_with(intro) && (reason.empty() || each != warning);
  };
  const auto is_settled = [&](const std::vector<std::string>& warnings) {
    return std::none_of(warnings.begin(), warnings.end(), is_other) &&
           (reason.empty() ||
            std::find(warnings.begin(), warnings.end(), warning) != warnings.end());
  };
  if (is_settled(job.record().view.warnings)) {
    return;
  }
  const auto modify = [&](JobRecord& record) -> Verdict {
    std::vector<std::string>& warnings = record.view.warnings;
    std::erase_if(warnings, is_other);
    if (!is_settled(warnings)) {
      warnings.push_back(warning);
    }
    return {};
  };
  // A job that has been deleted in the meantime needs no warning.
  static_cast<void>(parts_.journal.change(job, modify, {.unstored = Journal::Unstored::kInMemory}));
}

core::Result<FilmFile> RunBuilder::open_film(Job& job, core::Film& film,
                                             core::TaskOptions& options) {
  auto file = parts_.films.open_film_file(job);
  if (!file) {
    return file.error();
  }
  auto restored = with_patience([&] { return file->restore(film); });
  if (!restored) {
    // The samples are a function of the job, so they can be rendered again.
    parts_.log.write(LogLevel::kWarning, "film_damaged",
                     {{"job", job.id()}, {"detail", restored.error().message}});
    if (auto removed = remove_file(parts_.data.film_path(job.id())); !removed) {
      return removed.error();
    }
    if (auto warned = warn(
            job,
            "The stored film was damaged or could not be read; the job is rendered again and gives "
            "the same image.");
        !warned) {
      return warned.error();
    }
    file = parts_.films.open_film_file(job);
    if (!file) {
      return file.error();
    }
    restored = file->restore(film);
    if (!restored) {
      return restored.error();
    }
  }
  if (const std::string& before = restored->arithmetic; !before.empty() && before != arithmetic_) {
    if (auto warned = warn(job, "The film was begun with " + before + " and continues with " +
                                    arithmetic_ + "; its bits may match neither.");
        !warned) {
      return warned.error();
    }
  }
  // Recorded when the job first started.
  const std::string begun_by = api::text_of_build(job.record().view.build, "id");
  const std::string own = api::text_of_build(build_, "id");
  if (!begun_by.empty() && begun_by != own && film.sample_counts().max > 0) {
    if (auto warned = warn(job, "The film was begun by build " + begun_by +
                                    " and continues with build " + own +
                                    ": it holds samples of two builds, and its bits may match "
                                    "neither.");
        !warned) {
      return warned.error();
    }
  }
  options.elapsed_before = restored->elapsed_seconds;
  options.points_before = std::move(restored->points);
  return file;
}

}  // namespace server
