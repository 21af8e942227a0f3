// Background and ground of a job: effective values of omitted members.
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"
#include "core/settings/choices.h"

namespace {

using api::Json;

api::JobSpec spec_of(const std::string& body) {
  const auto parsed = api::parse_job(body);
  EXPECT_TRUE(parsed) << body << (parsed ? "" : parsed.problem().detail);
  return parsed ? parsed->spec : api::JobSpec{};
}

TEST(JobStage, BackgroundAndVisibleAreEquivalent) {
  for (const char* text :
       {R"({"scene":"x","environment":{"visible":false}})",
        R"({"scene":"x","environment":{},"background":{"type":"transparent"}})"}) {
    const api::JobSpec spec = spec_of(text);
    EXPECT_TRUE(core::is_transparent(spec.render)) << text;
    EXPECT_EQ(api::to_json(spec)["environment"]["visible"], false) << text;
    EXPECT_EQ(api::to_json(spec)["background"], Json({{"type", "transparent"}})) << text;
  }
  EXPECT_FALSE(api::to_json(spec_of(R"({"scene":"x"})")).contains("background"));
  const api::JobSpec coloured =
      spec_of(R"({"scene":"x","background":{"type":"color","color":[0.5,0,1]}})");
  EXPECT_EQ(coloured.render.background.color, (core::Rgb{0.5F, 0, 1}));
}

TEST(JobStage, CatcherIsTransparentByDefault) {
  const api::JobSpec plain = spec_of(R"({"scene":"x","ground":{"type":"catcher"}})");
  EXPECT_TRUE(core::is_transparent(plain.render));
  EXPECT_TRUE(plain.render.film.errors_over_white);
  EXPECT_NE(plain.denoise.type, core::DenoiserType::kNone);
  EXPECT_EQ(api::to_json(plain)["ground"]["height"], nullptr);
  for (const char* text :
       {R"({"scene":"x","ground":{"type":"catcher"},"background":{"type":"environment"}})",
        R"({"scene":"x","ground":{"type":"catcher"},"environment":{"visible":true}})"}) {
    const api::JobSpec seen = spec_of(text);
    EXPECT_FALSE(core::is_transparent(seen.render)) << text;
    EXPECT_FALSE(seen.render.film.errors_over_white) << text;
    EXPECT_NE(seen.denoise.type, core::DenoiserType::kNone) << text;
    EXPECT_TRUE(api::same_spec(seen, spec_of(api::spec_json(seen)))) << text;
  }
  EXPECT_FALSE(core::is_transparent(
      spec_of(R"({"scene":"x","ground":{"type":"sweep","height":0.5}})").render));
}

}  // namespace
