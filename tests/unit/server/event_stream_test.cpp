#include "server/routes/event_stream.h"

#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;

class Events : public test_support::JobsFixture {
 protected:
  /// A paused job without active slices, which would commit after the pause: the server was
  /// restarted. The stream starts after all past events.
  void SetUp() override {
    test_support::JobsFixture::SetUp();
    job = submit(test_support::kForever);
    ASSERT_TRUE(wait_for_samples(job));
    ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
    const std::string id = job->id();
    job.reset();
    restart();
    job = *jobs->find(id, server::Access::operators());
    ASSERT_EQ(job->state(), JobState::kPaused);
    film = *jobs->films().film(*job);
    stream.emplace(*jobs, job, std::nullopt, gate, server::EventStream::Options{});
    stream->beginning();
  }

  static int tiles_in(const std::string& text) {
    const std::string mark = "event: tile";
    int count = 0;
    for (auto at = text.find(mark); at != std::string::npos; at = text.find(mark, at + 1)) {
      ++count;
    }
    return count;
  }

  server::StreamGate gate{8};
  server::JobPointer job;
  std::shared_ptr<const core::Film> film;
  std::optional<server::EventStream> stream;
};

TEST_F(Events, SendsATileOnceIfItsFilmIsAheadOfTheLog) {
  const std::uint32_t revision = film->tile_revision(0);
  ASSERT_GT(revision, 1U);
  job->log().tile_changed(0, revision - 1);  // the film has the next revision, the log does not
  const std::string first = stream->news();
  job->log().tile_changed(0, revision);
  const std::string second = stream->news();
  EXPECT_EQ(tiles_in(first), 0) << first;
  EXPECT_EQ(tiles_in(second), 1) << second;
  EXPECT_NE(second.find("\"revision\":" + std::to_string(revision) + ","), std::string::npos)
      << second;
}

}  // namespace
