/// IesProfile: the intensity distribution of a luminaire, from an IES LM-63 file.
///
/// Frame: directions are unit vectors away from the luminaire in the light's own frame, which aims
/// along -z with vertical angles in the x-z plane, as in EXT_lights_ies. Intensity is bilinear
/// between the angles of the file and 0 outside of them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec.h"
#include "core/sampling/distribution.h"

namespace core {

/// Coordinate system of the angles; values as in the file. Source: IES LM-75.
enum class Photometry : std::uint8_t {
  kC = 1,  ///< polar axis -z: theta is the vertical angle, phi the horizontal angle, from +x over
           ///< +y
  kB = 2,  ///< polar axis -y: theta is 90 degrees minus the horizontal angle, phi the vertical
           ///< angle
  kA = 3  ///< polar axis +x: theta is 90 degrees minus the vertical angle, phi the horizontal angle
};

class IesProfile {
 public:
  /// Angles in radians; each list is increasing and has at least two; theta within [0, pi]. phi of
  /// kC covers the full circle, and its last plane repeats the first.
  struct Grid {
    Photometry photometry = Photometry::kC;
    std::vector<float> theta_rad;
    std::vector<float> phi_rad;
    std::vector<float> candela;  ///< [phi * theta_rad.size() + theta]; finite, not negative
  };
  explicit IesProfile(Grid grid);

  float candela(Vec3 direction) const noexcept;
  /// Returns the integral of intensity over all directions [cd sr].
  double lumens() const noexcept { return lumens_; }
  /// Returns the cosine of the largest angle to the aim with nonzero intensity.
  float cos_reach() const noexcept { return cos_reach_; }
  /// Samples a unit direction with density pdf_solid_angle(): cells by their light, uniform within
  /// a cell.
  Vec3 sample(Vec2 u) const noexcept;
  float pdf_solid_angle(Vec3 direction) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  /// A cell of the grid and a position in it.
  struct Cell {
    std::size_t theta = 0;
    std::size_t phi = 0;
    float along_theta = 0;
    float along_phi = 0;
    bool is_inside = false;
  };
  Cell cell_at(Vec3 direction) const noexcept;
  Vec3 direction(float cos_theta, float phi_rad) const noexcept;
  float corner(std::size_t phi, std::size_t theta) const noexcept {
    return grid_.candela[phi * grid_.theta_rad.size() + theta];
  }
  double cell_lumens(std::size_t phi, std::size_t theta) const noexcept;
  float cell_solid_angle(std::size_t phi, std::size_t theta) const noexcept;

  Grid grid_;
  Vec3 pole_;     ///< theta 0
  Vec3 zero_;     ///< theta 90 degrees, phi 0
  Vec3 quarter_;  ///< theta 90 degrees, phi 90 degrees
  std::vector<float> cos_theta_;
  Distribution2D cells_;  ///< columns: theta, rows: phi
  double lumens_ = 0;
  float cos_reach_ = 1;
};

}  // namespace core
