// Power of the particles of light paths, which photon maps store and light tracing connects to the
// camera, in a closed sphere (truth 18). z-tests with a limit of 4 standard errors, a false alarm
// rate of 6e-5 each.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/integrators/path/path_tracer.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/transport/light_path.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Moments;

constexpr int kDepth = 8;  // surfaces that a particle meets

struct Sphere {
  std::shared_ptr<const core::Scene> scene;
  double area_m2 = 0;
};

/// Reflects half of the light.
Sphere sphere(float radiance) {
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(radiance);
  core::PrimitiveDescription p = test_support::sphere({}, 1, 12, true, 0);
  p.normals.clear();
  Sphere out;
  for (std::size_t i = 0; i < p.indices.size(); i += 3) {
    const Vec3 corner = p.positions[p.indices[i]];
    out.area_m2 += static_cast<double>(length(cross(p.positions[p.indices[i + 1]] - corner,
                                                    p.positions[p.indices[i + 2]] - corner))) /
                   2;
  }
  out.scene = test_support::build(test_support::scene_of({lamp}, {p}));
  return out;
}

/// Power of all particles on surfaces, over that emitted at radiance 1, pi A.
Moments stored(float radiance) {
  const Sphere of = sphere(radiance);
  const core::EmissionSampler emission(of.scene->data(), nullptr);
  core::PathSampler sampler(core::SamplerType::kIndependent, 2, 5, 0);
  Moments out;
  for (int i = 0; i < 150'000; ++i) {
    sampler.start(i % 1024, i / 1024, 0);
    std::uint64_t rays = 0;
    core::PathState path = core::start_path(sampler, rays);
    double power = 0;
    core::follow_light_path(
        of.scene->data(), emission, kDepth, path,
        [&power](const core::LightVertex& v) { power += static_cast<double>(v.power.g); });
    out.add(power / (std::numbers::pi * of.area_m2));
  }
  return out;
}

/// Sum of the powers of 1/2 below kDepth.
constexpr double kStored = 2 - 2.0 / (1 << kDepth);

TEST(LightPower, StoredPowerIsTheSumOverReflections) {
  const Moments seen = stored(1);
  EXPECT_LT(std::fabs(seen.z(kStored)), 4) << seen.mean << " +- " << seen.standard_error();
  EXPECT_LT(seen.standard_error(), 2e-3 * kStored);
}

TEST(LightPower, DetectsOnePercentMoreEmission) {
  EXPECT_GT(std::fabs(stored(1.01F).z(kStored)), 4);
}

}  // namespace
