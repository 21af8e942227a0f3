/// LightCensus: counts particles from the lights where they arrive at surfaces that the camera
/// sees.
///
/// Radiance samples have no bound, so no statistic of them bounds light that they missed. The power
/// of particles has one: each carries the same share of all that is emitted, and at each scattering
/// it survives with the probability by which its largest channel shrinks (analog absorption), so no
/// channel grows. Hits of a region are then Bernoulli trials, whose probability has exact bounds.
/// That holds for diffuse and clear surfaces; at others, whose lobes are not sampled in exact
/// proportion, a particle's share may grow (over random directions by 1 to 4% in the mean at
/// plastics, by 3 to 17% at rough metals), and the bounds are approximate.
///
/// Camera rays, one per square of spacing_px() pixels, follow smooth surfaces to diffuse ones, the
/// points; disks around them have that radius. A particle adds to the picture what its power within
/// the disk around a point would be seen as there, with the surface's diffuse albedo (Jensen 1996;
/// the disks: core/integrators/maps/photon_mapping.cpp). Its light in a tile is counted as a hit
/// with the probability (light / unit of the tile); so hits times the unit over the number of
/// particles is the tile's mean luminance. If its light is above the unit, it counts more than
/// once. Units are the largest sums of light at any point. Light that only narrow lobes scatter, or
/// that leaves a light directly to the camera, is not counted.
///
/// Every second particle is held out: it also counts in units of the picture, for a bound on all
/// regions together in which the others met nothing.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/base/mutex.h"
#include "core/integrators/integrator.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/samplers/streams.h"
#include "core/transport/light_path.h"

namespace core {

/// How light came to a surface.
struct LightRoute {
  enum Kind : std::uint8_t {
    kDirect,
    kIndirect,
    kCaustic,      ///< through or off sharp surfaces alone, at least one
    kAfterCaustic  ///< began as kCaustic, then scattered at rough surfaces
  };
  Kind kind = kDirect;
  bool is_punctual = false;  ///< from a light that no ray can hit
  bool is_mirrored = false;  ///< the camera sees it through or in smooth surfaces
  bool is_rough = false;     ///< one of the sharp surfaces is not smooth

  static constexpr int kCount = 32;
  constexpr int index() const noexcept {
    return kind * 8 + (is_rough ? 4 : 0) + (is_punctual ? 2 : 0) + (is_mirrored ? 1 : 0);
  }
  static constexpr LightRoute at(int index) noexcept {
    return {static_cast<Kind>(index / 8), (index & 2) != 0, (index & 1) != 0, (index & 4) != 0};
  }
  constexpr bool is_caustic() const noexcept { return kind >= kCaustic; }
};

/// Sums of hits.
struct CensusHits {
  std::uint32_t open = 0;      ///< of particles 0, 2 ... in units of the tile
  std::uint32_t held = 0;      ///< of particles 1, 3 ... in units of the tile
  std::uint32_t pictured = 0;  ///< of particles 1, 3 ... in units of the picture
};

class LightCensus {
 public:
  /// input.camera must not be null; all must outlive the census. tiles: of the picture. stream:
  /// its random numbers (core/samplers/streams.h), independent of those of the picture.
  LightCensus(const IntegratorInput& input, std::span<const PixelRect> tiles,
              std::uint64_t stream = kCensusStream);

  /// Follows particles [first, last). Thread-safe: sums are integers, so the order is irrelevant.
  /// Returns the number of rays.
  std::uint64_t trace(int first, int last);

  int spacing_px() const noexcept { return spacing_px_; }
  int tile_count() const noexcept { return static_cast<int>(units_.size()); }
  CensusHits hits(int tile, LightRoute route) const noexcept;
  /// Mean luminance of the tile, or of the picture, if every particle were a hit; 0: no points.
  double unit(int tile) const noexcept { return units_[static_cast<std::size_t>(tile)]; }
  double picture_unit() const noexcept { return picture_unit_; }
  /// Returns the light (index of a light group) and material from which most light of caustics
  /// came; empty if there was none.
  struct Source {
    std::uint32_t group = 0;
    std::uint32_t material = 0;
  };
  std::optional<Source> caustic_source() const;

 private:
  struct Point {
    Vec3 position;
    Vec3 normal;  ///< geometric, on the viewer's side
    Rgb factor;   ///< mean radiance of the tile per power of a particle in the disk
    float radius_m = 0;
    int tile = 0;
    int level = 0;  ///< exponent of the radius
    int scatterings = 0;
    float share = 0;  ///< of the tile in the picture
  };
  struct Particle;

  void find_points(const IntegratorInput& input, std::span<const PixelRect> tiles);
  void follow_camera_path(PathState& path, const Point& blank);
  void build_grid();
  void set_units();
  std::uint32_t bucket(const Point& at, std::array<std::int64_t, 3> cell) const noexcept;
  template <typename Visit>
  void each_near(Vec3 position, Vec3 normal, Visit&& visit) const;
  void arrive(const PathState& path, const LightVertex& vertex, Particle& particle);

  const SceneData& scene_;
  const RenderSettings& settings_;
  std::uint64_t stream_;
  EmissionSampler emission_;
  int spacing_px_ = 0;
  std::vector<Point> points_;
  std::vector<int> levels_;             ///< of all points
  std::vector<std::uint32_t> first_;    ///< [bucket + 1], into entries_
  std::vector<std::uint32_t> entries_;  ///< points whose disk touches a cell
  std::vector<double> units_;
  double picture_unit_ = 0;
  std::vector<std::atomic<std::uint32_t>> counts_;  ///< [(tile, route) * 3 + member of CensusHits]
  mutable Mutex mutex_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint64_t> sources_ GUARDED_BY(mutex_);
};

}  // namespace core
