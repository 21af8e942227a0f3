// Colours as spectra: round trips, bounds, densities; BSDFs of three wavelengths against BSDFs of
// one. z-tests have a limit of 4.5 standard deviations, a false alarm rate of 7e-6 each.
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/bsdf/spectral_bsdf.h"
#include "core/bsdf/thin_film.h"
#include "core/color/cie_data.h"
#include "core/color/wavelengths.h"

namespace {

using core::Rgb;
using core::Vec3;
using core::Wavelengths;

constexpr std::array<Rgb, 7> kColors = {
    Rgb{1, 1, 1},          Rgb{1, 0, 0},       Rgb{0, 1, 0},           Rgb{0, 0, 1},
    Rgb{0.8F, 0.4F, 0.1F}, Rgb{0, 0.7F, 0.9F}, Rgb{0.02F, 0.02F, 0.5F}};

/// The colour of a colour's spectrum; shift: plants an error in u.
Rgb round_trip(Rgb color, float shift = 0) {
  constexpr int kSteps = 10'000;
  std::array<double, 3> sum{};
  for (int i = 0; i < kSteps; ++i) {
    const float u = (static_cast<float>(i) + 0.5F) / kSteps;
    const Rgb one = Wavelengths(u).color(Wavelengths(std::min(u + shift, 0.9999F)).values(color));
    for (int c = 0; c < 3; ++c) {
      sum[static_cast<std::size_t>(c)] += static_cast<double>(one[c]) / kSteps;
    }
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

TEST(Wavelengths, ColorRoundTripsThroughItsSpectrum) {
  for (const Rgb& color : kColors) {
    const Rgb back = round_trip(color);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(back[c], color[c], 1e-5F);
    }
  }
}

// The planted fault: spectra shifted by a few nanometres.
TEST(Wavelengths, DetectsAShiftedSpectrum) {
  EXPECT_GT(std::fabs(round_trip({1, 0, 0}, 0.02F).g), 1e-3F);
}

TEST(Wavelengths, WhiteIsFlatAndReflectancesAreWithinZeroAndOne) {
  for (int i = 0; i < 1000; ++i) {
    const Wavelengths at(static_cast<float>(i) / 1000);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(at.values({1, 1, 1})[k], 1, 5e-7F);
      for (const Rgb& color : kColors) {
        EXPECT_GE(at.values(color)[k], 0);
        EXPECT_LE(at.values(color)[k], 1 + 5e-7F);
      }
    }
  }
}

TEST(Wavelengths, AreSampledFromEachThirdOfTheDistribution) {
  float longest = 781;
  for (int k = 0; k < 3; ++k) {
    for (int i = 999; i >= 0; --i) {
      const float nm = Wavelengths(static_cast<float>(i) / 1000).nm()[k];
      EXPECT_LE(nm, longest);
      longest = nm;
    }
  }
  EXPECT_GE(longest, 380);
}

TEST(Wavelengths, HaveWeightsOfAtMostFour) {
  // The bound given by the density: the integral of the length of the colours, which is 3.6.
  for (int i = 0; i < 1000; ++i) {
    const Wavelengths at(static_cast<float>(i) / 1000);
    for (const Rgb& one : {Rgb{3, 0, 0}, Rgb{0, 3, 0}, Rgb{0, 0, 3}}) {
      const Rgb color = at.color(one);
      EXPECT_LT(std::hypot(color.r, color.g, color.b), 4);
    }
  }
}

TEST(CieTables, D65HasItsChromaticity) {
  double x = 0;
  double y = 0;
  double z = 0;
  for (const core::CieRow& row : core::kCieRows) {
    x += static_cast<double>(row.x * row.d65);
    y += static_cast<double>(row.y * row.d65);
    z += static_cast<double>(row.z * row.d65);
  }
  // CIE 15:2004, table 1, 2 degree observer.
  EXPECT_NEAR(x / (x + y + z), 0.31272, 2e-5);
  EXPECT_NEAR(y / (x + y + z), 0.32903, 2e-5);
}

TEST(ThinFilm, AtWavelengthsIsTheAirySum) {
  // At normal incidence Schlick's curve is exact, and therefore the sum.
  for (const float thickness : {150.0F, 400.0F, 900.0F}) {
    const Rgb nm = {640, 550, 450};
    const Rgb seen = core::thin_film_fresnel(1, 1.3F, thickness, Rgb(0.04F), nm);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(static_cast<double>(seen[c]),
                  core::airy_reflectance(1, 1, 1.3, 1.5, static_cast<double>(thickness),
                                         static_cast<double>(nm[c])),
                  2e-5)
          << thickness << " nm, channel " << c;
    }
  }
}

constexpr int kDraws = 30'000;

/// Incident radiance by direction: any asymmetric function.
float worth(Vec3 wi) { return (wi.z > 0 ? 1.0F : 1.7F) * (1.2F + wi.x); }

struct Boundary {
  float roughness;
  bool inside;
};

core::BsdfParameters glass(const Boundary& boundary) {
  core::BsdfParameters p;
  p.base_color = {0.9F, 0.8F, 0.7F};
  p.transmission = 1;
  p.thin = false;
  p.inside = boundary.inside;
  p.roughness = boundary.roughness;
  p.alpha_x = p.alpha_y = std::max(boundary.roughness * boundary.roughness, 1e-4F);
  return p;
}

const Rgb kIors = {1.4F, 1.6F, 1.9F};
const Vec3 kWo = core::normalize({0.45F, 0, 0.9F});

class Draws {
 public:
  float next() { return uniform_(engine_); }

 private:
  std::mt19937 engine_{7};
  std::uniform_real_distribution<float> uniform_{0, 1};
};

struct Estimate {
  std::array<double, 3> mean{};
  std::array<double, 3> variance{};  ///< of the mean
};

/// sample(draws): radiance at each wavelength.
template <typename Sample>
Estimate estimate(Sample&& sample) {
  Draws draws;
  Estimate out;
  std::array<double, 3> squares{};
  for (int i = 0; i < kDraws; ++i) {
    const Rgb value = sample(draws);
    for (int c = 0; c < 3; ++c) {
      const auto v = static_cast<double>(value[c]);
      out.mean[static_cast<std::size_t>(c)] += v / kDraws;
      squares[static_cast<std::size_t>(c)] += v * v / kDraws;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    out.variance[c] = (squares[c] - out.mean[c] * out.mean[c]) / kDraws;
  }
  return out;
}

Rgb brought(const core::BsdfSample& s) { return s.weight * worth(s.wi_local); }

/// Samples three wavelengths together. bend: factor of the number that selects the lobe; 1 is
/// correct.
Estimate together(const Boundary& boundary, float bend) {
  return estimate([&](Draws& draws) {
    const float u = std::pow(draws.next(), bend);
    const core::SpectralBsdf bsdf(glass(boundary), kWo, {0, 0, 1}, nullptr,
                                  {.ior = kIors, .prob = {0.5F, 0.3F, 0.2F}, .u_pick = u});
    const float lobe = draws.next();
    const float x = draws.next();
    return brought(bsdf.sample(lobe, {x, draws.next()}));
  });
}

/// Samples each wavelength separately.
Estimate alone(const Boundary& boundary) {
  Estimate all;
  for (int c = 0; c < 3; ++c) {
    core::BsdfParameters p = glass(boundary);
    p.ior = kIors[c];
    const core::Bsdf bsdf(p, kWo, {0, 0, 1});
    const Estimate one = estimate([&](Draws& draws) {
      const float lobe = draws.next();
      const float x = draws.next();
      return brought(bsdf.sample(lobe, {x, draws.next()}));
    });
    const auto i = static_cast<std::size_t>(c);
    all.mean[i] = one.mean[i];
    all.variance[i] = one.variance[i];
  }
  return all;
}

double largest_z(const Estimate& a, const Estimate& b) {
  double z = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    z = std::max(z, std::fabs(a.mean[c] - b.mean[c]) / std::sqrt(a.variance[c] + b.variance[c]));
  }
  return z;
}

class SpectralBoundary : public testing::TestWithParam<Boundary> {};

TEST_P(SpectralBoundary, EachWavelengthGetsTheRadianceOfItsOwnBsdf) {
  EXPECT_LT(largest_z(together(GetParam(), 1), alone(GetParam())), 4.5);
}

TEST_P(SpectralBoundary, DetectsWrongLobeProbabilities) {
  EXPECT_GT(largest_z(together(GetParam(), 1.5F), alone(GetParam())), 4.5);
}

TEST_P(SpectralBoundary, EvaluateMatchesSample) {
  Draws draws;
  for (int i = 0; i < 200; ++i) {
    const core::SpectralBsdf bsdf(
        glass(GetParam()), kWo, {0, 0, 1}, nullptr,
        {.ior = kIors, .prob = {0.5F, 0.3F, 0.2F}, .u_pick = draws.next()});
    const float lobe = draws.next();
    const core::BsdfSample s = bsdf.sample(lobe, {draws.next(), draws.next()});
    if (s.is_delta || !(s.pdf_solid_angle > 0)) {
      continue;
    }
    const core::BsdfEval eval = bsdf.evaluate(s.wi_local);
    EXPECT_EQ(eval.pdf_solid_angle, s.pdf_solid_angle);
    EXPECT_FLOAT_EQ(eval.value_cos.g, s.weight.g * s.pdf_solid_angle);
  }
}

INSTANTIATE_TEST_SUITE_P(Glass, SpectralBoundary,
                         testing::Values(Boundary{0, false}, Boundary{0, true},
                                         Boundary{0.5F, false}, Boundary{0.5F, true}));

TEST(SpectralBsdf, SmoothBoundaryRefractsOneWavelengthAndReflectsAll) {
  const core::SpectralBsdf bsdf(glass({0, false}), kWo, {0, 0, 1}, nullptr,
                                {.ior = kIors, .prob = {0.5F, 0.3F, 0.2F}, .u_pick = 0.6F});
  const core::BsdfSample reflected = bsdf.sample(0, {0.5F, 0.5F});
  EXPECT_GT(reflected.wi_local.z, 0);
  EXPECT_GT(std::min({reflected.weight.r, reflected.weight.g, reflected.weight.b}), 0);
  const core::BsdfSample refracted = bsdf.sample(0.99F, {0.5F, 0.5F});
  // Snell's law of the selected wavelength
  EXPECT_NEAR(-refracted.wi_local.x * 1.6F, kWo.x, 1e-5F);
  EXPECT_EQ(refracted.weight.r, 0);
  EXPECT_GT(refracted.weight.g, 0);
  EXPECT_EQ(refracted.weight.b, 0);
}

}  // namespace
