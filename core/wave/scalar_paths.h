/// Paths that leave the lanes at an unsupported surface and return after it.
#pragma once

#include <type_traits>

#include "core/integrators/path/catcher.h"
#include "core/integrators/path/path_tracer.h"
#include "core/wave/wave_access.h"

namespace core {

/// Jobs with a catcher are not spectral.
template <typename Options>
using CatcherOf = CatcherTracer<std::conditional_t<Options::is_spectral, WholeOptions, Options>>;

template <typename Options>
class ScalarPaths {
 public:
  /// catcher: null if there is none.
  ScalarPaths(const PathTracer<Options>& scalar, const CatcherOf<Options>* catcher)
      : scalar_(scalar), catcher_(catcher), split_count_(scalar.options().split_count) {}

  /// Follows a path until lanes can continue it, then adds it to wave.waiting, or to its end. slot:
  /// of WavePaths.
  void follow(Wave& wave, TracedPath& path, std::int32_t slot) const noexcept;

  /// Returns a path of the lanes with a ray of any length.
  TracedPath handed_over(const WavePath& from, const PathSampler& sampler,
                         std::uint64_t& rays) const noexcept;

  /// Appends the paths that wait for this depth to wave.paths.
  void take_back(Wave& wave, int depth) const noexcept;

 private:
  bool has_solids() const noexcept { return !Options::is_spectral && scalar_.fog() == nullptr; }
  using Surface = typename Options::Surface;
  bool extend(TracedPath& path, const PathVertex& vertex, const Surface& bsdf) const noexcept;
  void split(Wave& wave, TracedPath& path, const PathVertex& vertex, const Surface& bsdf,
             std::int32_t slot) const noexcept;

  const PathTracer<Options>& scalar_;
  const CatcherOf<Options>* catcher_;
  int split_count_;
};

}  // namespace core
