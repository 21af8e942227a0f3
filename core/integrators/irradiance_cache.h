/// IrradianceCache: records of the light that falls on surfaces, from which it is interpolated.
///
/// A record stands for the surface around it as far as the light changes little: its error at a
/// point is taken to be the distance over the harmonic mean distance of what is seen from it, plus
/// what the normal's turning adds. Sources: Ward, Rubinstein and Clear 1988, "A Ray Tracing
/// Solution for Diffuse Interreflection"; gradients: Ward and Heckbert 1992, "Irradiance
/// Gradients"; limits of the radius by gradient, pixels and neighbours: Krivanek and others 2006,
/// "Making Radiance and Irradiance Caching Practical"; weights that fall to 0 at the allowed error:
/// Tabellion and Lamorlette 2004, "An Approximate Global Illumination System for Computer Generated
/// Films".
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/color/rgb.h"
#include "core/math/vec.h"
#include "core/settings/cache_rules.h"

namespace core {

/// What one direction of a hemisphere shows.
struct HemisphereSample {
  Rgb radiance;
  float distance_m = 0;  ///< to the first surface; infinite: there is none
};

/// Directions over the hemisphere, one for each cell of equal cosine: rings around the normal, each
/// of as many sectors. Frame: n = (0,0,1).
class HemisphereGrid {
 public:
  /// About as many cells as `rays`, which are about as wide as they are high.
  explicit HemisphereGrid(int rays) noexcept;
  int size() const noexcept { return rings_ * sectors_; }
  /// In cell i; u in [0,1)^2.
  Vec3 direction(int i, Vec2 u) const noexcept;

  int rings() const noexcept { return rings_; }
  int sectors() const noexcept { return sectors_; }

 private:
  int rings_;
  int sectors_;
};

/// Change of irradiance, per channel: by a small turn of the normal (the vector dot the turn's axis
/// times its angle) and by a small move of the point [1/m].
struct IrradianceGradients {
  std::array<Vec3, 3> by_turn;
  std::array<Vec3, 3> by_move;
};

/// What all directions of a grid show together. Frame: n = (0,0,1).
struct HemisphereLight {
  Rgb irradiance;
  IrradianceGradients gradients;
  float mean_distance_m = 0;  ///< harmonic; infinite: nothing is around
};
/// samples: one for each cell. By turn: the derivative of the sum over the cells; by move: walls
/// between neighbouring cells shift as the nearer of their surfaces does (Ward and Heckbert 1992).
HemisphereLight gathered(const HemisphereGrid& grid, std::span<const HemisphereSample> samples);

struct IrradianceRecord {
  Vec3 position;  ///< world [m]
  Vec3 normal;    ///< unit, on the lit side
  Rgb irradiance;
  IrradianceGradients gradients;  ///< world
  float radius_m = 0;
  int scatterings = 0;  ///< of camera paths before
};

/// Limits of a record's radius, and the gradient's part in it: no longer than the way on which the
/// irradiance would double. Where the lower limit makes it longer, the gradient counts less.
/// radius_m: the mean distance when it comes in.
void limit_radius(IrradianceRecord& record, float least_m, float most_m) noexcept;

class IrradianceCache {
 public:
  /// tolerance: allowed error of interpolation, as a share.
  explicit IrradianceCache(float tolerance) noexcept : tolerance_(tolerance) {}

  /// Adds records and makes them ready to be found. Where radii of neighbours differ by more than
  /// their distance the longer one is cut: what one of them is close to, the other cannot be far
  /// from.
  void insert(std::span<const IrradianceRecord> records);

  /// Irradiance at a point with that normal, for paths with so many scatterings before; empty where
  /// no record is good enough.
  std::optional<Rgb> find(Vec3 point, Vec3 normal, int scatterings) const noexcept;
  /// Is there a record whose error is well below the allowed one?
  bool covers(Vec3 point, Vec3 normal, int scatterings) const noexcept;
  std::span<const IrradianceRecord> records() const noexcept { return records_; }

 private:
  /// Records whose spheres overlap a cell; cells are at least as wide as the spheres.
  struct Entry {
    std::uint64_t cell = 0;
    std::uint32_t record = 0;
  };
  struct Level {
    int exponent = 0;  ///< cells are 2^exponent wide [m]
    std::uint32_t first = 0;
    std::uint32_t last = 0;
  };
  static_assert(sizeof(IrradianceRecord) + 8 * sizeof(Entry) <= kRecordBytes);

  /// visit(number) for the records of the cells around a point, in the same order each time.
  template <typename Visit>
  void each_near(Vec3 point, Visit&& visit) const noexcept;
  /// visit(record, error) for each that may stand for the point; error: below the allowed one.
  template <typename Visit>
  void each(Vec3 point, Vec3 normal, int scatterings, Visit&& visit) const noexcept;
  void index();

  float tolerance_;
  std::vector<IrradianceRecord> records_;
  std::vector<Entry> entries_;  ///< by level, cell and record
  std::vector<Level> levels_;
};

}  // namespace core
