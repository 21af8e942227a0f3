// Lane functions against the scalar code.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/lane_math.h"
#include "core/samplers/path_sampler.h"
#include "core/samplers/sobol.h"
#include "core/settings/choices.h"
#include "core/wave/lane_camera.h"
#include "core/wave/lane_maps.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/scenes.h"

namespace {

using core::Floats;
using core::Rgb;
using core::Vec3;

TEST(WaveLanes, DrawTheNumbersOfTheScalarSampler) {
  alignas(32) std::array<std::uint64_t, 8> base{};
  alignas(32) std::array<std::uint32_t, 8> index{};
  std::vector<core::PathSampler> samplers(8, {core::SamplerType::kSobol, 2, 7});
  for (std::size_t k = 0; k < 8; ++k) {
    samplers[k].start(static_cast<int>(3 * k), 5, static_cast<int>(29 * k));
    base[k] = samplers[k].base();
    index[k] = core::reverse_bits(samplers[k].index());
  }
  for (int group = 0; group < 40; ++group) {
    const auto eight = core::sobol_numbers<8>(
        core::Hashes<8>::load(base.data()), core::load<8>(index.data()), group, core::Drawn::kAll);
    for (std::size_t k = 0; k < 8; ++k) {
      const auto one = core::sobol_numbers<1>(core::Hashes<1>::load(&base[k]),
                                              core::load<1>(&index[k]), group, core::Drawn::kAll);
      const core::Vec4 u = samplers[k].get_4d(group);
      EXPECT_TRUE(eight.x.v[k] == u.x && eight.y.v[k] == u.y && eight.z.v[k] == u.z &&
                  eight.w.v[k] == u.w);
      EXPECT_TRUE(one.x.v[0] == u.x && one.y.v[0] == u.y && one.z.v[0] == u.z && one.w.v[0] == u.w);
    }
  }
}

TEST(WaveLanes, DrawAPairAsTheFirstTwoDimensionsOfFour) {
  alignas(32) std::array<std::uint64_t, 8> base{};
  alignas(32) std::array<std::uint32_t, 8> index{};
  for (std::size_t k = 0; k < 8; ++k) {
    base[k] = core::mix_bits(k);
    index[k] = core::reverse_bits(static_cast<std::uint32_t>(0x9e3779b9U * k));
  }
  const auto h = core::Hashes<8>::load(base.data());
  const auto at = core::load<8>(index.data());
  for (int group = 0; group < 40; ++group) {
    const auto all = core::sobol_numbers<8>(h, at, group, core::Drawn::kAll);
    const auto pair = core::sobol_numbers<8>(h, at, group, core::Drawn::kPair);
    const bool is_of_bsdf = core::is_of_bsdf(group);
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_EQ(pair.y.v[k], all.y.v[k]);
      EXPECT_EQ(is_of_bsdf ? pair.z.v[k] : pair.x.v[k], is_of_bsdf ? all.z.v[k] : all.x.v[k]);
    }
  }
}

TEST(WaveLanes, SineAndCosineErrByLessThanTwoInTenMillion) {
  double worst = 0;
  for (int i = -100'000; i <= 100'000; ++i) {
    const float x = static_cast<float>(i) * (6.2831853F / 100'000);
    Floats<8> sine;
    Floats<8> cosine;
    core::sincos(Floats<8>(x), sine, cosine);
    const auto exact = static_cast<double>(x);
    worst = std::max({worst, std::fabs(static_cast<double>(sine.v[3]) - std::sin(exact)),
                      std::fabs(static_cast<double>(cosine.v[6]) - std::cos(exact))});
  }
  EXPECT_LT(worst, 2e-7);
}

TEST(WaveLanes, LogarithmsErrByLessThanThreeInTenMillion) {
  double worst = 0;
  for (int i = 0; i <= 200'000; ++i) {
    const float x = std::exp2(static_cast<float>(i) * (60.0F / 200'000) - 30);
    const double exact = std::log2(static_cast<double>(x));
    const double found = static_cast<double>(core::log2(Floats<8>(x)).v[5]);
    worst = std::max(worst, std::fabs(found - exact) / (1 + std::fabs(exact)));
  }
  EXPECT_LT(worst, 3e-7);
}

TEST(WaveLanes, PowersOfTwoErrByLessThanTwoInTenMillion) {
  double worst = 0;
  for (int i = 0; i <= 200'000; ++i) {
    const float x = static_cast<float>(i) * (250.0F / 200'000) - 125;
    const double exact = std::exp2(static_cast<double>(x));
    const double found = static_cast<double>(core::exp2(Floats<8>(x)).v[5]);
    worst = std::max(worst, std::fabs(found / exact - 1));
  }
  EXPECT_LT(worst, 2e-7);
}

TEST(WaveLanes, PowersOfZeroAreBelowAnyNormalNumberButTheLeast) {
  EXPECT_LE(core::pow(Floats<8>(0), Floats<8>(3)).v[1], 0x1p-126F);
  EXPECT_EQ(core::pow(Floats<8>(0), Floats<8>(0)).v[1], 1);
}

TEST(WaveLanes, AnglesOfDirectionsErrByLessThanFourInTenMillion) {
  double worst = 0;
  for (int i = -50'000; i <= 50'000; ++i) {
    const double angle = i * (3.14159265358979 / 50'000);
    const auto y = static_cast<float>(0.7 * std::sin(angle));
    const auto x = static_cast<float>(0.7 * std::cos(angle));
    const double exact = std::atan2(static_cast<double>(y), static_cast<double>(x));
    const auto found = static_cast<double>(core::atan2(Floats<8>(y), Floats<8>(x)).v[5]);
    worst = std::max(worst, std::fabs(found - exact));
  }
  EXPECT_LT(worst, 4e-7);
  EXPECT_EQ(core::atan2(Floats<8>(0.0F), Floats<8>(0.0F)).v[0], 0.0F);
}

/// The largest difference between lanes and the scalar code, over 8,000 directions of a rotated
/// map.
float worst_of_sky(bool is_background) {
  const auto sky = test_support::sky_map(
      32, 16,
      [](int x, int y) {
        return Rgb{static_cast<float>(x), static_cast<float>(y), 1};
      },
      37);
  const core::EnvironmentMap map = sky->map();
  test_support::Random random(3);
  float worst = 0;
  for (int round = 0; round < 1000; ++round) {
    core::Vec3s<8> d;
    for (std::size_t k = 0; k < 8; ++k) {
      const float sign = random.uniform() < 0.5F ? -1.0F : 1.0F;
      d.set(k, test_support::random_hemisphere(random) * sign);
    }
    const auto at = map.point(d);
    const auto found = is_background ? map.background(at) : map.radiance(at);
    for (std::size_t k = 0; k < 8; ++k) {
      const Rgb exact = is_background ? sky->background(d.lane(k)) : sky->radiance(d.lane(k));
      worst = std::max(
          {worst, std::fabs(found.lane(k).x - exact.r), std::fabs(found.lane(k).y - exact.g)});
      const core::MapPoint<float> point = {at.u.v[k], at.v.v[k], at.sin_theta.v[k]};
      for (const auto density : {core::SkyDensity::kRadiance, core::SkyDensity::kCompensated}) {
        EXPECT_NEAR(sky->pdf_solid_angle(d.lane(k), point, density),
                    sky->pdf_solid_angle(d.lane(k), density), 1e-3F);
      }
    }
  }
  return worst;
}

TEST(WaveLanes, SampleTheSkyLikeTheScalarCode) {
  EXPECT_LT(worst_of_sky(true), 1e-3F);
  EXPECT_LE(worst_of_sky(false), 1e-3F);
}

/// Each type of camera, with each of what it may have: a lens, a distortion.
std::vector<core::CameraSettings> every_camera() {
  std::vector<core::CameraSettings> all;
  for (const auto& row : core::camera_types()) {
    core::CameraSettings settings;
    settings.type = row.value;
    settings.position = Vec3{1, 2, 3};
    settings.target = Vec3{0.2F, 0.1F, 0};
    if (row.value != core::CameraType::kPinhole) {
      all.push_back(settings);
      if (row.value == core::CameraType::kPerspective) {
        all.push_back(settings);
        all.back().aperture_radius_m = 0.1F;
        all.back().focus_distance_m = 2;
      }
      continue;
    }
    settings.fx_px = 50;
    settings.cx_px = 20;
    for (const auto& model : core::distortion_models()) {
      all.push_back(settings);
      if (model.value != core::DistortionModel::kNone) {
        all.back().distortion = {model.value, {-0.05, 0.01, 0.002, -0.001}};
      }
    }
  }
  return all;
}

TEST(WaveLanes, StartTheRaysOfEveryCamera) {
  const std::vector<core::CameraSettings> cameras = every_camera();
  EXPECT_GE(cameras.size(), 7U);
  for (const core::CameraSettings& settings : cameras) {
    for (const auto filter : {core::FilterType::kBox, core::FilterType::kMitchell}) {
      const auto camera = core::Camera::create(settings, {}, {{-1, -1, -1}, {1, 1, 1}}, 64, 48);
      ASSERT_TRUE(camera) << camera.error().message;
      const core::FilterSampler sampler({filter, 1.5F});
      std::array<core::DueSample, 8> due{};
      core::Vec4s<8> u;
      test_support::Random random(4);
      for (std::size_t k = 0; k < 8; ++k) {
        due[k] = {static_cast<int>(7 * k), static_cast<int>(5 * k), 0, 0};
        u.x.v[k] = random.uniform();
        u.y.v[k] = random.uniform();
        u.z.v[k] = random.uniform();
        u.w.v[k] = random.uniform();
      }
      const auto rays = core::LaneCamera(*camera, sampler).rays<8>(due, u);
      for (std::size_t k = 0; k < 8; ++k) {
        const auto at = sampler.sample({u.x.v[k], u.y.v[k]});
        const auto one = camera->ray({static_cast<float>(due[k].x) + 0.5F + at.offset_px.x,
                                      static_cast<float>(due[k].y) + 0.5F + at.offset_px.y},
                                     {u.z.v[k], u.w.v[k]});
        SCOPED_TRACE(static_cast<int>(*settings.type));
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(rays.direction.lane(k)[c], one.ray.direction[c], 1e-6F);
          EXPECT_NEAR(rays.origin.lane(k)[c], one.ray.origin[c], 1e-6F);
        }
        EXPECT_EQ(rays.spread_rad.v[k], one.spread_rad);
        EXPECT_EQ(rays.width_m.v[k], one.width_m);
        EXPECT_EQ(rays.start_m.v[k], one.start_m);
        EXPECT_EQ(rays.t_max.v[k], one.ray.t_max);
        EXPECT_NEAR(rays.weight.v[k], at.weight, 1e-6F);
      }
    }
  }
}

TEST(WaveLanes, CompressKeepsTheOrderOfSelectedLanes) {
  alignas(32) std::array<std::int32_t, 8> from = {10, 11, 12, 13, 14, 15, 16, 17};
  for (unsigned taken = 0; taken < 256; ++taken) {
    std::array<std::int32_t, 8> to{};
    core::compress<8>(to.data(), core::load<8>(from.data()), taken);
    std::size_t at = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      if ((taken >> k & 1U) != 0) {
        EXPECT_EQ(to[at++], from[k]);
      }
    }
  }
}

TEST(WaveLanes, RefuseAMaterialWithATextureThatTheyDoNotRead) {
  using core::Material;
  core::Image image;
  image.width = image.height = 1;
  image.channels = 3;
  image.bytes.resize(3);
  const auto texture = core::Texture::create(image, false);
  // Those that apply_maps() reads; that of emission, which is added apart; and that of anisotropy,
  // which has no effect without its factor.
  const std::vector<core::TextureSlot Material::*> known = {
      &Material::base_color,  &Material::metallic_roughness,  &Material::normal,
      &Material::clearcoat,   &Material::clearcoat_roughness, &Material::clearcoat_normal,
      &Material::sheen_color, &Material::sheen_roughness,     &Material::emissive,
      &Material::anisotropy};
  for (const core::MaterialMap& map : core::kMaterialMaps) {
    if (map.slot == nullptr) {
      continue;
    }
    Material m;
    m.base_color.texture = (m.*map.slot).texture = texture.get();
    m.base_color.places = (m.*map.slot).places = 1;
    const bool is_known = std::find(known.begin(), known.end(), map.slot) != known.end();
    EXPECT_EQ(core::is_mapped(m), is_known) << &map - core::kMaterialMaps.data();
    if (is_known && map.in_lanes == core::MapInLanes::kRead) {
      (m.*map.slot).description.nearest = true;
      m.base_color.description.nearest = true;
      EXPECT_FALSE(core::is_mapped(m));
    }
  }
}

}  // namespace
