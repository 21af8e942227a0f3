/// A grid of surfaces for the tests of the BSDF.
#pragma once

#include <optional>
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
  std::optional<core::BsdfLayers> layers = std::nullopt;

  core::Bsdf seen_from(core::Vec3 wo_local, core::Vec3 ng_local = {0, 0, 1}) const {
    return core::Bsdf(parameters, wo_local, ng_local, layers ? &*layers : nullptr);
  }
};

std::vector<BsdfCase> bsdf_cases();
/// Lets GoogleTest print a case by its name.
inline void PrintTo(const BsdfCase& c, std::ostream* out) { *out << c.name; }

/// Unit vector at an angle from the normal, slightly outside the x-z plane.
core::Vec3 direction(double degrees);
/// A geometric normal at 20 degrees from the shading normal; all of direction(0..80) are above it.
core::Vec3 tilted_normal();
core::Vec3 random_hemisphere(Random& random);

}  // namespace test_support
