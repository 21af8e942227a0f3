#include "server/jobs/denoise_service.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "api/job/job_checks.h"
#include "api/json/error_codes.h"
#include "core/denoise/make_denoiser.h"
#include "core/denoise/oidn.h"
#include "core/render/picture/feature_pass.h"
#include "core/render/picture/match_pass.h"
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

core::Status check_denoiser(const Job& job) {
  return api::check_denoiser(type_of(job), "/denoise");
}

Error too_few_samples(int needed) {
  return Error{ErrorCode::kConflict,
               "denoising needs samples of both halves in each pixel, at least " +
                   std::to_string(needed) + " of each",
               ""};
}

Error frame_not_ended() {
  return Error{ErrorCode::kConflict,
               "video averages a frame with those before and after it in its batch: it is there "
               "once all three have ended",
               "/denoise"};
}

api::DenoisedView view_of(const core::DenoisedPicture& picture, core::DenoiserFacts by,
                          bool has_features) {
  api::DenoisedView view;
  view.by = std::move(by);
  view.has_features = has_features;
  view.mixed = picture.interval(core::DenoiseMode::kMixed, 0.95);
  view.full = picture.interval(core::DenoiseMode::kFull, 0.95);
  view.plain = core::ErrorEstimate(picture.plain_tiles, picture.errors).image(0.95);
  view.revision = picture.revision;
  return view;
}

}  // namespace

DenoiseService::DenoiseService(JobService& jobs, BatchTable& batches, MemoryGate& memory, Log& log)
    : jobs_(jobs),
      batches_(batches),
      memory_(memory),
      log_(log),
      pictures_(kCacheBytes, SingleFlightCache<Made>::Oversized::kKept),
      features_(kCacheBytes, SingleFlightCache<core::FeaturePicture>::Oversized::kKept),
      frames_(kCacheBytes, SingleFlightCache<Frame>::Oversized::kKept) {
  memory_.add_reclaimer([this] {
    return pictures_.drop_unused() || features_.drop_unused() || frames_.drop_unused();
  });
}

core::Status DenoiseService::check(const Job& job, api::DenoiseShow show) {
  auto fits = check_denoiser(job);
  if (!fits || show != api::DenoiseShow::kVideo) {
    return fits;
  }
  const auto around = series_around(job);
  return around ? core::ok_status() : core::Status(around.error());
}

core::Result<DenoiseService::Pointer> DenoiseService::get(const JobPointer& job,
                                                          const core::Film& film,
                                                          const Wanted& wanted,
                                                          std::chrono::milliseconds patience) {
  const api::JobView view = job->record().view;
  if (const auto fits = check_denoiser(*job); !fits) {
    return fits.error();
  }
  const bool is_final = api::is_final(view.state);
  if (wanted.show == api::DenoiseShow::kVideo) {
    return is_final ? in_series(job, film, patience) : core::Result<Pointer>(frame_not_ended());
  }
  if (!is_final && !view.spec.denoise.preview) {
    return Error{ErrorCode::kConflict,
                 "the job is rendering, and its denoise.preview is false: it can be denoised once "
                 "it has ended",
                 "/denoise"};
  }
  if (is_final) {
    return kept(job, film, Effort::kWhole, patience);
  }
  if (Pointer last = last_shown(key_of(*job), film, wanted.revision)) {
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
  if (film.sample_counts().min < 2 * static_cast<std::uint32_t>(needed)) {
    return too_few_samples(needed);  // before memory is taken and the film copied
  }
  auto room = take_room(*job, film, 1, patience);
  if (!room) {
    return room.error();
  }
  const auto begin = Clock::now();
  const double rendered_seconds = film.cpu_seconds();
  const core::FilmSnapshot snapshot = film.snapshot();
  if (core::samples_of_halves(snapshot) < needed) {
    return too_few_samples(needed);
  }
  const std::shared_ptr<const core::FeaturePicture> features = features_of(
      *job, effort == Effort::kWhole ? core::kFeatureSamples : core::kQuickFeatureSamples);
  CpuMeter filtering;
  core::DenoiserType type = type_of(*job);
  const bool is_faster = effort == Effort::kFirstPreview && type == core::DenoiserType::kAuto;
  if (is_faster) {
    type = core::DenoiserType::kStatistical;
  }
  auto denoised = core::denoise_with(type, snapshot, features.get(), filtering.counted(parallel()));
  const std::string fault = denoised ? denoised->note : denoised.error().message;
  if (!fault.empty()) {
    log_.write(LogLevel::kWarning, "denoising_failed", {{"job", job->id()}, {"detail", fault}});
  }
  if (!denoised) {
    return denoised.error();
  }
  auto made = std::make_shared<Made>();
  made->picture = std::move(denoised->picture);
  made->view = view_of(made->picture, std::move(denoised->by), features != nullptr);
  // A better picture of the same film may follow a quick one.
  made->version = std::to_string(made->view.revision) + (effort == Effort::kWhole ? "" : "p");
  made->view.note = is_faster && !core::find_oidn().empty()
                        ? "the first image of a job that renders is made by the faster denoiser"
                        : denoised->note;
  made->view.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  made->rendered_seconds = rendered_seconds;
  made->filter_seconds = filtering.seconds();
  room->lease.shrink_to(made->picture.bytes());
  return with_lease(std::shared_ptr<const Made>(std::move(made)), std::move(room->lease));
}

core::Result<DenoiseService::Room> DenoiseService::take_room(const Job& job, const core::Film& film,
                                                             std::uint64_t films,
                                                             std::chrono::milliseconds patience) {
  const std::uint64_t bytes = films * (core::denoising_bytes(pixels_of(film)) + film.bytes());
  // The films themselves are held too.
  if (const core::Status fits = memory_.check(bytes + films * film.bytes(), "the denoised image");
      !fits) {
    return fits.error();
  }
  auto turn =
      turns_.take(job.tenant(), {}, patience.count() == 0 ? std::chrono::seconds(0) : kTurn);
  if (!turn) {
    return turn.error();
  }
  auto lease =
      memory_.take({.bytes = bytes, .tenant = job.tenant()}, "the denoised image", patience);
  if (!lease) {
    return lease.error();
  }
  return Room{*std::move(turn), *std::move(lease)};
}

core::Result<FramesAround> DenoiseService::series_around(const Job& job) {
  auto around = frames_around(jobs_, batches_, job);
  if (around && !around->before && !around->after) {
    const bool is_timed = job.record().view.spec.time_seconds.has_value();
    return Error{ErrorCode::kInvalidArgument,
                 "video averages the frames of a batch, whose jobs differ by camera or time; job " +
                     job.id() + " has none beside it" +
                     (is_timed ? "" : " whose time_seconds is null as well"),
                 "/denoise"};
  }
  return around;
}

core::Result<std::vector<DenoiseService::Neighbour>> DenoiseService::neighbours_of(
    const JobPointer& job) {
  const auto around = series_around(*job);
  if (!around) {
    return around.error();
  }
  std::vector<Neighbour> out;
  for (const JobPointer& other : {around->before, around->after}) {
    if (!other) {
      continue;
    }
    if (!api::is_final(other->state())) {
      return frame_not_ended();
    }
    const auto film = jobs_.films().final_film(*other, {});
    if (film && (*film)->sample_counts().min >= 2) {
      out.push_back({other, *film});
    }
  }
  return out;
}

core::Result<DenoiseService::Pointer> DenoiseService::in_series(
    const JobPointer& job, const core::Film& film, std::chrono::milliseconds patience) {
  const auto neighbours = neighbours_of(job);
  if (!neighbours) {
    return neighbours.error();
  }
  std::string version = std::to_string(film.revision());
  for (const Neighbour& other : *neighbours) {
    version += "." + key_of(*other.job) + std::to_string(other.film->revision());
  }
  const std::string key = key_of(*job) + version + ".video";
  auto made = pictures_.get(key, [&]() -> core::Result<SingleFlightCache<Made>::Made> {
    const auto denoising = job->note_denoising();
    auto picture = make_in_series(job, film, version, *neighbours, patience);
    if (!picture) {
      return picture.error();
    }
    job->set_denoised((*picture)->view);
    const std::uint64_t bytes = (*picture)->picture.bytes();
    return SingleFlightCache<Made>::Made{.value = *std::move(picture), .bytes = bytes};
  });
  if (made) {
    const core::MutexLock lock(mutex_);
    if (last_of_video_.size() >= kLastMost) {
      last_of_video_.clear();
    }
    last_of_video_[key_of(*job)] = key;
  }
  return made;
}

core::Result<DenoiseService::Pointer> DenoiseService::make_in_series(
    const JobPointer& job, const core::Film& film, const std::string& version,
    const std::vector<Neighbour>& neighbours, std::chrono::milliseconds patience) {
  auto room = take_room(*job, film, 1 + neighbours.size(), patience);
  if (!room) {
    return room.error();
  }
  const auto begin = Clock::now();
  const auto own = frame_of(*job, film);
  if (!own) {
    return own.error();
  }
  std::vector<std::shared_ptr<const Frame>> frames;
  std::vector<core::FrameMatch> matches;
  for (const Neighbour& other : neighbours) {
    const auto frame = frame_of(*other.job, *other.film);
    auto found = match(*job, *other.job);
    if (!frame || !found) {
      return frame ? found.error() : frame.error();
    }
    frames.push_back(*frame);
    matches.push_back(*std::move(found));
  }
  // Some of all of them, or none.
  bool has_features = (*own)->features != nullptr;
  for (const auto& frame : frames) {
    has_features = has_features && frame->features != nullptr;
  }
  std::vector<core::CleanNeighbour> clean;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    clean.push_back(
        {&frames[i]->clean, has_features ? frames[i]->features.get() : nullptr, &matches[i]});
  }
  const core::FeaturePicture* features = has_features ? (*own)->features.get() : nullptr;
  core::MadeDenoised denoised =
      core::denoised((*own)->film, features, core::mean_in_series((*own)->clean, features, clean));
  auto made = std::make_shared<Made>();
  made->picture = std::move(denoised.picture);
  made->view = view_of(made->picture, std::move(denoised.by), has_features);
  made->version = version;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    const auto flicker =
        flicker_beside(*neighbours[i].job, **own, made->picture, matches[i], *frames[i]);
    if (flicker) {
      made->view.flicker = made->view.flicker.value_or(core::Flicker());
      *made->view.flicker += *flicker;
    }
  }
  made->view.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  room->lease.shrink_to(made->picture.bytes());
  return with_lease(std::shared_ptr<const Made>(std::move(made)), std::move(room->lease));
}

core::Result<std::shared_ptr<const DenoiseService::Frame>> DenoiseService::frame_of(
    const Job& job, const core::Film& film) {
  const std::string key = key_of(job) + std::to_string(film.revision());
  return frames_.get(key, [&]() -> core::Result<SingleFlightCache<Frame>::Made> {
    auto frame = std::make_shared<Frame>();
    frame->film = film.snapshot();
    if (core::samples_of_halves(frame->film) < 1) {
      return too_few_samples(1);
    }
    frame->features = features_of(job, core::kFeatureSamples);
    auto clean = core::clean_with(type_of(job), frame->film, frame->features.get(), parallel());
    if (!clean) {
      return clean.error();
    }
    frame->clean = *std::move(clean);
    const std::uint64_t bytes = film.bytes() + frame->clean.bytes();
    return SingleFlightCache<Frame>::Made{
        .value = with_lease(std::shared_ptr<const Frame>(std::move(frame)),
                            memory_.note({.bytes = bytes}, MemoryGate::Kind::kIdle)),
        .bytes = bytes};
  });
}

core::Result<core::FrameMatch> DenoiseService::match(const Job& from, const Job& to) {
  const auto here = jobs_.scene_view(from);
  const auto there = jobs_.scene_view(to);
  if (!here || !there) {
    const Error& error = here ? there.error() : here.error();
    return error.code == ErrorCode::kNotFound
               ? Error{api::kGone, "video follows the surfaces of the scene, which was deleted",
                       "/denoise"}
               : error;
  }
  std::shared_ptr<const core::MotionTarget> target;
  const std::optional<double> time = to.record().view.spec.time_seconds;
  if (time && time != from.record().view.spec.time_seconds) {
    auto moved = jobs_.scene_at(from, *time, here->scene->data().origin);
    if (!moved) {
      return moved.error();
    }
    target = *std::move(moved);
  }
  return core::match_pass(*here, {&*there, target.get()}, parallel());
}

std::optional<core::Flicker> DenoiseService::flicker_beside(const Job& beside, const Frame& frame,
                                                            const core::DenoisedPicture& picture,
                                                            const core::FrameMatch& match,
                                                            const Frame& other) const {
  std::string key;
  {
    const core::MutexLock lock(mutex_);
    const auto found = last_of_video_.find(key_of(beside));
    if (found == last_of_video_.end()) {
      return std::nullopt;
    }
    key = found->second;
  }
  const Pointer shown = pictures_.peek(key);
  return shown ? std::optional(
                     core::flicker({&frame.film, &picture}, {&other.film, &shown->picture}, match))
               : std::nullopt;
}

core::ParallelFor DenoiseService::parallel() const {
  return core::parallel_for(std::max(jobs_.threads(), 1));
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
    auto made = core::feature_pass(*view, parallel(), samples);
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
