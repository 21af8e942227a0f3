/// DenoiseService: denoised pictures of jobs, made on request.
///
/// Pictures are cached by job and revision while there is memory, and are never part of a film.
/// While a job renders, a picture is reused until the next one is due: after kPace, and after
/// rendering has taken kShare times the CPU time of denoising, so that all viewers together take at
/// most 5% of the job's, apart from the first one, which traces quick features that the later
/// previews share. Pictures of ended jobs have whole features. If the job leaves the choice, the
/// faster denoiser makes the first preview.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/denoise/denoised_picture.h"
#include "server/jobs/job_service.h"
#include "server/observe/memory_gate.h"
#include "server/scenes/single_flight_cache.h"

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
    bool is_preview = false;      ///< the same film has a picture with better features
  };
  using Pointer = std::shared_ptr<const Made>;

  DenoiseService(JobService& jobs, MemoryGate& memory, Log& log);

  /// Denoises the current film, or returns a slightly older picture while the job renders.
  /// revision: this or newer. Errors: kInvalidArgument at /denoise (the job has no denoising, or
  /// none before its end); kConflict (a half is missing, or no such revision yet); those of
  /// FilmLibrary::film(); kUnavailable.
  core::Result<Pointer> get(const JobPointer& job, const core::Film& film,
                            std::optional<std::uint32_t> revision,
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
  /// Returns features of this many paths a pixel, cached; null if the scene is gone.
  std::shared_ptr<const core::FeaturePicture> features_of(const Job& job, int samples);
  bool was_shown(const std::string& job_key) const;
  /// Null: there is none, it is older than `revision`, or the next one is due.
  Pointer last_shown(const std::string& job_key, const core::Film& film,
                     std::optional<std::uint32_t> revision) const;

  JobService& jobs_;
  MemoryGate& memory_;
  Log& log_;
  SingleFlightCache<Made> pictures_;
  SingleFlightCache<core::FeaturePicture> features_;
  mutable core::Mutex mutex_;
  std::map<std::string, Last> last_ GUARDED_BY(mutex_);
};

}  // namespace server
