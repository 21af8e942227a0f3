/// Number of photons per sample, their search radius and their memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/integrators/registry.h"
#include "core/settings/settings.h"

namespace core {

class Camera;
class SceneData;

/// One for each pixel of a film of 64 x 64: a judgement. Smaller films would see single particles.
inline constexpr int kPhotonPathsLeast = 1 << 12;
/// Default number of photon paths.
inline constexpr int kPhotonPathsUsual = 1 << 18;
/// Bytes of one Photon, and of one that merges with camera paths.
inline constexpr std::uint64_t kPhotonBytes = 36;
inline constexpr std::uint64_t kMergedPhotonBytes = 80;

/// Pixels for each light path of path-caustics, whose paths are aimed at caustics and cost as much
/// as a sample of the image. At equal time, 128x96, the squared error with 1, 2, 4 and 8 relative
/// to 1: caustic-pool 1, 1.2, 1.8, 3.1; glass, a glass of water, a ring in the sun, a diamond,
/// ribbed glass and sunglasses together 1, .72, .63, .61.
inline constexpr int kPixelsOfCausticPath = 2;

/// Returns the number of particles emitted per sample of the pixels: one per pixel of the full
/// film, or kPixelsOfCausticPath, within limits, unless the job sets the number.
inline int photon_paths(const RenderSettings& settings) noexcept {
  if (settings.photons.paths > 0) {
    return settings.photons.paths;
  }
  const std::int64_t pixels = static_cast<std::int64_t>(settings.film.width) * settings.film.height;
  const int of_path = settings.integrator == kCausticsIntegrator ? kPixelsOfCausticPath : 1;
  return static_cast<int>(
      std::clamp<std::int64_t>(pixels / of_path, kPhotonPathsLeast, kPhotonPathsUsual));
}

/// Returns the initial radius of the gather disks, unless the job sets it.
float usual_photon_radius_m(const SceneData& scene, const Camera& camera, const FilmSettings& film);

/// Returns the radius of the disks of sample `pass` of a replicate, relative to its first sample:
/// r^2 is multiplied by (i + alpha) / (i + 1). Source: Knaus and Zwicker 2011, eq. 15.
inline double sppm_radius(float alpha, int pass) noexcept {
  double square = 1;
  for (int i = 1; i <= pass; ++i) {
    square *= (i + static_cast<double>(alpha)) / (i + 1);
  }
  return std::sqrt(square);
}

/// Returns whether the disks of later samples are smaller than those of the first.
inline bool radius_shrinks(const RenderSettings& settings) {
  return accepts(row_of(integrators(), settings.integrator), "/integrator/alpha");
}

/// Returns the radius of the last of `samples` samples of a pixel, all replicates together,
/// relative to the first. Pre: samples > 0.
inline double radius_ratio(const RenderSettings& settings, int samples) noexcept {
  return sppm_radius(settings.photons.alpha, (samples - 1) / settings.replicates);
}

/// Returns the maximum memory of the photons of one sample, of `each` bytes: each particle at every
/// surface that it may hit, twice while the map is built.
inline std::uint64_t photons_bytes(const RenderSettings& settings, std::uint64_t each) noexcept {
  const auto places = static_cast<std::uint64_t>(photon_paths(settings)) *
                      static_cast<std::uint64_t>(std::max(settings.max_depth, 1));
  return places * (2 * each + 2 * sizeof(std::uint32_t));
}
inline std::uint64_t photon_bytes(const RenderSettings& settings) noexcept {
  return photons_bytes(settings, kPhotonBytes);
}
inline std::uint64_t merged_photon_bytes(const RenderSettings& settings) noexcept {
  return photons_bytes(settings, kMergedPhotonBytes);
}

}  // namespace core
