#include "server/jobs/event_log.h"

#include <thread>

#include <gtest/gtest.h>

namespace {

using api::EventType;
using server::EventLog;
using server::LoggedEvent;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

LoggedEvent durable(std::uint64_t seq, EventType type, std::string data) {
  LoggedEvent event;
  event.seq = seq;
  event.type = type;
  event.data = std::move(data);
  return event;
}

void tell(EventLog& log, EventType type, std::string data) {
  log.publish({durable(log.reserve(1), type, std::move(data))});
}

// A run may be stopped between a change of its film and its announcement, for seconds; meanwhile
// the job was parked, and goes on in another.
TEST(EventLog, OlderRevisionsOfATileAreNotAnnounced) {
  EventLog log;
  log.tile_changed(0, 65539);
  log.tile_changed(0, 2);
  log.tile_changed(1, 2);
  const auto events = log.read_after(0, 100);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].revision, 65539U);
  EXPECT_EQ(events[1].tile, 1);
  EXPECT_EQ(log.last_seq(), 2U);
}

TEST(EventLog, NumbersAreInOrderOfPublication) {
  EventLog log;
  tell(log, EventType::kState, "a");
  log.tile_changed(3, 1);
  tell(log, EventType::kWarning, "b");
  const auto events = log.read_after(0, 100);
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].data, "a");
  EXPECT_EQ(events[1].tile, 3);
  EXPECT_EQ(events[2].data, "b");
  EXPECT_LT(events[0].seq, events[1].seq);
  EXPECT_LT(events[1].seq, events[2].seq);
  EXPECT_EQ(log.read_after(events[1].seq, 100).size(), 1U);
}

TEST(EventLog, KeepsOnlyTheNewestRevisionOfATile) {
  EventLog log;
  for (std::uint32_t revision = 1; revision <= 1000; ++revision) {
    log.tile_changed(static_cast<int>(revision % 2), revision);
  }
  const auto events = log.read_after(0, 100);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].revision, 999U);
  EXPECT_EQ(events[1].revision, 1000U);
}

TEST(EventLog, HidesNumbersAboveAReservedOneUntilItIsPublished) {
  EventLog log;
  const std::uint64_t first = log.reserve(2);
  log.tile_changed(0, 1);
  EXPECT_TRUE(log.read_after(0, 100).empty());
  EXPECT_EQ(log.last_seq(), first - 1);
  log.publish({durable(first, EventType::kState, "a"), durable(first + 1, EventType::kEnd, "b")});
  EXPECT_EQ(log.read_after(0, 100).size(), 3U);
}

TEST(EventLog, DroppedNumbersDoNotBlockLaterOnes) {
  EventLog log;
  const std::uint64_t first = log.reserve(2);
  log.tile_changed(0, 1);
  log.drop(first, 2);
  EXPECT_EQ(log.read_after(0, 100).size(), 1U);
}

TEST(EventLog, PartialTileReadsSkipNoNumber) {
  EventLog log;
  for (int tile = 0; tile < 10; ++tile) {
    log.tile_changed(tile, static_cast<std::uint32_t>(tile + 1));
  }
  tell(log, EventType::kState, "last");
  std::uint64_t seq = 0;
  std::size_t tiles = 0;
  bool saw_state = false;
  for (int look = 0; look < 10 && !saw_state; ++look) {
    for (const auto& event : log.read_after(seq, 3)) {
      tiles += event.type == EventType::kTile ? 1U : 0U;
      saw_state = saw_state || event.type == EventType::kState;
      seq = event.seq;
    }
  }
  EXPECT_EQ(tiles, 10U);
  EXPECT_TRUE(saw_state);
}

TEST(EventLog, KeepsOneProgressEvent) {
  EventLog log;
  log.progress_changed();
  log.progress_changed();
  EXPECT_EQ(log.read_after(0, 100).size(), 1U);
}

TEST(EventLog, WaitEndsWithTheNextEvent) {
  EventLog log;
  std::jthread teller([&log] {
    std::this_thread::sleep_for(milliseconds(20));
    log.tile_changed(0, 1);
  });
  EXPECT_TRUE(log.wait_after(0, EventLog::Wake::kAnything, Clock::now() + milliseconds(10000), {}));
}

TEST(EventLog, WaitForDurableEventsIgnoresTiles) {
  EventLog log;
  log.tile_changed(0, 1);
  EXPECT_FALSE(log.wait_after(0, EventLog::Wake::kDurable, Clock::now() + milliseconds(20), {}));
  tell(log, EventType::kState, "a");
  EXPECT_TRUE(log.wait_after(0, EventLog::Wake::kDurable, Clock::now() + milliseconds(20), {}));
}

TEST(EventLog, StopEndsAWait) {
  EventLog log;
  std::stop_source stop;
  std::jthread stopper([&stop] {
    std::this_thread::sleep_for(milliseconds(20));
    stop.request_stop();
  });
  EXPECT_FALSE(log.wait_after(0, EventLog::Wake::kAnything, Clock::now() + milliseconds(10000),
                              stop.get_token()));
}

TEST(EventLog, ReadersGetEveryDurableEventUnderTileLoad) {
  EventLog log;
  constexpr int kTold = 200;
  std::jthread renderer([&log](const std::stop_token& stop) {
    for (std::uint32_t revision = 1; !stop.stop_requested(); ++revision) {
      log.tile_changed(static_cast<int>(revision % 64), revision);
    }
  });
  std::jthread teller([&log] {
    for (int i = 0; i < kTold; ++i) {
      tell(log, EventType::kState, std::to_string(i));
    }
  });
  std::uint64_t seq = 0;
  int seen = 0;
  const auto deadline = Clock::now() + milliseconds(30000);
  while (seen < kTold && Clock::now() < deadline) {
    for (const auto& event : log.read_after(seq, 16)) {
      EXPECT_GT(event.seq, seq);
      seq = event.seq;
      if (event.type == EventType::kState) {
        EXPECT_EQ(event.data, std::to_string(seen));
        ++seen;
      }
    }
  }
  EXPECT_EQ(seen, kTold);
}

}  // namespace
