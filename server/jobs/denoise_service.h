/// DenoiseService: denoised pictures of jobs, made on request.
///
/// Pictures are cached by job and revision while there is memory, and are never part of a film.
/// While a job renders, a picture is reused until the next one is due: after kPace, and after
/// rendering has taken kShare times the CPU time of denoising, so that all viewers together take at
/// most 5% of the job's, apart from the first one, which traces quick features that the later
/// previews share. Pictures of ended jobs have whole features. If the job leaves the choice, the
/// faster denoiser makes the first preview.
///
/// Frames of a series (server/jobs/frame_series.h) are also averaged with those before and after
/// them, and their flicker is measured where images of both are there.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/flicker.h"
#include "server/jobs/frame_series.h"
#include "server/jobs/job_service.h"
#include "server/observe/memory_gate.h"
#include "server/observe/turns.h"
#include "server/scenes/single_flight_cache.h"
#include "server/store/batch_table.h"

namespace server {

class DenoiseService {
 public:
  static constexpr std::chrono::seconds kPace{2};
  static constexpr double kShare = 19;
  static constexpr std::uint64_t kCacheBytes = std::uint64_t{256} << 20U;

  struct Made {
    core::DenoisedPicture picture;
    api::DenoisedView view;
    double rendered_seconds = 0;  ///< CPU time of the film
    double filter_seconds = 0;    ///< CPU time, without tracing the features
    std::string version;          ///< of the image, which changes with it
  };
  using Pointer = std::shared_ptr<const Made>;

  /// All must outlive it.
  DenoiseService(JobService& jobs, BatchTable& batches, MemoryGate& memory, Log& log);

  struct Wanted {
    api::DenoiseShow show = api::DenoiseShow::kMixed;
    std::optional<std::uint32_t> revision = {};  ///< this or newer
  };
  /// Returns whether the job can be shown so once its images are there. Errors: kInvalidArgument at
  /// /denoise (the job has no denoising; a video of a job that is alone); of the store.
  core::Status check(const Job& job, api::DenoiseShow show);
  /// Denoises the current film, or returns a slightly older picture while the job renders.
  /// Errors: those of check(); kConflict (none before the end of this job, a half is missing, no
  /// such revision yet, or a frame of the video has not ended); those of FilmLibrary::film();
  /// kUnavailable.
  core::Result<Pointer> get(const JobPointer& job, const core::Film& film, const Wanted& wanted,
                            std::chrono::milliseconds patience);
  /// Returns whether another preview may be made. since: the last one was made. rendered_seconds:
  /// CPU time of rendering since then; filter_seconds: that of denoising it.
  static bool is_due(std::chrono::duration<double> since, double rendered_seconds,
                     double filter_seconds);
  /// As core::TaskOptions::denoised_bound.
  double bound(const JobPointer& job, const core::Film& film, double confidence);

 private:
  using Clock = std::chrono::steady_clock;
  enum class Effort { kFirstPreview, kPreview, kWhole };
  struct Last {
    std::string key;
    std::uint32_t revision = 0;
    Clock::time_point made;
    double rendered_seconds = 0;  ///< as in Made
    double filter_seconds = 0;
  };

  core::Result<Pointer> kept(const JobPointer& job, const core::Film& film, Effort effort,
                             std::chrono::milliseconds patience);
  core::Result<Pointer> make(const JobPointer& job, const core::Film& film, Effort effort,
                             std::chrono::milliseconds patience);
  /// A frame of a series with its film, cleaned.
  struct Frame {
    core::FilmSnapshot film;
    std::shared_ptr<const core::FeaturePicture> features;
    core::CleanFilm clean;
  };
  struct Neighbour {
    JobPointer job;
    std::shared_ptr<const core::Film> film;
  };
  core::Result<Pointer> in_series(const JobPointer& job, const core::Film& film,
                                  std::chrono::milliseconds patience);
  core::Result<Pointer> make_in_series(const JobPointer& job, const core::Film& film,
                                       const std::string& version,
                                       const std::vector<Neighbour>& neighbours,
                                       std::chrono::milliseconds patience);
  core::Result<std::shared_ptr<const Frame>> frame_of(const Job& job, const core::Film& film);
  core::Result<core::FrameMatch> match(const Job& from, const Job& to);
  /// Returns the flicker between the frame and that of `beside`, if its image is there.
  std::optional<core::Flicker> flicker_beside(const Job& beside, const Frame& frame,
                                              const core::DenoisedPicture& picture,
                                              const core::FrameMatch& match,
                                              const Frame& other) const;
  core::ParallelFor parallel() const;
  /// Errors: kInvalidArgument at /denoise (there is none).
  core::Result<FramesAround> series_around(const Job& job);
  core::Result<std::vector<Neighbour>> neighbours_of(const JobPointer& job);
  struct Room {
    Turns::Held turn;
    MemoryGate::Lease lease;
  };
  /// Waits for the turn and the memory to denoise this many films like this one.
  core::Result<Room> take_room(const Job& job, const core::Film& film, std::uint64_t films,
                               std::chrono::milliseconds patience);
  /// Returns features of this many paths a pixel, cached; null if the scene is gone.
  std::shared_ptr<const core::FeaturePicture> features_of(const Job& job, int samples);
  bool was_shown(const std::string& job_key) const;
  /// Null: there is none, it is older than `revision`, or the next one is due.
  Pointer last_shown(const std::string& job_key, const core::Film& film,
                     std::optional<std::uint32_t> revision) const;

  JobService& jobs_;
  BatchTable& batches_;
  MemoryGate& memory_;
  Log& log_;
  Turns turns_{1};  ///< For denoising, which uses all threads.
  SingleFlightCache<Made> pictures_;
  SingleFlightCache<core::FeaturePicture> features_;
  SingleFlightCache<Frame> frames_;
  mutable core::Mutex mutex_;
  std::map<std::string, Last> last_ GUARDED_BY(mutex_);
  std::map<std::string, std::string> last_of_video_ GUARDED_BY(mutex_);  ///< job -> picture
};

}  // namespace server
