#include "server/routes/tile_stream.h"

#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using server::TileFrames;

api::TileFrame frame_of(float value, int side = 2) {
  api::TileFrame frame;
  frame.rect = {0, 0, side, side};
  frame.flags = api::kTileMean;
  frame.planes.assign(static_cast<std::size_t>(3 * side * side), value);
  return frame;
}

class Frames : public testing::Test {
 protected:
  std::string get(const TileFrames::Key& key, float value = 0) {
    return *frames.get(key, [&] {
      ++made;
      return frame_of(value);
    });
  }
  TileFrames frames;
  int made = 0;
};

TEST_F(Frames, AreEncodedOnceForAllReaders) {
  const TileFrames::Key key = {.job = 1, .tile = 2, .revision = 3, .flags = api::kTileMean};
  const std::string first = get(key, 0.5F);
  EXPECT_EQ(get(key, 0.75F), first);
  EXPECT_EQ(first, api::encode_tile_frame(frame_of(0.5F)));
  EXPECT_EQ(made, 1);
}

TEST_F(Frames, DifferByJobTileRevisionAndFlags) {
  const TileFrames::Key key = {.job = 1, .tile = 2, .revision = 3, .flags = 0};
  get(key);
  auto other = key;
  other.job = 12;
  get(other);
  other = key;
  other.tile = 23;
  get(other);
  other = key;
  other.revision = 4;
  get(other);
  other = key;
  other.flags = api::kTileMean;
  get(other);
  EXPECT_EQ(made, 5);
}

TEST_F(Frames, TakeAtMostTheirLimit) {
  const int side = 128;
  const std::uint64_t bytes = api::encode_tile_frame(frame_of(0, side)).size();
  const auto count = static_cast<int>(2 * TileFrames::kBytes / bytes);
  for (int tile = 0; tile < count; ++tile) {
    frames.get({.job = 1, .tile = tile}, [&] { return frame_of(0, side); });
    ASSERT_LE(frames.bytes(), TileFrames::kBytes);
  }
  EXPECT_GT(frames.bytes(), TileFrames::kBytes / 2);
  get({.job = 1, .tile = 0});
  EXPECT_EQ(made, 1) << "the oldest frame was dropped";
}

/// Collects until it has that many bytes.
class Collector final : public server::StreamWriter {
 public:
  explicit Collector(std::size_t bytes) : bytes_(bytes) {}
  bool write(std::string_view bytes) override {
    text += bytes;
    return text.size() < bytes_;
  }
  bool client_gone() const override { return text.size() >= bytes_; }
  bool stopping() const override { return false; }
  std::stop_token stop_token() const override { return {}; }
  std::string text;

 private:
  const std::size_t bytes_;
};

class Tiles : public test_support::JobsFixture {};

TEST_F(Tiles, OfAJobAreTheSameBytesInEveryStream) {
  auto job = submit(test_support::kForever);
  ASSERT_TRUE(wait_for_samples(job));
  ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
  const std::string id = job->id();
  job.reset();
  restart();  // Slices that were active at the pause have ended.
  job = *jobs->find(id, server::Access::operators());
  ASSERT_EQ(job->state(), JobState::kPaused);
  const auto film = *jobs->films().film(*job);

  std::string expected;
  for (int tile = 0; tile < film->tile_count(); ++tile) {
    api::TileFrame frame = server::tile_frame(*film->shown_tile(tile), film->replicates(), 0);
    frame.flags |= film->errors() == core::PixelErrors::kCorrelated ? api::kTileCorrelated : 0U;
    frame.revision = film->tile_revision(tile);
    frame.relative_error = core::tile_error(*film, tile);
    expected += api::encode_tile_frame(frame);
  }
  server::BatchTable batches(*database);
  server::DenoiseService denoising(*jobs, batches, *memory, log);
  TileFrames frames;
  const server::StreamGate gate(8);
  for (int i = 0; i < 2; ++i) {
    Collector client(expected.size());
    server::TileStream({*jobs, denoising, frames, gate}, job, {}).run(client);
    EXPECT_TRUE(client.text == expected) << "stream " << i;
  }
  EXPECT_EQ(frames.bytes(), expected.size());
}

}  // namespace
