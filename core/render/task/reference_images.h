/// ReferenceImages: two independent unbiased images of a task's view, from which the error of a
/// biased integrator is measured (core/error/compared_error.h).
///
/// They are the halves of a film of the row's `compared_with` (IntegratorEntry), with the job's
/// camera, film and depth, and random numbers of a stream of their own: they are a function of the
/// job and of their sample count. They are not stored: a task that resumes renders them again.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/film/film.h"
#include "core/render/picture/view.h"
#include "core/render/task/render_task.h"

namespace core {

/// Returns the settings of the reference images; empty if the integrator's halves show its error.
std::optional<RenderSettings> reference_settings(const RenderSettings& settings);

/// Returns the memory of the reference images and of a comparison with them; 0 without them.
std::uint64_t reference_bytes(const RenderSettings& settings);

/// Returns the samples per pixel of both reference images when the image has `samples`: an eighth,
/// so that their noise falls with the image's; as many as the image, up to 16, at the beginning.
int reference_samples(int samples);

class ReferenceImages {
 public:
  /// Returns null if the integrator's halves show its error, or if no unbiased integrator renders
  /// the view.
  static std::unique_ptr<ReferenceImages> create(const View& view, double slice_seconds);
  ~ReferenceImages();

  /// Returns whether an image with `samples` needs more samples of the references.
  bool lacks(int samples) const { return samples_ < reference_samples(samples); }
  /// Starts the samples that they lack. Pre: no slice is out.
  void begin(int samples);
  /// Returns the next slice, of kind kReference; empty if none is available now.
  std::optional<Slice> take();
  void run(const Slice& slice);
  /// Returns whether all samples since begin() are there.
  bool is_done() const;

  /// Returns the error of the film of the task.
  ErrorEstimate error_of(const Film& image) const;
  /// Returns the CPU seconds spent since the last call.
  double take_cpu_seconds();

 private:
  ReferenceImages(std::shared_ptr<const Renderer> renderer, double slice_seconds);

  std::shared_ptr<const Renderer> renderer_;
  std::shared_ptr<Film> film_;
  double slice_seconds_;
  NullSink sink_;
  std::unique_ptr<RenderTask> task_;
  int samples_ = 0;
  double cpu_seconds_told_ = 0;
};

}  // namespace core
