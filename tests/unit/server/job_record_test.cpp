#include "server/jobs/job_record.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

using api::JobState;
using server::may_change;

constexpr std::array kStates = {JobState::kQueued,   JobState::kLoading,  JobState::kRendering,
                                JobState::kPaused,   JobState::kFinished, JobState::kFailed,
                                JobState::kCancelled};

TEST(JobState, AllowsTheTransitionsOfTheTable) {
  // Row: from; column: to. In the order of kStates.
  constexpr std::array<const char*, 7> kAllowed = {
      "11.1.11",  // queued
      "1111.11",  // loading
      "1.11111",  // rendering
      "1.11111",  // paused
      "1...1..",  // finished: extended
      "1....1.",  // failed: retried
      "......1",  // cancelled
  };
  for (std::size_t from = 0; from < kStates.size(); ++from) {
    for (std::size_t to = 0; to < kStates.size(); ++to) {
      EXPECT_EQ(may_change(kStates[from], kStates[to]), kAllowed[from][to] == '1')
          << api::to_text(kStates[from]) << " -> " << api::to_text(kStates[to]);
    }
  }
}

server::JobRecord made_record() {
  auto parsed = api::parse_job(R"({"scene": "cornell-box", "name": "n", "labels": {"a": "b"},
      "priority": 5, "environment": {"color": [1, 0.5, 0.25], "visible": false},
      "film": {"width": 64, "height": 32}, "stop": {"relative_error": 0.125}})");
  EXPECT_TRUE(parsed);
  server::JobRecord record;
  record.view.id = "00000000-0000-4000-8000-000000000000";
  record.view.spec = parsed->spec;
  record.view.created_at_unix_seconds = 1000;
  return record;
}

TEST(JobRecord, IsRestoredFromItsRow) {
  server::JobRecord record = made_record();
  record.sequence = 9;
  record.view.state = JobState::kFailed;
  record.view.stop_reason = core::StopReason::kFailed;
  record.view.warnings = {"careful"};
  api::add_warning(record.view, {"clamped", "/materials/0", "2 is outside [0, 1]; 1 counts"});
  api::add_warning(record.view, {"padding", "", "of the\tcontainer"});
  record.failure = core::Error{core::ErrorCode::kNoSpace, "the disk is full", "/films/a"};
  record.view.progress.samples_max = 4;
  record.view.progress.elapsed_seconds = 2;
  record.view.progress.cpu_seconds = 4;
  record.view.progress.rays = 100;
  record.view.progress.error = core::error_interval(0.5, 0, 0.25);
  const auto back = server::to_record(server::to_row(record));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_TRUE(api::same_spec(back->view.spec, record.view.spec));
  EXPECT_EQ(back->sequence, 9);
  EXPECT_EQ(back->view.state, JobState::kFailed);
  const std::vector<std::string> texts = {"careful", "/materials/0: 2 is outside [0, 1]; 1 counts",
                                          "of the container"};
  EXPECT_EQ(back->view.warnings, texts);
  ASSERT_EQ(back->view.warning_details.size(), 2U);
  EXPECT_EQ(back->view.warning_details[0], record.view.warning_details[0]);
  ASSERT_TRUE(back->view.failure);
  EXPECT_EQ(back->view.failure->status, 507);
  EXPECT_EQ(back->view.progress.samples_max, 4);
  EXPECT_EQ(back->view.progress.rays_per_second, 50);
  EXPECT_EQ(back->view.progress.efficiency(), 1.0);                 // 1 / (0.5^2 * 4 s)
  EXPECT_DOUBLE_EQ(back->view.progress.efficiency_low(), 4.0 / 9);  // 1 / (0.75^2 * 4 s)
  EXPECT_EQ(back->view.progress.efficiency_high(), 4.0);            // 1 / (0.25^2 * 4 s)
}

TEST(JobRecord, UnknownErrorStaysUnknown) {
  const auto back = server::to_record(server::to_row(made_record()));
  ASSERT_TRUE(back);
  EXPECT_TRUE(std::isnan(back->view.progress.error.relative));
  EXPECT_FALSE(back->view.failure);
}

TEST(JobRecord, UnreadableSpecIsAnErrorThatNamesTheJob) {
  server::JobRow row = server::to_row(made_record());
  row.spec_json = "{\"scene\": 3}";
  const auto back = server::to_record(row);
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().where, row.id);
}

}  // namespace
