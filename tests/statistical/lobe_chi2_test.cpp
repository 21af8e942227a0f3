// Each lobe of the BSDF alone: its samples against its density. About 30 p-values, each rejected
// below sidak(0.01, 60).
#include <functional>

#include <gtest/gtest.h>

#include "core/bsdf/clearcoat_lobe.h"
#include "core/bsdf/diffuse_lobe.h"
#include "core/bsdf/glass_lobe.h"
#include "core/bsdf/sheen_lobe.h"
#include "core/bsdf/specular_lobe.h"
#include "core/bsdf/thin_lobe.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/statistics.h"

namespace {

using core::BsdfEval;
using core::BsdfSample;
using core::Facets;
using core::Vec2;
using core::Vec3;
using test_support::Random;

const double kLevel = test_support::sidak(0.01, 60);

struct LobeCase {
  std::string name;
  Facets facets;
  /// Returns true and wi, or false if a sample is absorbed.
  std::function<bool(const Facets&, float, Vec2, BsdfSample&)> sample;
  std::function<void(const Facets&, Vec3, BsdfEval&)> add;
};
void PrintTo(const LobeCase& c, std::ostream* out) { *out << c.name; }

core::DiffuseLobe diffuse(bool is_even) { return {is_even}; }

core::SpecularLobe specular() {
  core::SpecularLobe lobe{};
  lobe.f0 = core::Rgb(0.3F);
  lobe.f90 = 1;
  return lobe;
}

core::GlassLobe glass(const Facets& facets, bool inside) {
  const core::Rgb white(1);
  return {{white, white, white, 1, 1.5F, inside}, facets, 1, {}};
}

core::BsdfLayers layers() {
  core::BsdfLayers l;
  l.clearcoat = 1;
  l.clearcoat_roughness = 0.5F;
  l.clearcoat_normal = core::normalize(Vec3{0.2F, -0.1F, 1});
  l.sheen_color = core::Rgb(0.8F);
  l.sheen_roughness = 0.4F;
  return l;
}

std::vector<LobeCase> lobes() {
  std::vector<LobeCase> cases;
  const auto at = [](double degrees, core::Ggx ggx) {
    return Facets{test_support::direction(degrees), ggx, std::sqrt(ggx.alpha_x), false};
  };
  for (const double degrees : {15.0, 70.0}) {
    const std::string tail = degrees < 45 ? "Steep" : "Grazing";
    const Facets round = at(degrees, {0.3F, 0.3F});
    const Facets brushed = at(degrees, {0.5F, 0.2F});
    for (const bool even : {false, true}) {
      cases.push_back({(even ? "DiffuseUniform" : "Diffuse") + tail, round,
                       [even](const Facets&, float, Vec2 u, BsdfSample& s) {
                         s.wi_local = diffuse(even).sample(u);
                         return s.wi_local.z > 0;
                       },
                       [even](const Facets&, Vec3 wi, BsdfEval& out) {
                         if (wi.z > 0) {
                           out.pdf_solid_angle += diffuse(even).pdf_solid_angle(wi.z);
                         }
                       }});
      cases.push_back(
          {(even ? "GlassInside" : "GlassOutside") + tail, round,
           [even](const Facets& f, float lobe, Vec2 u, BsdfSample& s) {
             const auto sample = glass(f, even).sample(f, 1, 1, lobe, u);
             s.wi_local = sample.wi;
             return sample.is_refracted ? sample.wi.z < 0 : sample.wi.z > 0;
           },
           [even](const Facets& f, Vec3 wi, BsdfEval& out) { glass(f, even).add(f, 1, wi, out); }});
      cases.push_back({(even ? "SpecularBrushed" : "Specular") + tail, even ? brushed : round,
                       [](const Facets& f, float, Vec2 u, BsdfSample& s) {
                         s.wi_local = f.sample_reflected(u);
                         return s.wi_local.z > 0;
                       },
                       [](const Facets& f, Vec3 wi, BsdfEval& out) {
                         if (wi.z > 0) {
                           out = specular().single(f, 1, wi);
                         }
                       }});
    }
    cases.push_back({"Thin" + tail, brushed,
                     [](const Facets& f, float, Vec2 u, BsdfSample& s) {
                       s.wi_local = core::ThinLobe::sample(f, u);
                       return s.wi_local.z < 0;
                     },
                     [](const Facets& f, Vec3 wi, BsdfEval& out) {
                       if (wi.z < 0) {
                         core::ThinLobe{}.add(f, core::Interface{}, 1, wi, out);
                       }
                     }});
    cases.push_back({"Clearcoat" + tail, round,
                     [](const Facets& f, float, Vec2 u, BsdfSample& s) {
                       s.wi_local = core::ClearcoatLobe(layers(), f.wo, 0).sample(u);
                       return s.wi_local.z > 0;
                     },
                     [](const Facets& f, Vec3 wi, BsdfEval& out) {
                       if (wi.z > 0) {
                         core::ClearcoatLobe(layers(), f.wo, 0).add(1, wi, out);
                       }
                     }});
    cases.push_back({"Sheen" + tail, round,
                     [](const Facets&, float, Vec2 u, BsdfSample& s) {
                       s.wi_local = core::SheenLobe::sample(u);
                       return s.wi_local.z > 0;
                     },
                     [](const Facets& f, Vec3 wi, BsdfEval& out) {
                       if (wi.z > 0) {
                         core::SheenLobe(layers(), f.wo).add(1, f.wo, wi, out);
                       }
                     }});
  }
  return cases;
}

double p_value(const LobeCase& c, int samples, float spoil) {
  return test_support::chi2_sphere(
             [&](Random& r) -> std::optional<Vec3> {
               BsdfSample s;
               const float lobe = r.uniform();
               const bool ok = c.sample(c.facets, lobe, r.uniform_2d(), s);
               return ok ? std::optional(s.wi_local) : std::nullopt;
             },
             [&](Vec3 wi) {
               BsdfEval eval;
               c.add(c.facets, wi, eval);
               return spoil * eval.pdf_solid_angle;
             },
             samples, 17)
      .p_value;
}

class LobeChi2 : public testing::TestWithParam<LobeCase> {};

INSTANTIATE_TEST_SUITE_P(Lobes, LobeChi2, testing::ValuesIn(lobes()),
                         [](const auto& c) { return c.param.name; });

TEST_P(LobeChi2, SampleFollowsItsDensity) { EXPECT_GT(p_value(GetParam(), 150000, 1), kLevel); }

TEST_P(LobeChi2, DetectsADensityTwoPercentTooLarge) {
  EXPECT_LT(p_value(GetParam(), 600000, 1.02F), kLevel);
}

}  // namespace
