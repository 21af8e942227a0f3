#include "server/jobs/denoise_service.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/denoise/make_denoiser.h"
#include "core/denoise/oidn.h"
#include "core/render/picture/feature_pass.h"
#include "server/observe/cpu_meter.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

/// Limit on the entries of last_; requests for further jobs are treated as first requests.
constexpr std::size_t kLastMost = 1024;

/// Longest wait for the turn: proxies end a request after a minute.
constexpr std::chrono::seconds kTurn{50};

std::uint64_t pixels_of(const core::Film& film) {
  return static_cast<std::uint64_t>(film.crop().width) *
         static_cast<std::uint64_t>(film.crop().height);
}

std::uint64_t feature_bytes(const core::FeaturePicture& features) {
  constexpr std::uint64_t kPlanes = 14;
  return features.depth_m.size() * kPlanes * sizeof(float);
}

std::string key_of(const Job& job) { return std::to_string(job.sequence()) + "."; }

core::DenoiserType type_of(const Job& job) { return job.record().view.spec.denoise.type; }

}  // namespace

DenoiseService::DenoiseService(JobService& jobs, MemoryGate& memory, Log& log)
    : jobs_(jobs),
      memory_(memory),
      log_(log),
      pictures_(kCacheBytes, SingleFlightCache<Made>::Oversized::kKept),
      features_(kCacheBytes, SingleFlightCache<core::FeaturePicture>::Oversized::kKept) {
  memory_.add_reclaimer([this] { return pictures_.drop_unused() || features_.drop_unused(); });
}

core::Result<DenoiseService::Pointer> DenoiseService::get(const JobPointer& job,
                                                          const core::Film& film,
                                                          std::optional<std::uint32_t> revision,
                                                          std::chrono::milliseconds patience) {
  const api::JobView view = job->record().view;
  if (view.spec.denoise.type == core::DenoiserType::kNone) {
    return Error{ErrorCode::kInvalidArgument, "the job's denoise.type is none", "/denoise"};
  }
  const bool is_final = api::is_final(view.state);
  if (!is_final && !view.spec.denoise.preview) {
    return Error{ErrorCode::kConflict,
                 "the job is rendering, and its denoise.preview is false: it can be denoised once "
                 "it has ended",
                 "/denoise"};
  }
  if (is_final) {
    return kept(job, film, Effort::kWhole, patience);
  }
  if (Pointer last = last_shown(key_of(*job), film, revision)) {
    return last;
  }
  const bool is_first = !was_shown(key_of(*job));
  return kept(job, film, is_first ? Effort::kFirstPreview : Effort::kPreview, patience);
}

double DenoiseService::bound(const JobPointer& job, const core::Film& film, double confidence) {
  const auto made = kept(job, film, Effort::kWhole, MemoryGate::kPatience);
  return made ? (*made)->picture.interval(core::DenoiseMode::kMixed, confidence).high
              : std::numeric_limits<double>::infinity();
}

core::Result<DenoiseService::Pointer> DenoiseService::kept(const JobPointer& job,
                                                           const core::Film& film, Effort effort,
                                                           std::chrono::milliseconds patience) {
  const std::string job_key = key_of(*job);
  // A preview is never returned as the final picture of the same film.
  const std::string key =
      job_key + std::to_string(film.revision()) + (effort == Effort::kWhole ? "" : ".preview");
  return pictures_.get(key, [&]() -> core::Result<SingleFlightCache<Made>::Made> {
    const auto denoising = job->note_denoising();
    auto made = make(job, film, effort, patience);
    if (!made) {
      return made.error();
    }
    const std::uint64_t bytes = (*made)->picture.bytes();
    job->set_denoised((*made)->view);
    if (!api::is_final(job->state())) {
      job->shared_log()->progress_changed();
    }
    const core::MutexLock lock(mutex_);
    if (last_.size() >= kLastMost) {
      last_.clear();
    }
    last_[job_key] = {key, (*made)->view.revision, Clock::now(), (*made)->rendered_seconds,
                      (*made)->filter_seconds};
    return SingleFlightCache<Made>::Made{.value = *std::move(made), .bytes = bytes};
  });
}

bool DenoiseService::is_due(std::chrono::duration<double> since, double rendered_seconds,
                            double filter_seconds) {
  const bool is_another_film = rendered_seconds < 0;  // rendered again from its beginning
  return is_another_film || (since >= kPace && rendered_seconds >= kShare * filter_seconds);
}

bool DenoiseService::was_shown(const std::string& job_key) const {
  const core::MutexLock lock(mutex_);
  return last_.count(job_key) > 0;
}

DenoiseService::Pointer DenoiseService::last_shown(const std::string& job_key,
                                                   const core::Film& film,
                                                   std::optional<std::uint32_t> revision) const {
  std::string key;
  {
    const core::MutexLock lock(mutex_);
    const auto found = last_.find(job_key);
    if (found == last_.end() || found->second.revision < revision.value_or(0)) {
      return nullptr;
    }
    const Last& last = found->second;
    if (is_due(Clock::now() - last.made, film.cpu_seconds() - last.rendered_seconds,
               last.filter_seconds)) {
      return nullptr;
    }
    key = found->second.key;
  }
  return pictures_.peek(key);
}

core::Result<DenoiseService::Pointer> DenoiseService::make(const JobPointer& job,
                                                           const core::Film& film, Effort effort,
                                                           std::chrono::milliseconds patience) {
  const int needed = api::denoising_samples(effort == Effort::kWhole) / 2;
  const Error too_few{ErrorCode::kConflict,
                      "denoising needs samples of both halves in each pixel, at least " +
                          std::to_string(needed) + " of each",
                      ""};
  if (film.sample_counts().min < 2 * static_cast<std::uint32_t>(needed)) {
    return too_few;  // before memory is taken and the film copied
  }
  const std::uint64_t needed_bytes = core::denoising_bytes(pixels_of(film)) + film.bytes();
  // The film itself is held too.
  if (const core::Status fits = memory_.check(needed_bytes + film.bytes(), "the denoised image");
      !fits) {
    return fits.error();
  }
  const auto turn =
      turns_.take(job->tenant(), {}, patience.count() == 0 ? std::chrono::seconds(0) : kTurn);
  if (!turn) {
    return turn.error();
  }
  auto lease = memory_.take({.bytes = needed_bytes, .tenant = job->tenant()}, "the denoised image",
                            patience);
  if (!lease) {
    return lease.error();
  }
  const auto begin = Clock::now();
  const double rendered_seconds = film.cpu_seconds();
  const core::FilmSnapshot snapshot = film.snapshot();
  if (core::samples_of_halves(snapshot) < needed) {
    return too_few;
  }
  const std::shared_ptr<const core::FeaturePicture> features = features_of(
      *job, effort == Effort::kWhole ? core::kFeatureSamples : core::kQuickFeatureSamples);
  CpuMeter filtering;
  core::DenoiserType type = type_of(*job);
  const bool is_faster = effort == Effort::kFirstPreview && type == core::DenoiserType::kAuto;
  if (is_faster) {
    type = core::DenoiserType::kStatistical;
  }
  auto denoised =
      core::denoise_with(type, snapshot, features.get(),
                         filtering.counted(core::parallel_for(std::max(jobs_.threads(), 1))));
  const std::string fault = denoised ? denoised->note : denoised.error().message;
  if (!fault.empty()) {
    log_.write(LogLevel::kWarning, "denoising_failed", {{"job", job->id()}, {"detail", fault}});
  }
  if (!denoised) {
    return denoised.error();
  }
  auto made = std::make_shared<Made>();
  made->picture = std::move(denoised->picture);
  made->is_preview = effort != Effort::kWhole;
  api::DenoisedView& view = made->view;
  view.by = denoised->by;
  view.note = is_faster && !core::find_oidn().empty()
                  ? "the first image of a job that renders is made by the faster denoiser"
                  : denoised->note;
  view.has_features = features != nullptr;
  view.mixed = made->picture.interval(core::DenoiseMode::kMixed, 0.95);
  view.full = made->picture.interval(core::DenoiseMode::kFull, 0.95);
  view.plain = core::ErrorEstimate(made->picture.plain_tiles, snapshot.errors).image(0.95);
  view.revision = made->picture.revision;
  view.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  made->rendered_seconds = rendered_seconds;
  made->filter_seconds = filtering.seconds();
  lease->shrink_to(made->picture.bytes());
  return with_lease(std::shared_ptr<const Made>(std::move(made)), *std::move(lease));
}

std::shared_ptr<const core::FeaturePicture> DenoiseService::features_of(const Job& job,
                                                                        int samples) {
  const std::string key = key_of(job) + std::to_string(samples);
  using Features = SingleFlightCache<core::FeaturePicture>::Made;
  auto features = features_.get(key, [&]() -> core::Result<Features> {
    const auto view = jobs_.scene_view(job);
    if (!view) {
      return view.error();
    }
    auto made =
        core::feature_pass(*view, core::parallel_for(std::max(jobs_.threads(), 1)), samples);
    if (!made) {
      return made.error();
    }
    auto picture = std::make_shared<const core::FeaturePicture>(**std::move(made));
    const std::uint64_t bytes = feature_bytes(*picture);
    return Features{.value = with_lease(std::move(picture),
                                        memory_.note({.bytes = bytes}, MemoryGate::Kind::kIdle)),
                    .bytes = bytes};
  });
  return features ? *features : nullptr;
}

}  // namespace server
