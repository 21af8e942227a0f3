// Closed forms of microfacet theory (truths 3 and 8), energy and reciprocity of the layered BSDF.
#include "core/bsdf/bsdf.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/anisotropic_albedo.h"
#include "core/bsdf/clearcoat_lobe.h"
#include "core/bsdf/fresnel.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/statistics.h"

namespace {

using core::Bsdf;
using core::Vec3;
using test_support::BsdfCase;

/// Albedo under uniform light by sample() from wo, over the first points of a Kronecker sequence in
/// three dimensions (powers of a generalised plastic number, Roberts 2018): error about 1e-4 for
/// smooth integrands.
core::Rgb sampled_color(const Bsdf& bsdf, int count) {
  double sum[3] = {};
  double u[3] = {0.5, 0.5, 0.5};
  constexpr double kSteps[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      u[k] += kSteps[k];
      u[k] -= std::floor(u[k]);
    }
    const auto unit = [](double x) { return std::min(static_cast<float>(x), 0x1.fffffep-1F); };
    const auto s = bsdf.sample(unit(u[0]), {unit(u[1]), unit(u[2])});
    for (int c = 0; c < 3; ++c) {
      sum[c] += static_cast<double>(s.weight[c] * s.eta * s.eta);  // radiance / n^2 is conserved
    }
  }
  const auto mean = [&](int c) { return static_cast<float>(sum[c] / count); };
  return {mean(0), mean(1), mean(2)};
}
double sampled_albedo(const Bsdf& bsdf, int count = 150000) {
  return static_cast<double>(core::average(sampled_color(bsdf, count)));
}

// Truth 8.
TEST(Fresnel, GlassInAirHasTheTextbookValues) {
  EXPECT_NEAR(core::fresnel_dielectric(1, 1.5F), 0.04, 1e-6);
  EXPECT_NEAR(core::fresnel_dielectric(1, 1 / 1.5F), 0.04, 1e-6);
  const double r = static_cast<double>(core::fresnel_dielectric(1, 1.5F));
  EXPECT_NEAR(2 * r / (1 + r), 0.0769231, 1e-6);
  // At Brewster's angle one polarisation is not reflected: the reflectance is half of
  // ((n^2-1)/(n^2+1))^2.
  const double brewster = 56.3099 * std::numbers::pi / 180;
  EXPECT_NEAR(core::fresnel_dielectric(static_cast<float>(std::cos(brewster)), 1.5F),
              0.5 * std::pow(1.25 / 3.25, 2), 1e-6);
  const double critical = 41.8103 * std::numbers::pi / 180;
  EXPECT_EQ(core::fresnel_dielectric(static_cast<float>(std::cos(critical + 1e-5)), 1 / 1.5F), 1);
  EXPECT_LT(core::fresnel_dielectric(static_cast<float>(std::cos(critical - 1e-5)), 1 / 1.5F), 1);
  EXPECT_EQ(core::fresnel_dielectric(0, 1.5F), 1);
}

// glTF 2.0, appendix B.3.4; a half and three quarters are exact.
TEST(Fresnel, SchlicksWeightIsTheFifthPower) {
  EXPECT_EQ(core::schlick_weight(0.5F), 0x1p-5F);
  EXPECT_EQ(core::schlick_weight(0.75F), 0x1p-10F);
  EXPECT_EQ(core::schlick_weight(0.0F), 1);
  EXPECT_EQ(core::schlick_weight(1.0F), 0);
  EXPECT_NEAR(core::fresnel_schlick(0.04F, 0.8F, 0.5F), 0.04 * 31 / 32 + 0.8 / 32, 1e-7);
}

TEST(Fresnel, HemisphericalReflectanceMatchesTheTables) {
  for (const auto& [eta, truth] : {std::pair{1.5F, 0.091778}, std::pair{1 / 1.5F, 0.596346}}) {
    double sum = 0;
    constexpr int kSteps = 200000;
    for (int i = 0; i < kSteps; ++i) {
      const double mu = (i + 0.5) / kSteps;
      sum += 2 * mu * static_cast<double>(core::fresnel_dielectric(static_cast<float>(mu), eta)) /
             kSteps;
    }
    EXPECT_NEAR(sum, truth, 1e-4);
  }
}

// Albedo of single-scattering GGX by quadrature; the first value is exactly 1 - ln 2.
struct GgxTruth {
  float alpha;
  double normal;
  double slanted;  // mu = 0.5
  double average;
};
constexpr GgxTruth kGgx[] = {{1, 0.306853, 0.45069, 0.40914},
                             {0.5F, 0.68785, 0.69825, 0.70024},
                             {0.25F, 0.91581, 0.85726, 0.88232}};

double ggx_albedo(float alpha, double mu) {
  const core::Ggx ggx = {alpha, alpha};
  const auto z = static_cast<float>(mu);
  const Vec3 wo = {std::sqrt(1 - z * z), 0, z};
  double sum = 0;
  constexpr int kSide = 1000;
  for (int i = 0; i < kSide; ++i) {
    for (int k = 0; k < kSide; ++k) {
      const Vec3 h = ggx.sample_visible(
          wo, {(static_cast<float>(i) + 0.5F) / kSide, (static_cast<float>(k) + 0.5F) / kSide});
      const Vec3 wi = h * (2 * dot(wo, h)) - wo;
      if (wi.z > 0) {
        sum += static_cast<double>(ggx.g2(wo, wi) / ggx.g1(wo));
      }
    }
  }
  return sum / (kSide * kSide);
}

TEST(Ggx, SingleScatteringAlbedosMatchTheClosedForms) {
  for (const GgxTruth& t : kGgx) {
    EXPECT_NEAR(ggx_albedo(t.alpha, 1), t.normal, 2e-4) << t.alpha;
    EXPECT_NEAR(ggx_albedo(t.alpha, 0.5), t.slanted, 2e-4) << t.alpha;
  }
}

TEST(AlbedoTables, AgreeWithTheClosedForms) {
  for (const GgxTruth& t : kGgx) {
    const float roughness = std::sqrt(t.alpha);
    EXPECT_NEAR(core::specular_albedo(1.0F, roughness).e, t.normal, 1e-3) << t.alpha;
    EXPECT_NEAR(core::specular_albedo(0.5F, roughness).e, t.slanted, 1e-3) << t.alpha;
    EXPECT_NEAR(core::specular_albedo_average(roughness).e, t.average, 1e-3) << t.alpha;
  }
}

// Also between the nodes and for narrow lobes, against the integral at high resolution.
TEST(AlbedoTables, AgreeWithTheIntegral) {
  for (const float roughness : {0.15F, 0.2F, 0.3F, 0.45F, 0.77F}) {
    for (const double mu : {1.0, 0.8, 0.3}) {
      EXPECT_NEAR(core::specular_albedo(static_cast<float>(mu), roughness).e,
                  ggx_albedo(roughness * roughness, mu), 2e-3)
          << roughness << " " << mu;
    }
  }
}

// Of two smooth curves E = 0.04 + 0.96 w and e5 = w = (1 - mu)^5: w has mean 1/21 and its square
// 1/66, so that the covariance is 0.96 (1/66 - 1/21^2). That with e = 1 is 0.
TEST(AlbedoTables, CovarianceUnderASmoothCoatIsExact) {
  const core::SpecularAlbedo smooth = core::covariance_under_coat(0.0F, 0.0F);
  EXPECT_NEAR(smooth.e, 0, 1e-6);
  EXPECT_NEAR(smooth.e5, 0.96 * (1.0 / 66 - 1.0 / 441), 1e-5);
}

// The mean over all directions equals the reflectance of uniform light by one wide lobe: a check
// that D and G are consistent.
TEST(Ggx, NormalsProjectToTheMacrosurface) {
  for (const float ax : {0.1F, 0.5F, 1.0F}) {
    for (const float ay : {0.3F, 1.0F}) {
      const core::Ggx ggx = {ax, ay};
      const double z[2] = {0, 1};
      const double phi[2] = {0, 2 * std::numbers::pi};
      const double sum = test_support::integrate_2d(
          [&](double c, double p) {
            const double s = std::sqrt(1 - c * c);
            const Vec3 h = {static_cast<float>(s * std::cos(p)),
                            static_cast<float>(s * std::sin(p)), static_cast<float>(c)};
            return static_cast<double>(ggx.d(h)) * c;
          },
          z, phi, 1e-6, 4, 10);
      EXPECT_NEAR(sum, 1, 2e-4) << ax << " " << ay;
    }
  }
}

class BsdfOf : public testing::TestWithParam<BsdfCase> {};

INSTANTIATE_TEST_SUITE_P(Cases, BsdfOf, testing::ValuesIn(test_support::bsdf_cases()),
                         [](const auto& c) { return c.param.name; });

// A lossless surface reflects all light: 1 within the interpolation error of the tables, which is
// 0.5% (truth 3).
TEST_P(BsdfOf, IsLosslessInAWhiteFurnace) {
  const BsdfCase& c = GetParam();
  for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
    const Bsdf bsdf = c.seen_from(test_support::direction(degrees));
    const double albedo = sampled_albedo(bsdf);
    if (c.lossless) {
      EXPECT_NEAR(albedo, 1, c.furnace_tolerance) << degrees;
    } else {
      EXPECT_LE(albedo, 1 + c.furnace_tolerance) << degrees;
    }
  }
}

// Mirroring directions at the geometric plane does not create energy.
TEST_P(BsdfOf, IsLosslessUnderATiltedGeometricNormal) {
  const BsdfCase& c = GetParam();
  for (const double degrees : {10.0, 50.0, 75.0}) {
    const Vec3 wo = test_support::direction(degrees);
    const Bsdf flat = c.seen_from(wo);
    const Bsdf tilted = c.seen_from(wo, test_support::tilted_normal());
    EXPECT_NEAR(sampled_albedo(tilted), sampled_albedo(flat), 2e-3) << degrees;
  }
}

// f(wo, wi) = f(wi, wo), times n^2 ratios for refraction: adjoint(wi -> wo) / n_o^2 = f / n_i^2.
TEST_P(BsdfOf, IsReciprocal) {
  const BsdfCase& c = GetParam();
  test_support::Random random(1);
  for (int i = 0; i < 300; ++i) {
    const Vec3 wo = test_support::random_hemisphere(random);
    Vec3 wi = test_support::random_hemisphere(random);
    const bool leaf = c.layers && c.layers->diffuse_transmission > 0;
    const bool through = (c.parameters.transmission > 0 || leaf) && i % 2 == 0;
    if (wo.z < 0.05F || wi.z < 0.05F) {
      continue;
    }
    BsdfCase other = c;
    Vec3 from = wi;
    Vec3 to = wo;
    double scale = 1;
    if (through) {
      wi.z = -wi.z;
      // Seen from the other side, the z axis of the frame is reversed, so both directions change
      // the sign of z.
      to.z = -wo.z;
      if (!c.parameters.thin) {
        other.parameters.inside = !other.parameters.inside;
        const double n = static_cast<double>(c.parameters.ior);
        scale = c.parameters.inside ? 1 / (n * n) : n * n;
      }
    }
    const double forward =
        static_cast<double>(c.seen_from(wo).evaluate(wi).value_cos.g / std::fabs(wi.z));
    const double backward =
        static_cast<double>(other.seen_from(from).evaluate(to).value_cos.g / std::fabs(to.z));
    EXPECT_NEAR(forward * scale, backward, 3e-4 * std::max(std::fabs(forward * scale), 1e-2))
        << i << (through ? " through" : "");
  }
}

// albedo() is the mean weight of sample().
TEST_P(BsdfOf, AlbedoLayerIsTheScatteredFraction) {
  const BsdfCase& c = GetParam();
  for (const double degrees : {0.0, 45.0, 70.0}) {
    const Bsdf bsdf = c.seen_from(test_support::direction(degrees));
    // Films are evaluated at the view angle, and sheen reduces the layers below by the smaller of
    // two factors (as required by its extension), which the layer ignores.
    const double tolerance = std::max(c.layers ? 0.13 : 0.015, c.furnace_tolerance);
    EXPECT_NEAR(core::average(bsdf.albedo()), sampled_albedo(bsdf), tolerance) << degrees;
  }
}

struct FilmCase {
  float ior;
  float thickness_nm;
  float roughness;

  Bsdf seen_from(double degrees, core::BsdfParameters p) const {
    p.roughness = roughness;
    p.alpha_x = p.alpha_y = std::max(roughness * roughness, 1e-4F);
    core::BsdfLayers film;
    film.iridescence = 1;
    film.iridescence_ior = ior;
    film.iridescence_thickness_nm = thickness_nm;
    return Bsdf(p, test_support::direction(degrees), {0, 0, 1}, &film);
  }
};

std::vector<FilmCase> films(std::initializer_list<float> roughnesses) {
  std::vector<FilmCase> out;
  for (const float ior : {1.0F, 1.3F, 1.8F, 2.4F}) {
    for (const float thickness : {0.0F, 200.0F, 400.0F, 1000.0F}) {
      for (const float roughness : roughnesses) {
        out.push_back({ior, thickness, roughness});
      }
    }
  }
  return out;
}

// glTF 2.0, appendix B.2: mix(dielectric_brdf, metal_brdf, metallic), each with its own film
// (KHR_materials_iridescence). 4000 points of the sequence are within 0.005; under these films, the
// mean over 8 angles makes up to 0.6% of light (two Gauss nodes: 5%). F0 mixed before the film was
// off by 0.75.
TEST(Bsdf, FilmsOverHalfMetalsAreMixturesOfBothFilms) {
  constexpr int kCount = 4000;
  for (const FilmCase& film : films({0.0F, 0.05F, 0.5F})) {
    for (const double degrees : {0.0, 40.0, 70.0}) {
      const auto seen = [&](float metallic, core::Rgb color) {
        return sampled_color(film.seen_from(degrees, {.base_color = color, .metallic = metallic}),
                             kCount);
      };
      for (const core::Rgb color : {core::Rgb(1), core::Rgb{1, 0.766F, 0.336F}}) {
        const core::Rgb ends[] = {seen(0, color), seen(1, color)};
        for (const float metallic : {0.0F, 0.25F, 0.5F, 1.0F}) {
          const core::Rgb mixed = seen(metallic, color);
          for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(mixed[c], core::lerp(ends[0][c], ends[1][c], metallic), 0.005F)
                << film.ior << " " << film.thickness_nm << " " << film.roughness << " " << degrees
                << " " << metallic;
            EXPECT_LE(mixed[c], 1.006F) << film.ior << " " << film.thickness_nm << " "
                                        << film.roughness << " " << degrees << " " << metallic;
          }
        }
      }
    }
  }
}

// From within, too, where the film is not seen under total reflection. Rough solids gain up to 1.7%
// under these films, as their loss between facets is estimated (as if without a film: 6%).
TEST(Bsdf, FilmsOverSolidsMakeNoLight) {
  for (const FilmCase& film : films({0.0F, 0.2F, 0.8F, 1.0F})) {
    for (const bool inside : {false, true}) {
      for (const double degrees : {0.0, 40.0, 70.0, 80.0}) {
        const core::BsdfParameters p = {.transmission = 1, .thin = false, .inside = inside};
        const core::Rgb seen = sampled_color(film.seen_from(degrees, p), 4000);
        const float error = film.roughness > 0 ? 0.018F : 1e-5F;
        EXPECT_LE(core::max_component(seen), 1 + error)
            << film.ior << " " << film.thickness_nm << " " << film.roughness << " " << inside << " "
            << degrees;
        if (!(film.roughness > 0) && inside && degrees > 41.8) {  // the critical angle of 1.5
          EXPECT_EQ(seen, core::Rgb(1)) << degrees;
        }
      }
    }
  }
}

core::BsdfParameters brushed_metal(float roughness, float strength) {
  core::BsdfParameters p;
  p.metallic = 1;
  p.roughness = roughness;
  p.alpha_y = std::max(roughness * roughness, 1e-4F);
  p.alpha_x = core::lerp(p.alpha_y, 1.0F, strength * strength);
  return p;
}

/// Across the wide axis at phi = 90.
Vec3 direction(double degrees, double phi_degrees) {
  const double phi = phi_degrees * std::numbers::pi / 180;
  const Vec3 w = test_support::direction(degrees);
  const double sine = std::hypot(static_cast<double>(w.x), static_cast<double>(w.y));
  return {static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)), w.z};
}

// KHR_materials_anisotropy. The tables are within 0.007 of the albedo (numerical integration at 300
// random places), the sequence within 0.005 for narrow lobes.
TEST(Bsdf, AnisotropicMetalGainsNoEnergy) {
  constexpr double kTolerance = 0.012;
  for (const float strength : {0.2F, 0.5F, 0.8F, 1.0F}) {
    for (const float roughness : {0.0F, 0.1F, 0.2F, 0.4F, 0.6F, 0.9F}) {
      for (const double degrees : {0.0, 40.0, 70.0, 85.0}) {
        for (const double phi : {0.0, 45.0, 80.0, 90.0}) {
          const Vec3 wo = direction(degrees, phi);
          const double albedo =
              sampled_albedo(Bsdf(brushed_metal(roughness, strength), wo, {0, 0, 1}), 30000);
          EXPECT_LE(albedo, 1 + kTolerance)
              << strength << " " << roughness << " " << degrees << " " << phi;
          if (degrees <= 70) {  // narrow lobes lose up to 0.04 at 85 degrees
            EXPECT_GE(albedo, 1 - kTolerance)
                << strength << " " << roughness << " " << degrees << " " << phi;
          }
        }
      }
    }
  }
  // The planted fault: multiple scattering by the albedo of an isotropic lobe of the same mean
  // square width.
  const Vec3 wo = direction(70, 0);
  const core::BsdfParameters p = brushed_metal(0.1F, 1);
  const float mean = std::sqrt(std::sqrt(0.5F * (p.alpha_x * p.alpha_x + p.alpha_y * p.alpha_y)));
  EXPECT_GT(core::Anisotropy(p.alpha_x, p.alpha_y).albedo(wo).e,
            core::specular_albedo(wo.z, mean).e + 2 * static_cast<float>(kTolerance));
}

TEST(Bsdf, BlackScattersNothing) {
  const Bsdf bsdf({.base_color = {0, 0, 0}, .f0 = {0, 0, 0}, .f90 = 0}, test_support::direction(30),
                  {0, 0, 1});
  EXPECT_FALSE(bsdf.has_spread());
  EXPECT_TRUE(core::is_black(bsdf.sample(0.5F, {0.5F, 0.5F}).weight));
}

}  // namespace
