#include "api/answers/events.h"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/examples.h"
#include "tests/support/enumerators.h"

namespace {

using api::Json;

TEST(Events, HaveTheDocumentedNames) {
  EXPECT_EQ(api::to_text(api::EventType::kSnapshot), "snapshot");
  EXPECT_EQ(api::to_text(api::EventType::kState), "state");
  EXPECT_EQ(api::to_text(api::EventType::kProgress), "progress");
  EXPECT_EQ(api::to_text(api::EventType::kTile), "tile");
  EXPECT_EQ(api::to_text(api::EventType::kWarning), "warning");
  EXPECT_EQ(api::to_text(api::EventType::kEnd), "end");
  EXPECT_EQ(api::to_text(api::EventType::kReset), "reset");
  EXPECT_EQ(api::to_text(api::EventType::kOverloaded), "overloaded");
}

TEST(Events, HaveNamesThatAreReadBack) {
  for (const auto type : test_support::enumerators<api::EventType>()) {
    EXPECT_EQ(api::event_type_from_text(api::to_text(type)), type);
  }
}

TEST(Events, StateWarningAndEndAreDurable) {
  using api::EventType;
  for (const auto type : {EventType::kState, EventType::kWarning, EventType::kEnd}) {
    EXPECT_TRUE(api::is_durable(type));
  }
  for (const auto type : {EventType::kSnapshot, EventType::kProgress, EventType::kTile,
                          EventType::kReset, EventType::kOverloaded}) {
    EXPECT_FALSE(api::is_durable(type));
  }
}

TEST(Events, SnapshotIsTheJob) {
  EXPECT_EQ(api::snapshot_event(api::example_job()), api::job_json(api::example_job()));
}

TEST(Events, TileContainsItsRectangle) {
  api::TileEvent tile;
  tile.rect = {32, 64, 16, 8};
  tile.revision = 7;
  tile.samples = 4;
  tile.error = 0.25;
  EXPECT_EQ(api::tile_event("J", tile),
            R"({"x":32,"y":64,"width":16,"height":8,"revision":7,"samples":4,"error":0.25,)"
            R"("url":"/v1/jobs/J/image.png?x=32&y=64&width=16&height=8&revision=7"})");
  tile.error = std::nan("");
  EXPECT_TRUE(Json::parse(api::tile_event("J", tile))["error"].is_null());
}

TEST(Events, ProgressIsPartOfTheJob) {
  const Json job = Json::parse(api::job_json(api::example_job()));
  const Json progress = Json::parse(api::progress_event(api::example_job()));
  for (const char* key : {"state", "progress", "error", "statistics", "revision"}) {
    EXPECT_EQ(progress[key], job[key]) << key;
  }
}

TEST(Events, EndContainsTheReason) {
  api::JobView job = api::example_job();
  job.state = api::JobState::kFinished;
  job.stop_reason = core::StopReason::kDeadline;
  job.film_digest = "abc";
  const Json end = Json::parse(api::end_event(job));
  EXPECT_EQ(end["state"], "finished");
  EXPECT_EQ(end["stop_reason"], "deadline");
  EXPECT_EQ(end["film_digest"], "abc");
}

TEST(Events, AreOneLine) {
  EXPECT_EQ(api::warning_event("a\nb").find('\n'), std::string::npos);
  EXPECT_EQ(api::reset_event("lost"), R"({"reason":"lost"})");
  EXPECT_EQ(Json::parse(api::overloaded_event(15))["retry_after_seconds"], 15);
}

}  // namespace
