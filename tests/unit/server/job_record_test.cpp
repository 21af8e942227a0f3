#include "server/jobs/job_record.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/store/database.h"
#include "tests/unit/server/server_test_support.h"

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
  record.unverified = {"worker 1", "worker 2"};
  record.view.is_doubted = true;
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
  EXPECT_EQ(back->unverified, record.unverified);
  EXPECT_TRUE(back->view.is_doubted);
  EXPECT_EQ(back->view.progress.samples_max, 4);
  EXPECT_EQ(back->view.progress.rays_per_second, 50);
  EXPECT_EQ(back->view.progress.efficiency(), 1.0);                 // 1 / (0.5^2 * 4 s)
  EXPECT_DOUBLE_EQ(back->view.progress.efficiency_low(), 4.0 / 9);  // 1 / (0.75^2 * 4 s)
  EXPECT_EQ(back->view.progress.efficiency_high(), 4.0);            // 1 / (0.25^2 * 4 s)
}

TEST(JobRecord, TheWarningOfADoubtedJobSaysWhatHelps) {
  struct Case {
    JobState state;
    core::SampleLedger ledger;
    const char* remedy;
  };
  for (const Case& each :
       {Case{JobState::kFinished, {}, "Retry the job to render it anew."},
        Case{JobState::kFailed, {}, "Retry the job to render it anew."},
        Case{JobState::kCancelled, {}, "Submit the job again to render it anew."},
        Case{JobState::kFinished,
             {{0, 0, 2, 8}, {1, 0, 2, 8}},
             "Retry the jobs of the films that were merged, and merge them again."}}) {
    server::JobRecord record = made_record();
    record.view.state = each.state;
    record.view.ledger = each.ledger;
    server::doubt(record.view);
    server::doubt(record.view);
    ASSERT_EQ(record.view.warnings.size(), 1U);
    EXPECT_TRUE(record.view.warnings[0].ends_with(each.remedy)) << record.view.warnings[0];
    EXPECT_EQ(server::can_begin_again(record.view),
              std::string(each.remedy).starts_with("Retry the job to"));
    server::forget_samples(record);
    EXPECT_FALSE(record.view.is_doubted);
    EXPECT_TRUE(record.view.warnings.empty());
  }
}

TEST(JobRecord, UnknownErrorStaysUnknown) {
  const auto back = server::to_record(server::to_row(made_record()));
  ASSERT_TRUE(back);
  EXPECT_TRUE(std::isnan(back->view.progress.error.relative));
  EXPECT_FALSE(back->view.failure);
}

TEST(JobRecord, UnreadableSpecIsAnErrorThatNamesTheJob) {
  for (const char* record :
       {R"({"spec": {"scene": 3}})", R"({"spec": {"scene": "cornell-box"}, "rays": "3"})",
        R"({"spec": {"scene": "cornell-box"}, "state": "asleep"})", "{}", "[]", "{", "",
        R"({"spec": {"scene": "cornell-box"}, "warnings": [3]})",
        R"({"spec": {"scene": "cornell-box"}, "failure": {"code": "x"}})"}) {
    server::JobRow row = server::to_row(made_record());
    row.record = record;
    const auto back = server::to_record(row);
    ASSERT_FALSE(back) << record;
    EXPECT_EQ(back.error().where, row.id);
  }
}

TEST(JobRecord, MembersThatADocumentLacksKeepTheirDefaults) {
  server::JobRow row = server::to_row(made_record());
  row.record = R"({"spec": {"scene": "cornell-box"}, "state": "finished", "unknown": 1})";
  const auto back = server::to_record(row);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->view.state, JobState::kFinished);
  EXPECT_EQ(back->view.spec_version, 1U);
}

/// A job with every member, as the schema with a column for each had it.
constexpr const char* kOldJob = R"sql(
INSERT INTO jobs(sequence, id, spec, spec_version, scene, environment_asset, priority, state,
  stop_reason, created_at, started_at, finished_at, warnings, failure_code, failure_message,
  failure_where, film, film_bytes, film_digest, revision, fraction, samples_min, samples_mean,
  samples_max, elapsed_seconds, cpu_seconds, rays, rejected_samples, peak_bytes, error_grain,
  error_doubt, error_reach, build, ledger, samples_by_error, split_count, pause_reason,
  light_not_found)
VALUES(9, 'a', '{"scene": "cornell-box", "name": "n", "seed": 18, "priority": 5,
    "film": {"width": 64, "height": 32}}', 3, 'cornell-box', 'sky', 5, 'failed', 'failed',
  1732650000.1234567, 1732650001.5, 1e300,
  'careful' || char(10) || 'clamped' || char(9) || '/materials/0' || char(9) || '"2" \n is wrong' ||
    char(10), 17, 'the "disk" is full', '/films/a', 1, 1099511627776, 'd', 4000000000,
  0.30000000000000004, 1, 0.3333333333333333, 4, 2.0, 1e-300, 9007199254740993, 13, 14, 0.5, 0.0,
  0.25, '{"version": "1"}',
  '[{"seed": 7, "first_replicate": 0, "replicates": 2, "samples_per_pixel": 8}]', 15, 16,
  'storage_full', '{"at_most": 0.125, "detected": 0.0625, "particles": 12, "lacking": [3]}'),
  (10, 'b', '{', 1, 's', '', 0, 'queued', '', 1.0, NULL, 9e999, '', 0, '', '', 0, 0, '', 0, 0.0, 0,
  0.0, 0, 0.0, 0.0, 0, 0, 0, NULL, NULL, NULL, '{', '[', 0, 0, '', '}');
)sql";

TEST(JobRecord, OfAnOlderStoreIsUnchanged) {
  const test_support::TemporaryFolder folder;
  const std::string path = folder.file("tessera.db");
  {
    auto database = server::Database::open(path);
    ASSERT_TRUE(database);
    ASSERT_TRUE((*database)->session().execute(test_support::kBackToSchema15));
    ASSERT_TRUE((*database)->session().execute(kOldJob));
  }
  auto database = server::Database::open(path);
  ASSERT_TRUE(database) << database.error().message;
  server::JobTable table(**database);
  const auto row = table.find("a");
  ASSERT_TRUE(row && *row);
  const auto record = server::to_record(**row);
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ(record->sequence, 9);
  EXPECT_EQ(record->film, server::FilmPlace::kOnDisk);
  EXPECT_EQ(record->film_bytes, 1ULL << 40U);
  ASSERT_TRUE(record->failure);
  EXPECT_EQ(record->failure->code, core::ErrorCode::kNoSpace);
  EXPECT_EQ(record->failure->message, "the \"disk\" is full");
  EXPECT_EQ(record->failure->where, "/films/a");
  const api::JobView& view = record->view;
  EXPECT_EQ(view.spec.name, "n");
  EXPECT_EQ(view.spec.render.seed, 18U);
  EXPECT_EQ(view.spec.priority, 5);
  EXPECT_EQ(view.spec_version, 3U);
  EXPECT_EQ(view.state, JobState::kFailed);
  EXPECT_EQ(view.stop_reason, core::StopReason::kFailed);
  EXPECT_EQ(view.pause_reason, api::PauseReason::kStorageFull);
  EXPECT_EQ(view.created_at_unix_seconds, 1732650000.1234567);
  EXPECT_EQ(view.started_at_unix_seconds, 1732650001.5);
  EXPECT_EQ(view.finished_at_unix_seconds, 1e300);
  EXPECT_EQ(view.warnings,
            (std::vector<std::string>{"careful", "/materials/0: \"2\" \\n is wrong"}));
  EXPECT_EQ(view.warning_details.size(), 1U);
  EXPECT_EQ(view.film_digest, "d");
  EXPECT_EQ(view.peak_bytes, 14U);
  EXPECT_EQ(view.samples_by_error, 15);
  EXPECT_EQ(view.split_count, 16);
  EXPECT_EQ(view.build, R"({"version":"1"})");
  ASSERT_EQ(view.ledger.size(), 1U);
  EXPECT_EQ(view.ledger.front().seed, 7U);
  const core::Progress& progress = view.progress;
  EXPECT_EQ(progress.revision, 4'000'000'000U);
  EXPECT_EQ(progress.fraction, 0.30000000000000004);
  EXPECT_EQ(progress.samples_min, 1);
  EXPECT_EQ(progress.samples_mean, 0.3333333333333333);
  EXPECT_EQ(progress.samples_max, 4);
  EXPECT_EQ(progress.elapsed_seconds, 2);
  EXPECT_EQ(progress.cpu_seconds, 1e-300);
  EXPECT_EQ(progress.rays, 9007199254740993U);
  EXPECT_EQ(progress.rejected_samples, 13U);
  EXPECT_EQ(progress.error.relative, 0.5);
  EXPECT_EQ(progress.error.reach, 0.25);
  ASSERT_TRUE(progress.light_not_found);
  EXPECT_EQ(progress.light_not_found->at_most, 0.125);
  EXPECT_EQ(progress.light_not_found->tiles, std::vector<int>{3});
  // One that could not be read still cannot, and the store opens.
  EXPECT_FALSE(server::to_record(**table.find("b")));
  ASSERT_TRUE(table.update(server::to_row(*record), {}));
  const auto again = server::to_record(**table.find("a"));
  ASSERT_TRUE(again);
  EXPECT_EQ(server::to_row(*again).record, server::to_row(*record).record);
}

}  // namespace
