/// A grid of surfaces that the tests of the BSDF walk.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "core/bsdf/bsdf.h"
#include "tests/support/statistics.h"

namespace test_support {

struct BsdfCase {
  std::string name;
  core::BsdfParameters parameters;
  bool lossless = false;
  double furnace_tolerance = 0.005;
  bool scaled_by_viewer = false;     ///< a factor of wo alone restores energy: not exactly reciprocal
  double reciprocity_tolerance = 0;  ///< relative, for those
};

std::vector<BsdfCase> bsdf_cases();
/// GoogleTest prints a case by its name.
inline void PrintTo(const BsdfCase& c, std::ostream* out) { *out << c.name; }

/// Unit vector at an angle from the normal, slightly out of the x-z plane.
core::Vec3 direction(double degrees);
/// A geometric normal that differs from the shading normal by 20 degrees, still on the side of all of direction(0..80).
core::Vec3 tilted_normal();
core::Vec3 random_hemisphere(Random& random);

}  // namespace test_support
