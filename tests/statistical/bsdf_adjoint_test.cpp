// Reciprocity of transport: for each surface the double integral of its scattering over viewers and
// lights, sampled from the viewer's side and from the light's, must agree. About 200 p-values, each
// rejected below sidak(0.01, 400).
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "core/materials/adjoint_bsdf.h"
#include "core/sampling/warp.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/statistics.h"

namespace {

using core::ScatterSample;
using core::SeenSurface;
using core::TransportMode;
using core::Vec3;
using test_support::BsdfCase;
using test_support::Random;

const double kLevel = test_support::sidak(0.01, 400);

/// A case of tests/support as a material at a point whose normals differ by an angle.
struct Surface {
  core::Material material;
  core::SurfacePoint point;
  bool is_delta = false;

  Surface(const BsdfCase& c, double bent_degrees)
      : is_delta(c.seen_from(test_support::direction(40)).prob_delta() > 0) {
    material.plain = c.parameters;
    material.transmits = c.parameters.transmission > 0;
    if (c.layers) {
      core::MaterialDescription& f = material.factors;
      material.has_layers = true;
      f.clearcoat = c.layers->clearcoat;
      f.clearcoat_roughness = c.layers->clearcoat_roughness;
      f.sheen_color = c.layers->sheen_color;
      f.sheen_roughness = c.layers->sheen_roughness;
      f.iridescence = c.layers->iridescence;
      f.iridescence_ior = c.layers->iridescence_ior;
      f.iridescence_thickness_max_nm = c.layers->iridescence_thickness_nm;
      f.diffuse_transmission = c.layers->diffuse_transmission;
      f.diffuse_transmission_color = c.layers->diffuse_transmission_color;
    }
    point.normal_geometric = {0, 0, 1};
    point.normal_shading = test_support::direction(bent_degrees);
  }
  core::ScatterPoint at() const { return {material, point, {}}; }
};

enum class Region {
  kAll,
  /// within 40 degrees of the geometric normal, where smooth lobes have no mirror direction below
  /// the horizon
  kNearNormal,
  kThrough,  ///< viewers above the surface, lights below
};

Region region_of(const Surface& surface) {
  return surface.is_delta ? Region::kNearNormal : Region::kAll;
}

/// Weight of viewers and lights.
double weight(Vec3 w, bool viewer, Region region) {
  const Vec3 axis = viewer ? Vec3{0.8F, 0, 0.6F} : Vec3{-0.6F, 0.64F, 0.48F};
  const double wide = 1.1 + static_cast<double>(dot(w, axis));
  const double narrow = std::max(std::fabs(static_cast<double>(w.z)) - 0.766, 0.0);
  switch (region) {
    case Region::kAll:
      return wide * wide;
    case Region::kNearNormal:
      return 20 * narrow * narrow * wide;
    case Region::kThrough:
      return (w.z > 0) == viewer ? wide : 0.0;
  }
  return 0;
}

/// Changes a particle's weight: plants a fault.
using Bend = std::function<double(const ScatterSample&, Vec3 wo)>;

/// Samples from the start of the path: viewers in radiance mode, lights in importance mode.
test_support::Moments scattered(const Surface& surface, TransportMode mode, Region region,
                                int count, const Bend& bend) {
  const bool from_viewer = mode == TransportMode::kRadiance;
  Random random(from_viewer ? 20 : 21);
  test_support::Moments sum;
  for (int i = 0; i < count; ++i) {
    const Vec3 wo = core::uniform_sphere(random.uniform_2d());
    const float lobe = random.uniform();
    const core::Vec2 u = random.uniform_2d();
    const double first = weight(wo, from_viewer, region);
    if (!(first > 0)) {
      sum.add(0);
      continue;
    }
    const SeenSurface seen(surface.at(), wo);
    const ScatterSample s = sample_scatter(surface.at(), seen, lobe, u, mode);
    double value = static_cast<double>(core::average(s.weight));
    if (value != 0) {
      value *= first * std::fabs(static_cast<double>(wo.z)) *
               weight(s.wi_world, !from_viewer, region) * bend(s, wo);
    }
    sum.add(value);
  }
  return sum;
}

double none(const ScatterSample& /*s*/, Vec3 /*wo*/) { return 1; }

double p_value(const Surface& surface, Region region, const Bend& bend, int count) {
  const auto a = scattered(surface, TransportMode::kRadiance, region, count, none);
  const auto b = scattered(surface, TransportMode::kImportance, region, count, bend);
  return test_support::two_sided_p((a.mean - b.mean) /
                                   std::hypot(a.standard_error(), b.standard_error()));
}

class BsdfAdjoint : public testing::TestWithParam<BsdfCase> {};

INSTANTIATE_TEST_SUITE_P(Cases, BsdfAdjoint, testing::ValuesIn(test_support::bsdf_cases()),
                         [](const auto& c) { return c.param.name; });

TEST_P(BsdfAdjoint, ParticlesCarryTheLightThatViewersSee) {
  for (const double bent : {0.0, 25.0}) {
    const Surface surface(GetParam(), bent);
    EXPECT_GT(p_value(surface, region_of(surface), none, 40000), kLevel) << bent;
  }
}

TEST_P(BsdfAdjoint, DetectsTheEtaSquaredOfRadianceMode) {
  const core::BsdfParameters& p = GetParam().parameters;
  const bool is_leaf = GetParam().layers && GetParam().layers->diffuse_transmission > 0;
  if (p.thin || !(p.transmission > 0 || is_leaf) || p.ior == 1) {
    return;  // does not enter another medium
  }
  const Surface surface(GetParam(), 0);
  EXPECT_GT(p_value(surface, Region::kThrough, none, 40000), kLevel);
  const auto squared = [&p](const ScatterSample&, Vec3 wo) {
    const double n = static_cast<double>(p.ior);
    return wo.z > 0 ? 1 / (n * n) : n * n;
  };
  EXPECT_LT(p_value(surface, Region::kThrough, squared, 40000), kLevel);
}

BsdfCase case_named(const std::string& name) {
  for (const BsdfCase& c : test_support::bsdf_cases()) {
    if (c.name == name) {
      return c;
    }
  }
  ADD_FAILURE() << "no case " << name;
  return {};
}

/// Light changes direction at each of these surfaces: under null scattering the factor is 1.
constexpr const char* kTurning[] = {"Lambert",
                                    "Metal60",
                                    "Dielectric30",
                                    "SolidGlassOutside60",
                                    "SheenOverDielectric20",
                                    "CoatOverMetal70",
                                    "DiffuseTransmission70",
                                    "AnisotropicGold"};

TEST(BsdfAdjointTwin, DetectsShadingNormalsWithoutTheirFactor) {
  for (const char* name : kTurning) {
    const Surface surface(case_named(name), 25);
    const Vec3 n = surface.point.normal_shading;
    const auto cosines = [n](const ScatterSample& s, Vec3 wo) {
      const double shading = std::fabs(static_cast<double>(dot(n, s.wi_world) / dot(n, wo)));
      return shading / std::fabs(static_cast<double>(s.wi_world.z / wo.z));
    };
    EXPECT_LT(p_value(surface, Region::kAll, cosines, 100000), kLevel) << name;
  }
}

// Density and samples of importance mode with differing normals.
TEST(BsdfAdjointChi2, ImportanceSamplesFollowTheirDensity) {
  for (const char* name : {"Lambert", "SolidGlassOutside60", "DiffuseTransmission70"}) {
    const Surface surface(case_named(name), 25);
    const SeenSurface seen(surface.at(), test_support::direction(-35));
    const auto p = [&](float spoil, int count) {
      return test_support::chi2_sphere(
                 [&](Random& r) -> std::optional<Vec3> {
                   const float lobe = r.uniform();
                   const ScatterSample s = sample_scatter(surface.at(), seen, lobe, r.uniform_2d(),
                                                          TransportMode::kImportance);
                   return s.pdf_solid_angle > 0 ? std::optional(s.wi_world) : std::nullopt;
                 },
                 [&](Vec3 wi) {
                   return spoil * evaluate_scatter(seen, SeenSurface(surface.at(), wi),
                                                   TransportMode::kImportance)
                                      .pdf_solid_angle;
                 },
                 count, 22)
          .p_value;
    };
    EXPECT_GT(p(1, 60000), kLevel) << name;
    EXPECT_LT(p(1.05F, 120000), kLevel) << name;
  }
}

// The reverse density of one mode is the forward density of the other.
TEST_P(BsdfAdjoint, ReverseDensitiesEqualThoseOfTheOtherMode) {
  const Surface surface(GetParam(), 25);
  Random random(23);
  for (int i = 0; i < 200; ++i) {
    const SeenSurface a(surface.at(), core::uniform_sphere(random.uniform_2d()));
    const SeenSurface b(surface.at(), core::uniform_sphere(random.uniform_2d()));
    const auto forward = evaluate_scatter(a, b, TransportMode::kImportance);
    const auto back = evaluate_scatter(b, a, TransportMode::kRadiance);
    EXPECT_EQ(forward.pdf_reverse, back.pdf_solid_angle);
    EXPECT_EQ(forward.pdf_solid_angle, back.pdf_reverse);
    // K(v; l) |ng . v| computed from both sides.
    const double va = std::fabs(static_cast<double>(a.wo_world().z));
    const double vb = std::fabs(static_cast<double>(b.wo_world().z));
    EXPECT_NEAR(static_cast<double>(forward.value_cos.g) * va,
                static_cast<double>(back.value_cos.g) * vb,
                1e-5 * static_cast<double>(back.value_cos.g));
  }
}

}  // namespace
