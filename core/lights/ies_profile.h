/// Light profile: the intensity of a luminaire by direction, as IES LM-63 files have it.
///
/// Frame: a direction is unit, away from the luminaire, in the light's own frame: it is aimed along
/// -z, and vertical angles are in its x-z plane, as EXT_lights_ies has it. Between its angles the
/// intensity is bilinear in both; beyond them it is 0.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec.h"
#include "core/sampling/distribution.h"

namespace core {

/// How angles name directions; the values are the file's. Source: IES LM-75.
enum class Photometry : std::uint8_t {
  kC = 1,  ///< polar axis -z: theta is the vertical angle, phi the horizontal one, from +x over +y
  kB = 2,  ///< polar axis -y: theta is 90 degrees less the horizontal angle, phi the vertical one
  kA = 3   ///< polar axis +x: theta is 90 degrees less the vertical angle, phi the horizontal one
};

class IesProfile {
 public:
  /// Angles in radians, each list increasing and of at least two; theta within [0, pi]. phi of kC
  /// goes once round, its last plane being its first one again.
  struct Grid {
    Photometry photometry = Photometry::kC;
    std::vector<float> theta_rad;
    std::vector<float> phi_rad;
    std::vector<float> candela;  ///< at phi * theta_rad.size() + theta; finite, not negative
  };
  explicit IesProfile(Grid grid);

  float candela(Vec3 direction) const noexcept;
  /// Integral of the intensity over all directions [cd sr].
  double lumens() const noexcept { return lumens_; }
  /// Cosine of the widest angle to the aim at which there may be light.
  float cos_reach() const noexcept { return cos_reach_; }
  /// Unit; density pdf_solid_angle(): by the light of each cell of the grid, even within.
  Vec3 sample(Vec2 u) const noexcept;
  float pdf_solid_angle(Vec3 direction) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  /// A cell of the grid, and where in it.
  struct Place {
    std::size_t theta = 0;
    std::size_t phi = 0;
    float along_theta = 0;
    float along_phi = 0;
    bool is_inside = false;
  };
  Place place(Vec3 direction) const noexcept;
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
  Distribution2D cells_;  ///< columns are of theta, rows of phi
  double lumens_ = 0;
  float cos_reach_ = 1;
};

}  // namespace core
