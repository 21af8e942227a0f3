#include "server/jobs/batch_service.h"

#include <string>

#include <gtest/gtest.h>

#include "server/jobs/job_record.h"
#include "server/store/delivery_table.h"
#include "tests/unit/server/jobs_fixture.h"

namespace {

using server::Access;
using test_support::kForever;

class Batches : public test_support::JobsFixture {};

// Two jobs end at once: one is stored as ended, and its end is not published yet.
TEST_F(Batches, TheEndOfABatchIsReportedWithTheEndOfEachJob) {
  server::BatchTable table_of_batches(*database);
  server::DeliveryTable deliveries(*database);
  server::BatchService batches(*jobs, *table, table_of_batches, log);
  auto request = api::parse_batch(
      R"({"template": {"scene": "cornell-box", "film": {"width": 64, "height": 40}, "stop":)"
      R"( {"samples_per_pixel": )" +
      std::to_string(kForever) +
      R"(}}, "matrix": {"seed": [1, 2]}, "webhook": {"url": "http://127.0.0.1:9/"}})");
  ASSERT_TRUE(request) << request.problem().detail;
  const auto made = batches.submit(*std::move(request), Access::operators(), "", "");
  ASSERT_TRUE(made) << made.problem().detail;
  const auto both = batches.jobs(made->batch.id, Access::operators());
  ASSERT_TRUE(both);
  ASSERT_EQ(both->size(), 2U);
  const server::JobPointer& second = (*both)[1];
  ASSERT_TRUE(jobs->patch(second, R"({"paused": true})", std::nullopt, Access::operators()));
  server::JobRecord ended = second->record();
  ended.view.state = api::JobState::kCancelled;
  ASSERT_TRUE(table->update(server::to_row(ended), {}, {}));
  ASSERT_TRUE(jobs->cancel((*both)[0]));
  EXPECT_EQ(*deliveries.pending_count(), 0);
  ASSERT_TRUE(jobs->cancel(second));
  const auto calls = deliveries.list({}, Access::operators());
  ASSERT_TRUE(calls);
  ASSERT_EQ(calls->size(), 1U);
  EXPECT_NE(calls->front().body.find(R"("cancelled":2)"), std::string::npos) << calls->front().body;
}

}  // namespace
