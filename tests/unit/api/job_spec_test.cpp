#include "api/job/job_spec.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/integrators/registry.h"
#include "core/settings/choices.h"

namespace {

using api::Json;

api::JobSpec spec_of(const std::string& body) {
  const auto parsed = api::parse_job(body);
  EXPECT_TRUE(parsed) << body << (parsed ? "" : parsed.problem().detail);
  return parsed ? parsed->spec : api::JobSpec{};
}

TEST(JobSpec, ShowsEveryDefaultInTheDocumentedOrder) {
  const Json expected = Json::parse(R"({
    "scene": "cornell-box",
    "name": "", "labels": {}, "priority": 0, "seed": 0,
    "camera": {"name": null, "index": null, "position": null, "target": null, "up": null,
               "vertical_fov_degrees": null, "aperture_radius": null, "focus_distance": null},
    "variant": null, "time_seconds": 0,
    "medium": null, "class": "normal", "preview_key": null,
    "film": {"width": 960, "height": 540, "crop": null,
             "filter": {"type": "blackman-harris", "radius": 1.5},
             "layers": ["albedo", "normal", "depth"]},
    "integrator": {"type": "path", "max_depth": 16},
    "estimator": {"strategy": "mis", "mis": {"type": "power", "exponent": 2},
                  "roulette": {"type": "throughput"}, "splitting": {"type": "measured"},
                  "control_variate": {"type": "none"}, "expected_values": true},
    "sampler": {"type": "sobol", "replicates": 2},
    "light_sampler": {"type": "measured"},
    "adaptive": {"type": "none"},
    "units": "photometric",
    "spectral": false,
    "stop": {"samples_per_pixel": 256}
  })");
  EXPECT_EQ(api::spec_json(spec_of(R"({"scene":"cornell-box"})")), api::dump(expected));
}

TEST(JobSpec, GlassLetsATransparentBackgroundThroughWhereTheIntegratorCan) {
  const auto through = [](const std::string& integrator, const std::string& background) {
    const api::JobSpec spec = spec_of(R"({"scene":"x","integrator":{"type":")" + integrator +
                                      R"("},"background":)" + background + "}");
    EXPECT_TRUE(api::same_spec(spec_of(api::spec_json(spec)), spec)) << integrator << background;
    return spec.render.background.through_glass;
  };
  for (const core::IntegratorEntry& row : core::integrators()) {
    EXPECT_EQ(through(std::string(row.name), R"({"type":"transparent"})"),
              core::accepts(row, core::kThroughGlass));
  }
  EXPECT_FALSE(through("path", R"({"type":"color"})"));
  EXPECT_TRUE(through("path", R"({"type":"color","through_glass":true})"));
  EXPECT_FALSE(through("path", R"({"type":"transparent","through_glass":false})"));
}

TEST(JobSpec, CountOfTheFirstDecisionIsTheEffectiveOne) {
  const auto parsed = [](const char* members) {
    return *api::parse_job(std::string(R"({"scene":"s",)") + members + "}");
  };
  const auto odd = parsed(R"("adaptive":{"type":"pilot","min_samples":33})");
  EXPECT_EQ(odd.spec.render.adaptive.min_samples, 40);
  EXPECT_EQ(odd.warnings.size(), 1U);
  EXPECT_TRUE(parsed(R"("adaptive":{"type":"pilot","min_samples":48})").warnings.empty());
  EXPECT_TRUE(parsed(R"("adaptive":{"type":"pilot"},"sampler":{"replicates":6})").warnings.empty());
  // If the first decision would exceed the maximum number of samples, no such count is printed.
  const auto never =
      parsed(R"("adaptive":{"type":"pilot","min_samples":65536},"sampler":{"replicates":6})");
  EXPECT_EQ(never.spec.render.adaptive.min_samples, 65536);
  EXPECT_TRUE(api::same_spec(spec_of(api::spec_json(never.spec)), never.spec));
}

TEST(JobSpec, WarnsAboutUnsupportedAdaptiveSampling) {
  const auto warnings = [](const char* members) {
    return api::adaptive_warnings(spec_of(std::string(R"({"scene":"s",)") + members + "}"));
  };
  EXPECT_TRUE(warnings(R"("adaptive":{"type":"pilot"},"stop":{"relative_error":0.1})").empty());
  EXPECT_EQ(warnings(R"("adaptive":{"type":"pilot"},"stop":{"samples_per_pixel":32})").size(), 1U);
  EXPECT_TRUE(warnings(R"("adaptive":{"type":"pilot"},"stop":{"samples_per_pixel":34})").empty());
  EXPECT_TRUE(warnings(R"("stop":{"samples_per_pixel":2})").empty());
  EXPECT_TRUE(warnings(R"("stop":{"samples_per_pixel":16,"relative_error":0.1})").empty());
}

TEST(JobSpec, ParsesEveryMember) {
  const api::JobSpec spec = spec_of(R"({
    "scene": "s", "name": "n", "labels": {"a": "b"}, "priority": -7, "seed": 9007199254740991,
    "camera": {"index": 2, "position": [1, 2, 3], "target": [4, 5, 6], "up": [0, 0, 1],
               "vertical_fov_degrees": 30, "aperture_radius": 0.01, "focus_distance": 2},
    "variant": "red", "time_seconds": 1.5, "class": "preview", "preview_key": "k",
    "environment": {"color": [0.1, 0.2, 0.3], "intensity": 4, "rotation_degrees": -90,
    "visible": false,
                    "asset": "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"},
    "film": {"width": 100, "height": 50, "crop": {"x": 1, "y": 2, "width": 3, "height": 4},
             "filter": {"type": "box", "radius": 0.5},
             "layers": ["light:lamp", "depth", "bounce:2-", "beauty"]},
    "medium": {"scattering": [1, 2, 3], "absorption": [0, 0, 0.5], "g": -0.5,
               "height_falloff": 0.25},
    "integrator": {"type": "path", "max_depth": 0},
    "estimator": {"strategy": "mis", "mis": {"type": "power", "exponent": 3},
                  "roulette": {"type": "threshold", "delta": 0.25},
                  "splitting": {"type": "fixed", "count": 3}, "expected_values": false},
    "sampler": {"type": "independent", "replicates": 8},
    "light_sampler": {"type": "ris", "candidates": 5},
    "stop": {"relative_error": 0.02, "confidence": 0.9, "scope": "worst_tile", "seconds": 60,
             "deadline": "2026-01-01T01:00:00+01:00", "samples_per_pixel": 1000}
  })");
  EXPECT_EQ(spec.scene, "s");
  EXPECT_EQ(spec.name, "n");
  EXPECT_EQ(spec.labels.at("a"), "b");
  EXPECT_EQ(spec.priority, -7);
  EXPECT_EQ(spec.render.seed, 9007199254740991U);
  EXPECT_EQ(spec.camera.index, 2);
  EXPECT_EQ(spec.camera.position, (core::Vec3{1, 2, 3}));
  EXPECT_EQ(spec.camera.target, (core::Vec3{4, 5, 6}));
  EXPECT_EQ(spec.camera.up, (core::Vec3{0, 0, 1}));
  EXPECT_EQ(spec.camera.vertical_fov_degrees, 30.0F);
  EXPECT_EQ(spec.camera.aperture_radius_m, 0.01F);
  EXPECT_EQ(spec.camera.focus_distance_m, 2.0F);
  EXPECT_EQ(spec.variant, "red");
  EXPECT_EQ(spec.time_seconds, 1.5);
  EXPECT_EQ(spec.job_class, api::JobClass::kPreview);
  EXPECT_EQ(spec.preview_key, "k");
  EXPECT_EQ(spec.environment_choice, api::EnvironmentChoice::kGiven);
  EXPECT_EQ(spec.environment.color, (core::Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(spec.environment.intensity, 4.0F);
  EXPECT_EQ(spec.environment.rotation_degrees, -90.0F);
  EXPECT_TRUE(core::is_transparent(spec.render));
  EXPECT_TRUE(spec.environment_asset.has_value());
  EXPECT_EQ(spec.render.film.width, 100);
  EXPECT_EQ(spec.render.film.height, 50);
  EXPECT_EQ(spec.render.film.crop, (core::PixelRect{1, 2, 3, 4}));
  EXPECT_EQ(spec.render.film.filter.type, core::FilterType::kBox);
  EXPECT_EQ(spec.render.film.filter.radius_px, 0.5F);
  EXPECT_EQ(spec.layers, (std::vector<std::string>{"beauty", "depth", "light:lamp", "bounce:2-"}));
  ASSERT_EQ(spec.render.film.shares.size(), 2U);
  EXPECT_EQ(spec.render.film.shares[0].group, "lamp");
  EXPECT_EQ(spec.render.film.shares[1].first_bounce, 2);
  EXPECT_EQ(api::share_pointer(spec, 0), "/film/layers/0");
  EXPECT_EQ(api::share_pointer(spec, 1), "/film/layers/2");
  ASSERT_TRUE(spec.render.fog);
  EXPECT_EQ(spec.render.fog->scattering, (core::Rgb{1, 2, 3}));
  EXPECT_EQ(spec.render.fog->absorption.b, 0.5F);
  EXPECT_EQ(spec.render.fog->g, -0.5F);
  EXPECT_EQ(spec.render.fog->height_falloff, 0.25F);
  EXPECT_FALSE(spec.render.film.albedo);
  EXPECT_FALSE(spec.render.film.normal);
  EXPECT_TRUE(spec.render.film.depth);
  EXPECT_EQ(spec.render.max_depth, 0);
  EXPECT_EQ(spec.render.estimator.mis_exponent, 3.0F);
  EXPECT_EQ(spec.render.estimator.roulette, core::RouletteType::kThreshold);
  EXPECT_EQ(spec.render.estimator.roulette_delta, 0.25F);
  EXPECT_EQ(spec.render.estimator.splitting, core::SplittingType::kFixed);
  EXPECT_EQ(spec.render.estimator.split_count, 3);
  EXPECT_FALSE(spec.render.estimator.expected_values);
  EXPECT_EQ(spec.render.sampler, core::SamplerType::kIndependent);
  EXPECT_EQ(spec.render.replicates, 8);
  EXPECT_EQ(spec.render.light_sampler, core::LightSamplerType::kRis);
  EXPECT_EQ(spec.render.light_candidates, 5);
  EXPECT_EQ(spec.stop.relative_error, 0.02);
  EXPECT_EQ(spec.stop.confidence, 0.9);
  EXPECT_TRUE(spec.stop.worst_tile);
  EXPECT_EQ(spec.stop.seconds, 60.0);
  EXPECT_EQ(spec.stop.deadline_unix_seconds, 1767225600.0);
}

TEST(JobSpec, CatchersHaveNeutralShadowsAndErrorsOverWhiteWhileTheyAreTransparent) {
  const api::JobSpec plain = spec_of(R"({"scene":"x","ground":{"type":"catcher"}})");
  EXPECT_TRUE(plain.render.film.errors_over_white);
  EXPECT_EQ(plain.render.ground.shadow.color, core::ShadowColor::kNeutral);
  EXPECT_NE(plain.denoise.type, core::DenoiserType::kNone);
  const api::JobSpec seen =
      spec_of(R"({"scene":"x","ground":{"type":"catcher"},"environment":{"visible":true}})");
  EXPECT_FALSE(seen.render.film.errors_over_white);
  EXPECT_NE(seen.denoise.type, core::DenoiserType::kNone);
}

TEST(JobSpec, CountsCharactersNotBytes) {
  std::string name;
  for (int i = 0; i < 255; ++i) {
    name += "é";
  }
  EXPECT_EQ(spec_of(R"({"scene":"x","name":")" + name + R"("})").name, name);
}

TEST(SettleEnvironment, IsWhiteUnlessTheSceneHasLights) {
  const core::SceneSummary plain;
  api::JobSpec spec = spec_of(R"({"scene":"x"})");
  EXPECT_EQ(
      api::resolve_environment(spec, plain),
      "No environment was given, so it is white: the scene has no lights and no strong emission.");
  EXPECT_EQ(spec.environment_choice, api::EnvironmentChoice::kGiven);
  EXPECT_FALSE(api::resolve_environment(spec, plain).has_value());

  core::SceneSummary lit;
  lit.lights.emplace_back();
  spec = spec_of(R"({"scene":"x"})");
  EXPECT_EQ(api::resolve_environment(spec, lit),
            "No environment was given, so the background is black: the scene has its own lights.");
  EXPECT_EQ(spec.environment_choice, api::EnvironmentChoice::kBlack);

  core::SceneSummary with_its_own = lit;
  with_its_own.has_environment = true;
  spec = spec_of(R"({"scene":"x"})");
  EXPECT_EQ(api::resolve_environment(spec, with_its_own),
            "No environment was given, so the scene's own is used.");
  EXPECT_EQ(spec.environment_choice, api::EnvironmentChoice::kAutomatic);

  core::SceneSummary glowing;
  glowing.has_emissive_strength = true;
  spec = spec_of(R"({"scene":"x"})");
  EXPECT_TRUE(api::resolve_environment(spec, glowing).has_value());
  EXPECT_EQ(spec.environment_choice, api::EnvironmentChoice::kBlack);
}

}  // namespace
