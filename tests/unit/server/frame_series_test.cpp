#include "server/jobs/frame_series.h"

#include <gtest/gtest.h>

namespace {

api::JobSpec spec() {
  return api::parse_job(R"({"scene": "cornell-box", "time_seconds": 0})")->spec;
}

TEST(FrameSeries, JobsThatDifferByTimeSeedAndRulesAreFrames) {
  api::JobSpec other = spec();
  other.time_seconds = 0.04;
  other.render.seed = 7;
  other.stop.samples_per_pixel = 9;
  EXPECT_TRUE(server::are_frames(spec(), other));
}

TEST(FrameSeries, JobsOfOtherSettingsAreNone) {
  api::JobSpec deeper = spec();
  ++deeper.render.max_depth;
  EXPECT_FALSE(server::are_frames(spec(), deeper));
  api::JobSpec still = spec();
  still.time_seconds.reset();
  EXPECT_FALSE(server::are_frames(spec(), still));
}

// Pilots choose these for each job alone.
TEST(FrameSeries, WhatPilotsChooseDoesNotEndASeries) {
  using Change = void (*)(core::RenderSettings&);
  constexpr Change kChanges[] = {
      [](core::RenderSettings& s) { s.integrator = "bdpt"; },
      [](core::RenderSettings& s) { s.caustics = core::CausticsType::kAuto; },
      [](core::RenderSettings& s) { s.estimator.splitting = core::SplittingType::kNone; },
      [](core::RenderSettings& s) { s.adaptive.type = core::AdaptiveType::kPilot; },
      [](core::RenderSettings& s) { s.light_sampler = core::LightSamplerType::kRis; }};
  for (const Change change : kChanges) {
    api::JobSpec other = spec();
    change(other.render);
    EXPECT_FALSE(api::same_spec(spec(), other));
    EXPECT_TRUE(server::are_frames(spec(), other));
  }
}

}  // namespace
