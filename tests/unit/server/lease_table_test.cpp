// LeaseTable under a clock that only the test moves.
#include "server/workers/lease_table.h"

#include <gtest/gtest.h>

#include "server/jobs/job.h"

namespace server {
namespace {

using core::ErrorCode;
using std::chrono::milliseconds;
using std::chrono::seconds;

class LeaseTableTest : public testing::Test {
 protected:
  static constexpr int kLease = 15;
  static constexpr std::uint64_t kSeed = 1;

  LeaseTableTest() { options_.lease_seconds = kLease; }

  static LeaseTable::Sender sender(const std::string& worker) { return {worker, "key " + worker}; }

  /// Returns the orders.
  api::WorkerOrders report(const std::string& worker, std::map<std::string, double> units = {}) {
    api::WorkerReport sent;
    sent.threads = 2;
    sent.units = std::move(units);
    auto orders = table_.report(sender(worker), sent, now_, 0);
    EXPECT_TRUE(orders);
    return orders ? *orders : api::WorkerOrders();
  }
  /// Reports of all of these workers until the time has passed, so that none is taken for lost.
  void pass(seconds time, const std::vector<std::string>& workers = {}) {
    for (int s = 0; s < time.count(); ++s) {
      now_ += seconds(1);
      for (const std::string& worker : workers) {
        report(worker);
      }
    }
  }
  void add(const std::string& name) {
    WorkUnit unit;
    unit.job = job_;
    unit.pixel_samples = 1000;
    unit.expected_seconds = 2;
    table_.add(name, std::move(unit), now_);
  }
  /// The code of the error; empty: the worker has the unit now.
  std::optional<ErrorCode> lease(const std::string& name, const std::string& worker) {
    const auto unit = table_.lease(name, sender(worker), now_);
    return unit ? std::nullopt : std::optional(unit.error().code);
  }
  static LeaseTable::Work work(int tile) {
    LeaseTable::Work work(1);
    work.front().slice.tile = tile;
    return work;
  }
  LeaseTable::Taken take(const std::string& name, const std::string& worker,
                         LeaseTable::Work work) {
    EXPECT_TRUE(table_.begin_result(name, sender(worker)));
    auto taken = table_.take_result(name, worker, std::move(work), 100, now_);
    EXPECT_TRUE(taken);
    return taken ? *std::move(taken) : LeaseTable::Taken();
  }
  std::string state_of(const std::string& worker) {
    for (const api::WorkerView& view : table_.workers(now_)) {
      if (view.id == worker) {
        return view.state;
      }
    }
    return "absent";
  }
  bool is_hopeless(const std::string& name) {
    const auto names = table_.hopeless(now_);
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  Log log_{LogLevel::kError};
  WorkOptions options_;
  LeaseTable table_{options_, log_, kSeed};
  LeaseTable::Time now_ = LeaseTable::Time() + std::chrono::hours(1);
  JobPointer job_ = std::make_shared<Job>(JobRecord(), Job::History::kInLog);
};

TEST_F(LeaseTableTest, ProgressAndNothingElseExtendsALease) {
  report("a");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  now_ += seconds(10);
  report("a", {{"u", 1.5}});  // until 25 s
  now_ += seconds(10);
  report("a", {{"u", 1.5}});  // no progress
  table_.expire(now_);
  EXPECT_TRUE(table_.held("u", sender("a")));
  now_ += seconds(5);
  table_.expire(now_);
  EXPECT_TRUE(table_.held("u", sender("a"))) << "the lease ends after 25 s, not at them";
  now_ += milliseconds(1);
  table_.expire(now_);
  EXPECT_EQ(table_.held("u", sender("a")).error().code, ErrorCode::kConflict);
  EXPECT_EQ(table_.counts().expired, 1U);
}

TEST_F(LeaseTableTest, AWorkerOfAnotherArchitectureIsUnsuitableForThatReason) {
  api::WorkerReport sent;
  sent.build = "b";
  sent.arithmetic = "embree 3.13.5, neon, arm64, glibc 2.36";
  options_.build = "a";
  options_.arithmetic = "embree 3.13.5, avx2, GenuineIntel, glibc 2.36";
  LeaseTable table(options_, log_, kSeed);
  const auto orders = table.report(sender("w"), sent, now_, 0);
  ASSERT_TRUE(orders);
  EXPECT_EQ(orders->reason.substr(0, 49), "its processor is arm64, the server's is x86-64; t");
  options_.arithmetic = sent.arithmetic;
  LeaseTable same(options_, log_, kSeed);
  EXPECT_EQ(same.report(sender("w"), sent, now_, 0)->reason, "its build is b, the server's is a");
}

TEST_F(LeaseTableTest, TheSeedDrawsTheUnitsThatAreVerified) {
  options_.verify_share = 0.5;
  const auto drawn = [this](std::uint64_t seed) {
    LeaseTable table(options_, log_, seed);
    std::vector<bool> are_checked;
    for (int i = 0; i < 64; ++i) {
      const std::string name = std::to_string(i);
      table.add(name, WorkUnit(), now_);
      are_checked.push_back(table.units().at(name).is_checked);
    }
    return are_checked;
  };
  EXPECT_EQ(drawn(kSeed), drawn(kSeed));
  EXPECT_NE(drawn(kSeed), drawn(kSeed + 1));
}

TEST_F(LeaseTableTest, ALostUnitGoesToAnotherWorkerAndItsResultIsRefused) {
  report("a");
  report("b");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  pass(seconds(kLease + 1), {"a", "b"});
  table_.expire(now_);
  EXPECT_EQ(table_.begin_result("u", sender("a")).error().code, ErrorCode::kConflict);
  EXPECT_EQ(report("a", {{"u", 3}}).dropped, std::vector<std::string>{"u"});
  pass(seconds(1), {"a", "b"});  // a rests for a second
  EXPECT_EQ(lease("u", "a"), ErrorCode::kUnavailable) << "meant for b, which has not failed it";
  EXPECT_EQ(lease("u", "b"), std::nullopt);
  EXPECT_TRUE(take("u", "b", work(1)).work);
  table_.close("u");
  EXPECT_EQ(table_.begin_result("u", sender("b")).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(table_.counts().taken, 1U);
}

TEST_F(LeaseTableTest, AWorkerThatFailsRestsForTwiceAsLongEachTime) {
  report("a");
  for (const int rest : {1, 2, 4, 8, 16, 32, 64, 64}) {
    add("u");
    ASSERT_EQ(lease("u", "a"), std::nullopt);
    ASSERT_TRUE(table_.hand_back("u", sender("a"), "disk full", now_));
    EXPECT_EQ(report("a").reason.substr(0, 15),
              "it rests for " + std::to_string(rest) + (rest < 10 ? " " : ""));
    pass(seconds(rest - 1), {"a"});
    EXPECT_EQ(state_of("a"), "suspended");
    EXPECT_EQ(lease("u", "a"), ErrorCode::kUnavailable);
    pass(seconds(1), {"a"});
    EXPECT_EQ(state_of("a"), "idle");
    table_.remove_if([](const WorkUnit&) { return true; });
  }
  // A result that is accepted after its rest ends the row.
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  EXPECT_TRUE(take("u", "a", work(1)).work);
  table_.close("u");
  add("v");
  ASSERT_EQ(lease("v", "a"), std::nullopt);
  ASSERT_TRUE(table_.hand_back("v", sender("a"), "disk full", now_));
  EXPECT_EQ(report("a").reason.substr(0, 14), "it rests for 1");
}

TEST_F(LeaseTableTest, AFailedUnitIsHopelessOnlyOnceNoWorkerCouldTakeIt) {
  report("a");
  report("b");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  ASSERT_TRUE(table_.hand_back("u", sender("a"), "no memory", now_));
  EXPECT_FALSE(is_hopeless("u")) << "b may take it";
  ASSERT_EQ(lease("u", "b"), std::nullopt);
  EXPECT_FALSE(is_hopeless("u")) << "b renders it";
  ASSERT_TRUE(table_.hand_back("u", sender("b"), "no memory", now_));
  EXPECT_TRUE(is_hopeless("u"));
  table_.begin_own("u");
  EXPECT_FALSE(is_hopeless("u")) << "the coordinator renders it";
  EXPECT_EQ(table_.counts().own, 1U);
}

TEST_F(LeaseTableTest, ThreeWorkersLostWithAUnitAreReported) {
  for (const char* worker : {"a", "b", "c"}) {
    report(worker);
  }
  add("u");
  int lost = 0;
  for (const char* worker : {"a", "b", "c"}) {
    ASSERT_EQ(lease("u", worker), std::nullopt) << worker;
    pass(seconds(kLease + 1), {"a", "b", "c"});
    EXPECT_EQ(table_.expire(now_).size(), ++lost == 3 ? 1U : 0U) << worker;
  }
}

TEST_F(LeaseTableTest, AWorkersIdBelongsToTheKeyThatReportedItFirst) {
  report("a");
  add("u");
  const LeaseTable::Sender thief = {"a", "another key"};
  EXPECT_EQ(table_.report(thief, {}, now_, 0).error().code, ErrorCode::kForbidden);
  EXPECT_EQ(table_.lease("u", thief, now_).error().code, ErrorCode::kForbidden);
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  EXPECT_EQ(table_.begin_result("u", thief).error().code, ErrorCode::kForbidden);
  EXPECT_EQ(table_.hand_back("u", thief, "", now_).error().code, ErrorCode::kForbidden);
}

TEST_F(LeaseTableTest, OnlyTheHolderOfAUnitAnswersForIt) {
  report("a");
  report("b");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  EXPECT_EQ(table_.held("u", sender("b")).error().code, ErrorCode::kConflict);
  EXPECT_EQ(table_.begin_result("u", sender("b")).error().code, ErrorCode::kConflict);
  EXPECT_EQ(table_.hand_back("u", sender("b"), "", now_).error().code, ErrorCode::kConflict);
  EXPECT_TRUE(table_.begin_result("u", sender("a")));
}

TEST_F(LeaseTableTest, OneResultIsTakenAtATime) {
  report("a");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  ASSERT_TRUE(table_.begin_result("u", sender("a")));
  EXPECT_EQ(table_.begin_result("u", sender("a")).error().code, ErrorCode::kUnavailable);
  pass(seconds(2 * kLease), {"a"});
  table_.expire(now_);
  EXPECT_TRUE(table_.held("u", sender("a"))) << "its result has arrived";
  table_.cancel("u");
  EXPECT_TRUE(table_.begin_result("u", sender("a")));
}

TEST_F(LeaseTableTest, AResultReadWhileTheBoardStoppedIsRefused) {
  report("a");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  ASSERT_TRUE(table_.begin_result("u", sender("a")));
  table_.clear();
  const auto taken = table_.take_result("u", "a", work(1), 100, now_);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kNotFound);
}

TEST_F(LeaseTableTest, AReservedUnitIsNotRemovedButNoLongerRenderedHere) {
  report("a");
  add("u");
  add("v");
  table_.begin_own("u");
  const auto removed = table_.remove_if([](const WorkUnit&) { return true; });
  EXPECT_EQ(removed.size(), 1U);
  ASSERT_TRUE(table_.units().contains("u"));
  EXPECT_TRUE(table_.units().at("u").own.stop_requested());
}

TEST_F(LeaseTableTest, ALongUnitAtTheEndOfAPassIsGivenToAnIdleWorkerToo) {
  report("a");
  report("b");
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  pass(seconds(2), {"a", "b"});
  table_.double_last_units(now_);
  EXPECT_EQ(lease("u", "b"), ErrorCode::kConflict) << "it takes as long as was expected";
  pass(seconds(1), {"a", "b"});
  table_.double_last_units(now_);
  EXPECT_EQ(lease("u", "a"), ErrorCode::kUnavailable) << "it has it already";
  EXPECT_EQ(lease("u", "b"), std::nullopt);
  EXPECT_TRUE(take("u", "b", work(1)).work);
  table_.close("u");
  EXPECT_EQ(table_.take_to_report(), std::set<std::string>{"a"}) << "a should stop rendering it";
}

TEST_F(LeaseTableTest, NamesArePublishedAgainOnlyIfMessagesAreMissing) {
  report("a");
  add("u");
  add("v");
  EXPECT_EQ(table_.take_to_publish(now_), (std::vector<std::string>{"u", "v"}));
  EXPECT_TRUE(table_.take_to_publish(now_).empty());
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  EXPECT_EQ(table_.messages_expected(now_ + seconds(2 * kLease)), std::nullopt);
  now_ += seconds(2 * kLease) + milliseconds(1);
  EXPECT_EQ(table_.messages_expected(now_), 2U) << "v waits, and a keeps the message of u";
  table_.note_messages(false, now_);
  EXPECT_TRUE(table_.take_to_publish(now_).empty());
  now_ += seconds(2 * kLease) + milliseconds(1);
  table_.note_messages(true, now_);
  EXPECT_EQ(table_.take_to_publish(now_), std::vector<std::string>{"v"});
}

/// Every unit is rendered by two workers.
class VerifiedUnitsTest : public LeaseTableTest {
 protected:
  VerifiedUnitsTest() {
    options_.verify_share = 1;
    report("a");
    report("b");
  }
};

TEST_F(VerifiedUnitsTest, TheCoordinatorVerifiesASingleWorker) {
  pass(seconds(kLease), {"a"});
  for (const int result : {1, 2}) {
    add("u");
    ASSERT_EQ(lease("u", "a"), std::nullopt);
    EXPECT_FALSE(is_hopeless("u"));
    EXPECT_FALSE(take("u", "a", work(result)).work);
    EXPECT_TRUE(is_hopeless("u"));
    table_.begin_own("u");
    EXPECT_FALSE(is_hopeless("u")) << "it is under way";
    EXPECT_EQ(table_.judge("u", core::content_digest(work(1))).empty(), result == 1);
    table_.close("u");
    EXPECT_EQ(state_of("a"), result == 1 ? "idle" : "suspended");
  }
  EXPECT_EQ(table_.counts().verified, 1U);
  EXPECT_EQ(table_.counts().differing, 1U);
}

TEST_F(VerifiedUnitsTest, TheCoordinatorVerifiesWhatNoWorkerDoesInTime) {
  add("u");
  ASSERT_EQ(lease("u", "b"), std::nullopt);
  EXPECT_FALSE(take("u", "b", work(1)).work);
  EXPECT_FALSE(is_hopeless("u")) << "a may still verify it";
  pass(seconds(10), {"a", "b"});
  EXPECT_FALSE(is_hopeless("u")) << "it waits for ten seconds";
  now_ += milliseconds(1);
  EXPECT_TRUE(is_hopeless("u"));
}

TEST_F(VerifiedUnitsTest, EqualResultsAreTakenOnce) {
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  EXPECT_EQ(lease("u", "a"), ErrorCode::kUnavailable) << "two results of one worker prove nothing";
  ASSERT_EQ(lease("u", "b"), std::nullopt);
  EXPECT_FALSE(take("u", "a", work(1)).work);
  const LeaseTable::Taken taken = take("u", "b", work(1));
  EXPECT_TRUE(taken.work);
  EXPECT_FALSE(taken.is_disputed);
  EXPECT_EQ(table_.counts().verified, 1U);
}

TEST_F(VerifiedUnitsTest, TheWorkerWhoseResultDiffersFromTheCoordinatorsIsSuspended) {
  options_.verify_share = 0;
  add("late");
  ASSERT_EQ(lease("late", "b"), std::nullopt);
  ASSERT_TRUE(table_.begin_result("late", sender("b")));

  options_.verify_share = 1;
  add("u");
  add("v");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  ASSERT_EQ(lease("u", "b"), std::nullopt);
  ASSERT_EQ(lease("v", "b"), std::nullopt);
  EXPECT_FALSE(take("v", "b", work(1)).work);
  EXPECT_FALSE(take("u", "a", work(1)).work);
  const LeaseTable::Taken taken = take("u", "b", work(2));
  EXPECT_FALSE(taken.work);
  EXPECT_TRUE(taken.is_disputed);
  table_.begin_own("u");
  EXPECT_EQ(table_.judge("u", core::content_digest(work(1))), std::vector<std::string>{"b"});
  EXPECT_EQ(table_.judge("u", core::content_digest(work(1))), std::vector<std::string>())
      << "it is suspended once";
  table_.close("u");
  EXPECT_EQ(state_of("a"), "idle");
  EXPECT_EQ(state_of("b"), "suspended");
  EXPECT_EQ(lease("v", "b"), ErrorCode::kUnavailable);
  EXPECT_FALSE(table_.units().at("v").first) << "b's other result is not believed";
  const auto late = table_.take_result("late", "b", work(1), 100, now_);
  ASSERT_FALSE(late) << "it was received before, and would be taken unverified";
  EXPECT_EQ(late.error().code, ErrorCode::kConflict);
  EXPECT_EQ(lease("late", "a"), std::nullopt);
  pass(seconds(1000), {"a", "b"});
  EXPECT_EQ(state_of("b"), "suspended") << "until it is restarted";
  now_ += seconds(1000);  // It is forgotten meanwhile.
  table_.expire(now_);
  report("b");
  EXPECT_EQ(state_of("b"), "suspended") << "silence is no restart";
  EXPECT_EQ(table_.counts().suspended, 1U);
}

TEST_F(VerifiedUnitsTest, TwoWorkersOfOneKeyDoNotVerifyEachOtherWhileThereAreOtherKeys) {
  const LeaseTable::Sender twin = {"twin", "key a"};
  api::WorkerReport sent;
  sent.threads = 1;
  ASSERT_TRUE(table_.report(twin, sent, now_, 0));
  add("u");
  ASSERT_EQ(lease("u", "a"), std::nullopt);
  EXPECT_EQ(table_.lease("u", twin, now_).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(lease("u", "b"), std::nullopt);
}

TEST_F(LeaseTableTest, SilentWorkersAreForgottenAfterTenMinutes) {
  report("a");
  pass(seconds(kLease));
  EXPECT_EQ(state_of("a"), "lost");
  pass(seconds(39 * kLease));
  table_.expire(now_);
  EXPECT_EQ(state_of("a"), "lost");
  now_ += milliseconds(1);
  table_.expire(now_);
  EXPECT_EQ(state_of("a"), "absent");
}

}  // namespace
}  // namespace server
