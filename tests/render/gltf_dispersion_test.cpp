// Dispersion in glTF, by KHR_materials_dispersion and by curves in extras: indices by wavelength
// and the resulting angles. The false alarm rate of each z-test is that of 4.5 standard deviations,
// 7e-6.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/color/ior_curve.h"
#include "core/color/wavelength.h"
#include "core/color/wavelengths.h"
#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::glass;
using test_support::Picture;
using test_support::pixel;

constexpr double kPi = 3.14159265358979323846;
constexpr double kSigmas = 4.5;

double fresnel(double cos_i, double eta) {
  const double cos_t = std::sqrt(1 - (1 - cos_i * cos_i) / (eta * eta));
  const double a = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  const double b = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return 0.5 * (a * a + b * b);
}

TEST(GltfDispersion, WavelengthWeightsAreBoundedAndAverageToWhite) {
  double mean[3] = {};
  constexpr int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) {
    const auto sample = core::sample_wavelength((static_cast<float>(i) + 0.5F) / kSteps);
    for (int c = 0; c < 3; ++c) {
      EXPECT_GT(sample.weight[c], -1.01F);
      EXPECT_LT(sample.weight[c], 3.93F);
      mean[c] += static_cast<double>(sample.weight[c]) / kSteps;
    }
  }
  for (const double m : mean) {
    EXPECT_NEAR(m, 1, 1e-3);
  }
}

TEST(GltfDispersion, ReflectionHasNoColorNoise) {
  // A dispersive surface over black: each channel reflects the mean of the Fresnel reflectance over
  // its wavelengths. If reflection also had the weight of the wavelength, the channels of a pixel
  // would differ by their own magnitude.
  core::MaterialDescription m = glass(1.5F, 1);
  m.dispersion = 1;
  core::SceneDescription scene = test_support::stage(m);
  core::MaterialDescription black;
  black.unlit = true;
  black.base_color = {0, 0, 0};
  scene.materials.push_back(black);
  scene.meshes[0].primitives.push_back(test_support::patch(-0.5F, 1));
  const Picture picture = test_support::shoot_glb(
      scene, {.samples = 1024, .depth = 2, .sky = test_support::constant_sky({1, 1, 1})});
  double expected[3] = {};
  constexpr int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) {
    const auto sample = core::sample_wavelength((static_cast<float>(i) + 0.5F) / kSteps);
    const double f =
        fresnel(1, static_cast<double>(core::dispersive_ior(1.5F, 1, sample.wavelength_nm)));
    for (int c = 0; c < 3; ++c) {
      expected[c] += static_cast<double>(sample.weight[c]) * f / kSteps;
    }
  }
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(static_cast<double>(picture.mean()[c]), expected[c],
                kSigmas * static_cast<double>(picture.standard_error()[c]) + 2e-5)
        << c;
    const Rgb one = pixel(picture, 3, 5);
    EXPECT_NEAR(one[c] / one.g, expected[c] / expected[1], 0.01) << c;
  }
}

/// N-BK7, a crown glass, in each form in which a material can state its dispersion.
struct Bk7 {
  const char* name;
  bool is_spectral;                   ///< setting of the job
  float dispersion;                   ///< of KHR_materials_dispersion
  core::IorCurve curve;               ///< of extras
  double (*index)(double square_um);  ///< the same formula, as a function of the squared wavelength
};

/// KHR_materials_dispersion: Cauchy's A + B / l^2 through n_d and V_d.
double index_by_abbe(double square) {
  return 1.5168 + 0.5168 / 64.17 * (0.523655 / square - 1.5168);
}
double index_by_cauchy(double square) { return 1.504584 + 0.004217 / square; }
double index_by_sellmeier(double square) {
  return std::sqrt(1 + 1.03961212 * square / (square - 0.00600069867) +
                   0.231792344 * square / (square - 0.0200179144) +
                   1.01046945 * square / (square - 103.560653));
}

constexpr float kBk7Index = 1.5168F;
constexpr float kBk7Dispersion = 20 / 64.17F;
/// Cauchy's coefficients follow from n_d = 1.5168 and V_d = 64.17; Sellmeier's are from Schott's
/// data sheet.
constexpr core::IorCurve kCauchy = {core::IorFormula::kCauchy, {1.504584F, 0.004217F, 0}, {}};
constexpr core::IorCurve kSellmeier = {core::IorFormula::kSellmeier,
                                       {1.03961212F, 0.231792344F, 1.01046945F},
                                       {0.00600069867F, 0.0200179144F, 103.560653F}};

const Bk7 kGlasses[] = {{"Rgb", false, kBk7Dispersion, {}, index_by_abbe},
                        {"Abbe", true, kBk7Dispersion, {}, index_by_abbe},
                        {"Cauchy", true, 0, kCauchy, index_by_cauchy},
                        {"Sellmeier", true, 0, kSellmeier, index_by_sellmeier}};

core::MaterialDescription material_of(const Bk7& bk7) {
  core::MaterialDescription m = glass(kBk7Index, 1);
  m.dispersion = bk7.dispersion;
  m.ior_curve = bk7.curve;
  return m;
}

double index_at(const Bk7& bk7, float nm) {
  const double um = static_cast<double>(nm) / 1000;
  return bk7.index(um * um);
}

/// Minimum deviation of a prism of 60 degrees.
double deviation_degrees(double index) {
  return (2 * std::asin(index * 0.5) - kPi / 3) * 180 / kPi;
}

constexpr std::array kLines = {core::kLineFNm, core::kLineDNm, core::kLineCNm};

TEST(GltfDispersion, IndicesGiveTheMinimumDeviationsOfABk7Prism) {
  const double degrees[3] = {39.1384, 38.6467, 38.4289};  // truth 15: F, d, C
  for (const Bk7& bk7 : kGlasses) {
    for (std::size_t i = 0; i < kLines.size(); ++i) {
      const float n = bk7.curve.is_known()
                          ? bk7.curve.at(kLines[i])
                          : core::dispersive_ior(kBk7Index, kBk7Dispersion, kLines[i]);
      EXPECT_NEAR(deviation_degrees(static_cast<double>(n)), degrees[i], 0.01) << bk7.name;
      // 1e-6: ten steps of a float.
      EXPECT_NEAR(static_cast<double>(n), index_at(bk7, kLines[i]), 1e-6) << bk7.name;
      // The planted fault: an index wrong by 2e-4.
      EXPECT_GT(std::fabs(deviation_degrees(static_cast<double>(n) + 2e-4) - degrees[i]), 0.01);
    }
  }
}

TEST(GltfDispersion, SellmeierIndicesMatchTheDataSheet) {
  const float sheet[3] = {1.52238F, 1.51680F, 1.51432F};  // n_F, n_d, n_C
  for (std::size_t i = 0; i < kLines.size(); ++i) {
    EXPECT_NEAR(kSellmeier.at(kLines[i]), sheet[i], 6e-6F);  // rounded to five decimals
  }
}

/// A prism of 60 degrees, its edge along y, hit by a thin beam of camera rays along -z at the
/// incidence of minimum deviation. A bright wall far away starts at the direction of that light and
/// covers greater deviations (shorter wavelengths).
core::SceneDescription prism(const core::MaterialDescription& m, double deviation) {
  const double first = deviation * kPi / 180;
  const double incidence = (first + kPi / 3) / 2;
  // In the prism's frame the first face's normal points to -x, rotated up by 30 degrees: faces that
  // form 60 degrees meet at the top. Directions are angles in the x-z plane, measured from -z
  // towards +x.
  const auto direction = [](double angle) {
    return Vec3{static_cast<float>(std::sin(angle)), 0, static_cast<float>(-std::cos(angle))};
  };
  // The beam travels along angle 0. The outward normal of face 1 makes the angle `incidence` with
  // the reverse direction (+z); the base is on the +x side, towards which light is deviated.
  const double normal1 = kPi + incidence;  // angle of the outward normal of face 1
  const double normal2 =
      normal1 + kPi - kPi / 3;  // outward normals of faces at 60 degrees differ by 120
  const Vec3 n1 = direction(normal1);
  const Vec3 n2 = direction(normal2);
  // Corners: the edge E where the faces meet, and 1 m along each face away from it.
  const auto along = [](Vec3 n, double sign) {
    return Vec3{static_cast<float>(sign) * n.z, 0, static_cast<float>(-sign) * n.x};
  };
  Vec3 d1 = along(n1, 1);
  Vec3 d2 = along(n2, 1);
  d1 = core::dot(d1, n2) < 0 ? d1 : -d1;  // face 1 is behind face 2, and vice versa
  d2 = core::dot(d2, n1) < 0 ? d2 : -d2;
  const Vec3 edge = d1 * -0.5F;  // the beam hits face 1 halfway down
  const Vec3 corner1 = edge + d1;
  const Vec3 corner2 = edge + d2;
  const auto face = [](Vec3 a, Vec3 b, Vec3 outward, int material) {
    core::PrimitiveDescription p = test_support::quad({a.x, -1, a.z}, b - a, {0, 2, 0}, material);
    const Vec3 n = core::cross(b - a, {0, 2, 0});
    if (core::dot(n, outward) < 0) {
      std::swap(p.indices[1], p.indices[2]);
      std::swap(p.indices[4], p.indices[5]);
    }
    return p;
  };
  constexpr float kFar = 1e6F;  // light exits the prism 0.2 m off the centre: 1e-5 degrees
  const Vec3 near_edge = direction(first) * kFar;
  const Vec3 far_edge = direction(first + 0.05) * kFar;
  core::PrimitiveDescription wall = test_support::quad({near_edge.x, -kFar, near_edge.z},
                                                       far_edge - near_edge, {0, 2 * kFar, 0}, 1);
  core::MaterialDescription bright;
  bright.unlit = true;
  bright.double_sided = true;
  const Vec3 base_normal = core::normalize((n1 + n2) * -1.0F);
  core::SceneDescription scene =
      test_support::scene_of({m, bright}, {face(edge, corner1, n1, 0), face(edge, corner2, n2, 0),
                                           face(corner1, corner2, base_normal, 0), wall});
  core::CameraDescription beam = test_support::front_camera(1e-4F);
  scene.cameras.push_back(beam);
  return scene;
}

/// Light with wavelengths below `edge_nm` that passes the prism, by colour: (1 - F)^2 for the two
/// faces.
std::array<double, 3> light_below(const Bk7& bk7, float edge_nm) {
  const double incidence = std::asin(index_at(bk7, edge_nm) * 0.5);
  std::array<double, 3> sum{};
  constexpr int kSteps = 50'000;
  const auto add = [&](float nm, Rgb color) {
    if (!(nm < edge_nm)) {
      return;
    }
    const double n = index_at(bk7, nm);
    const double inside1 = std::asin(std::sin(incidence) / n);
    const double out = std::asin(n * std::sin(kPi / 3 - inside1));
    const double share = (1 - fresnel(std::cos(incidence), n)) * (1 - fresnel(std::cos(out), n));
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += static_cast<double>(color[static_cast<int>(c)]) * share / kSteps;
    }
  };
  for (int i = 0; i < kSteps; ++i) {
    const float u = (static_cast<float>(i) + 0.5F) / kSteps;
    if (!bk7.is_spectral) {
      const auto sample = core::sample_wavelength(u);
      add(sample.wavelength_nm, sample.weight);
      continue;
    }
    const core::Wavelengths at(u);
    add(at.nm().r, at.color({1, 0, 0}));
    add(at.nm().g, at.color({0, 1, 0}));
    add(at.nm().b, at.color({0, 0, 1}));
  }
  return sum;
}

/// The largest difference between channels, in standard errors. 1e-4: of the sum in light_below(),
/// of which one step in 50,000 is a weight of at most 4 over that.
double largest_z(const Picture& picture, const std::array<double, 3>& expected) {
  double z = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto error = static_cast<double>(picture.standard_error()[static_cast<int>(c)]);
    const auto mean = static_cast<double>(picture.mean()[static_cast<int>(c)]);
    z = std::max(z, (std::fabs(mean - expected[c]) - 1e-4) / error);
  }
  return z;
}

class Prism : public testing::TestWithParam<Bk7> {};

TEST_P(Prism, RefractsEachLineAccordingToSnell) {
  const Bk7& bk7 = GetParam();
  for (const float line_nm : kLines) {
    const double deviation = deviation_degrees(index_at(bk7, line_nm));
    const auto expected = light_below(bk7, line_nm);
    const auto z = [&](double degrees) {
      return largest_z(
          test_support::shoot_glb(prism(material_of(bk7), degrees),
                                  {.samples = 4096, .depth = 2, .spectral = bk7.is_spectral}),
          expected);
    };
    EXPECT_LT(z(deviation), kSigmas) << line_nm;
    EXPECT_GT(z(deviation + 0.01), kSigmas) << line_nm;  // the planted fault
  }
}

INSTANTIATE_TEST_SUITE_P(GltfDispersion, Prism, testing::ValuesIn(kGlasses),
                         [](const auto& each) { return std::string(each.param.name); });

/// Mean of the image of a slab 1 m thick, seen at 45 degrees, under a white sky.
Picture slab_under_white_sky(const core::MaterialDescription& m, bool is_spectral, int samples) {
  constexpr float kHalf = 200;
  core::SceneDescription scene = test_support::scene_of(
      {m}, {test_support::quad({-kHalf, 0, kHalf}, {2 * kHalf, 0, 0}, {0, 0, -2 * kHalf}, 0),
            test_support::quad({-kHalf, -1, -kHalf}, {2 * kHalf, 0, 0}, {0, 0, 2 * kHalf}, 0)});
  scene = test_support::load(core::write_glb(scene));
  core::View view = test_support::view_of(std::move(scene), 8, 8);
  test_support::look_at(view, {0, 5, 5}, {0, 0, 0}, 10);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 64;
  view.settings.spectral = is_spectral;
  return test_support::render(view, samples);
}

TEST(GltfDispersion, AWhiteSlabStaysWhite) {
  constexpr float kShare = 2e-3F;  // truth 15; more than four standard errors, false alarm 6e-5
  constexpr int kSamples = 16'384;
  for (const Bk7& bk7 : kGlasses) {
    const Picture picture = slab_under_white_sky(material_of(bk7), bk7.is_spectral, kSamples);
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(4 * picture.standard_error()[c], kShare) << bk7.name;
      EXPECT_NEAR(picture.mean()[c], 1, kShare) << bk7.name;
    }
  }
  // The planted fault: a tint of 8 parts in a thousand.
  core::MaterialDescription tinted = material_of(kGlasses[3]);
  tinted.attenuation_color = {1, 0.992F, 1};
  tinted.attenuation_distance = 1;
  EXPECT_GT(std::fabs(slab_under_white_sky(tinted, true, kSamples).mean().g - 1), kShare);
}

TEST(GltfDispersion, CurveUsesItsDLineIndexWithoutWavelengths) {
  const Bk7& bk7 = kGlasses[3];
  core::MaterialDescription plain = material_of(bk7);
  plain.ior_curve = {};
  plain.ior = bk7.curve.at(core::kLineDNm);
  core::MaterialDescription curve = material_of(bk7);
  const auto digest = [](const core::MaterialDescription& m, bool is_spectral) {
    return slab_under_white_sky(m, is_spectral, 64).film->digest();
  };
  EXPECT_EQ(digest(curve, false), digest(plain, false));
  EXPECT_NE(digest(curve, true), digest(plain, true));  // the planted fault
}

}  // namespace
