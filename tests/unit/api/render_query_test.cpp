#include "api/queries/render_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using Query = std::vector<std::pair<std::string, std::string>>;

const std::vector<std::string> kToneMaps = {"srgb", "khronos-neutral"};

api::Parsed<api::RenderQuery> parse(Query query) {
  return api::parse_render_query(query, kToneMaps);
}

std::string pointer_of(Query query) {
  const auto parsed = parse(std::move(query));
  EXPECT_FALSE(parsed);
  return parsed ? "" : parsed.problem().errors.at(0).pointer;
}

TEST(RenderQuery, ErrorIsAShareOrAPercentage) {
  for (const char* text : {"0.03", "3%", "3.0%", "3e-2"}) {
    EXPECT_DOUBLE_EQ(*parse({{"error", text}})->relative_error, 0.03) << text;
  }
  for (const char* text : {"3 %", "%", "3%%", "101%", "2", "0", "-1%", "nan", "0x1%", ""}) {
    EXPECT_EQ(pointer_of({{"error", text}}), "/error") << text;
  }
}

TEST(RenderQuery, SizeIsWidthByHeight) {
  EXPECT_EQ(parse({{"size", "800x600"}})->size, (std::array{800, 600}));
  for (const char* text :
       {"800", "800x", "x600", "800x600x1", "0x600", "16385x1", "8.5x9", "-1x2"}) {
    EXPECT_EQ(pointer_of({{"size", text}}), "/size") << text;
  }
}

TEST(RenderQuery, CurveAndToneMapAreOneParameter) {
  EXPECT_EQ(parse({})->look.tone_map, "khronos-neutral");
  EXPECT_EQ(parse({{"curve", "neutral"}})->look.tone_map, "khronos-neutral");
  EXPECT_EQ(parse({{"curve", "srgb"}})->look.tone_map, "srgb");
  EXPECT_EQ(parse({{"tonemap", "srgb"}})->look.tone_map, "srgb");
  EXPECT_EQ(pointer_of({{"curve", "film"}}), "/curve");
  EXPECT_EQ(pointer_of({{"curve", "srgb"}, {"tonemap", "srgb"}}), "/tonemap");
}

TEST(RenderJob, QueryIsMergedIntoTheJob) {
  const auto query = parse({{"samples", "4"}, {"theta", "30"}, {"preset", "rim"}});
  const auto job = api::parse_render_job(
      R"({"seed": 5, "stop": {"seconds": 2}, "camera": {"orbit": {"phi_degrees": 80}}})", *query,
      {.scene = "cornell-box"});
  ASSERT_TRUE(job);
  EXPECT_EQ(job->spec.scene, "cornell-box");
  EXPECT_EQ(job->spec.render.seed, 5U);
  EXPECT_EQ(job->spec.stop.samples_per_pixel, 4);
  EXPECT_EQ(job->spec.stop.seconds, 2);
  EXPECT_FALSE(job->spec.stop.relative_error);
  EXPECT_FLOAT_EQ(job->spec.orbit->theta_degrees, 30);
  EXPECT_FLOAT_EQ(job->spec.orbit->phi_degrees, 80);
  EXPECT_EQ(job->spec.environment.preset, core::EnvironmentPreset::kRim);
}

TEST(RenderJob, EndsByErrorOrTimeUnlessARuleIsGiven) {
  const auto stop = [](const char* job, Query query) {
    return api::parse_render_job(job, *parse(std::move(query)), {.scene = "a"})->spec.stop;
  };
  const auto usual = stop("", {});
  EXPECT_EQ(usual.relative_error, api::kRenderError);
  EXPECT_EQ(usual.seconds, api::kRenderSeconds);
  EXPECT_FALSE(stop("", {{"error", "5%"}}).seconds);
  EXPECT_FALSE(stop(R"({"stop": {"samples_per_pixel": 2}})", {}).relative_error);
}

TEST(RenderJob, HasExactlyOneScene) {
  const auto pointer = [](const char* job, const char* in_query, const char* uploaded) {
    const auto parsed = api::parse_render_job(
        job, *parse(*in_query != 0 ? Query{{"scene", in_query}} : Query{}), {.scene = uploaded});
    return parsed ? "" : parsed.problem().errors.at(0).pointer;
  };
  EXPECT_EQ(pointer("", "a", ""), "");
  EXPECT_EQ(pointer("", "", "a"), "");
  EXPECT_EQ(pointer(R"({"scene": "a"})", "", ""), "");
  EXPECT_EQ(pointer("", "", ""), "/scene");
  EXPECT_EQ(pointer("", "a", "a"), "/scene");
  EXPECT_EQ(pointer(R"({"scene": "a"})", "a", ""), "/scene");
  EXPECT_EQ(pointer("[]", "", "a"), "");  // no member is at fault
}

TEST(FrameModel, TurntableHasOneDistanceThatFitsAllAngles) {
  core::SceneSummary bar;
  bar.bounds = {.min = {-2, 0, -0.25F}, .max = {2, 1, 0.25F}};
  for (const float x : {-2.0F, 2.0F}) {
    for (const float y : {0.0F, 1.0F}) {
      bar.extremes.insert(bar.extremes.end(), {{x, y, -0.25F}, {x, y, 0.25F}});
    }
  }
  bar.origin = {1e6, 0, 0};
  const auto orbit = [&bar](int theta_degrees, bool is_turntable) {
    const auto query =
        parse({{"theta", std::to_string(theta_degrees)}, {"phi", "90"}, {"size", "800x800"}});
    auto job = api::parse_render_job("", *query, {.scene = "bar"});
    api::frame_model(job->spec, bar, is_turntable);
    return *job->spec.orbit;
  };
  for (int theta = 0; theta < 360; ++theta) {
    EXPECT_EQ(orbit(theta, true).radius_m, orbit(0, true).radius_m);
    EXPECT_EQ(orbit(theta, true).target, core::Place(1e6, 0.5, 0));
    EXPECT_LE(*orbit(theta, false).radius_m, *orbit(theta, true).radius_m);
  }
  const core::Place middle = *orbit(0, false).target - core::Place(1e6, 0.5, 0);
  EXPECT_NEAR(std::hypot(middle.x, middle.y, middle.z), 0, 1e-6);
  // From its end, the bar is small.
  EXPECT_LT(*orbit(90, false).radius_m, 0.6F * *orbit(90, true).radius_m);
}

}  // namespace
