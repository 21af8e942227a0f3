/// IrradianceCache: interpolates irradiance from records at surface points.
///
/// A record is used around its point while irradiance varies little: its error at another point is
/// estimated as the distance divided by the harmonic mean distance of the surfaces visible from it,
/// plus a term for the change of the normal. Sources: Ward, Rubinstein and Clear 1988, "A Ray
/// Tracing Solution for Diffuse Interreflection"; gradients: Ward and Heckbert 1992, "Irradiance
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
#include "core/integrators/maps/cache_rules.h"
#include "core/math/vec.h"

namespace core {

/// The radiance and distance seen in one direction of a hemisphere.
struct HemisphereSample {
  Rgb radiance;
  float distance_m = 0;  ///< to the first surface; infinite if there is none
};

/// Stratifies the directions of a hemisphere into cells of equal projected solid angle: rings
/// around the normal, each divided into the same number of sectors. Frame: n = (0,0,1).
class HemisphereGrid {
 public:
  /// Makes about `rays` cells that are about as wide as they are high.
  explicit HemisphereGrid(int rays) noexcept;
  int size() const noexcept { return rings_ * sectors_; }
  /// Returns a direction in cell i; u in [0,1)^2.
  Vec3 direction(int i, Vec2 u) const noexcept;

  int rings() const noexcept { return rings_; }
  int sectors() const noexcept { return sectors_; }

 private:
  int rings_;
  int sectors_;
};

/// Gradients of irradiance per channel. by_turn: rotation of the normal (the change is the dot
/// product with the rotation axis times its angle); by_move: translation of the point [1/m].
struct IrradianceGradients {
  std::array<Vec3, 3> by_turn;
  std::array<Vec3, 3> by_move;
};

/// Irradiance gathered over all directions of a grid. Frame: n = (0,0,1).
struct HemisphereLight {
  Rgb irradiance;
  IrradianceGradients gradients;
  float mean_distance_m = 0;  ///< harmonic mean; infinite if no surface is visible
};
/// Computes irradiance and gradients. samples: one per cell. by_turn is the derivative of the sum
/// over the cells; by_move follows from the boundaries between neighbouring cells, which shift with
/// the nearer of their surfaces (Ward and Heckbert 1992).
HemisphereLight gathered(const HemisphereGrid& grid, std::span<const HemisphereSample> samples);

struct IrradianceRecord {
  Vec3 position;  ///< world [m]
  Vec3 normal;    ///< unit, on the lit side
  Rgb irradiance;
  IrradianceGradients gradients;  ///< world
  float radius_m = 0;
  int scatterings = 0;  ///< of the camera path before this point
};

/// Clamps the record's radius to [least_m, most_m] and to the distance over which its gradient
/// would double the irradiance. If the lower limit enlarges the radius, scales the gradient down.
/// On entry radius_m is the mean distance.
void limit_radius(IrradianceRecord& record, float least_m, float most_m) noexcept;

class IrradianceCache {
 public:
  /// tolerance: allowed relative error of interpolation.
  explicit IrradianceCache(float tolerance) noexcept : tolerance_(tolerance) {}

  /// Adds records and indexes them. Where the radii of neighbours differ by more than their
  /// distance, reduces the larger one: a surface close to one record cannot be far from the other.
  void insert(std::span<const IrradianceRecord> records);

  /// Returns the irradiance at a point with this normal for paths with `scatterings` scatterings so
  /// far; empty if no record is accurate enough.
  std::optional<Rgb> find(Vec3 point, Vec3 normal, int scatterings) const noexcept;
  /// Returns whether some record has an error well below the allowed one.
  bool covers(Vec3 point, Vec3 normal, int scatterings) const noexcept;
  std::span<const IrradianceRecord> records() const noexcept { return records_; }

 private:
  /// Maps a cell to a record whose sphere overlaps it. Cells are at least as wide as the spheres.
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

  /// Calls visit(number) for the records in the cells around a point, always in the same order.
  template <typename Visit>
  void each_near(Vec3 point, Visit&& visit) const noexcept;
  /// Calls visit(record, error) for each record usable at the point; error: below the allowed one.
  template <typename Visit>
  void each(Vec3 point, Vec3 normal, int scatterings, Visit&& visit) const noexcept;
  void index();

  float tolerance_;
  std::vector<IrradianceRecord> records_;
  std::vector<Entry> entries_;  ///< sorted by level, cell and record
  std::vector<Level> levels_;
};

}  // namespace core
