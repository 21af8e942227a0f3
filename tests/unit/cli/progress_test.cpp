#include "clients/cli/progress.h"

#include <gtest/gtest.h>

#include "clients/cli/job_json.h"

namespace {

cli::ProgressFacts half_done() {
  cli::ProgressFacts facts;
  facts.fraction = 0.5;
  facts.samples_per_pixel = 128;
  facts.elapsed_seconds = 12;
  facts.relative_error = 0.0231;
  facts.error_low = 0.021;
  facts.error_high = 0.0254;
  facts.rays_per_second = 4.21e6;
  facts.eta_seconds = 75;
  return facts;
}

/// Columns on a terminal: bytes that do not continue a UTF-8 character.
int columns(const std::string& text) {
  int count = 0;
  for (const char c : text) {
    count += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  }
  return count;
}

TEST(ProgressText, ContainsEveryValue) {
  EXPECT_EQ(
      cli::progress_text(half_done()),
      "rendering  50%  128 samples  error 2.31% (2.10 to 2.54)  4.21 Mrays/s  ETA 1 min 15 s");
}

TEST(ProgressText, OmitsSpeedAndRemainingTimeOfAPausedJob) {
  cli::ProgressFacts facts = half_done();
  facts.state = "paused";
  EXPECT_EQ(cli::progress_text(facts),
            "paused  50%  128 samples  error 2.31% (2.10 to 2.54)  12 s");
}

TEST(ProgressText, OmitsAnUnknownError) {
  cli::ProgressFacts facts;
  facts.samples_per_pixel = 1;
  facts.elapsed_seconds = 0.5;
  EXPECT_EQ(cli::progress_text(facts), "rendering  0%  1 samples  0.50 s");
}

TEST(ProgressText, NamesAnUnreliableError) {
  const auto text = [](const char* job) {
    return cli::interval_text(cli::facts_of(cli::parse_object(job)));
  };
  EXPECT_EQ(text(R"({"error": {"relative": 0.5, "unreliable": true}})"), "error 50.0%, unreliable");
  EXPECT_EQ(text(R"({"error": {"relative": 0.5, "unreliable": false}})"), "error 50.0%");
}

TEST(ClosingText, TellsCpuTimeApart) {
  const char* job = R"({"state": "finished", "stop_reason": "seconds", "error": {"relative": 0.5},
      "progress": {"samples_per_pixel": {"mean": 32}, "elapsed_seconds": 1544,
                   "cpu_seconds": 200}})";
  EXPECT_EQ(cli::closing_text(cli::parse_object(job)),
            "finished (seconds): 32 samples in 25 min 44 s (3 min 20 s of CPU time), error 50.0%");
}

TEST(ProgressText, NeverShowsAHundredPercentBeforeTheEnd) {
  for (const double fraction : {0.99, 0.994, 0.996, 0.9999, std::nextafter(1.0, 0.0)}) {
    cli::ProgressFacts facts = half_done();
    facts.fraction = fraction;
    for (const std::string& text :
         {cli::progress_text(facts), cli::progress_bar(facts, 100, false)}) {
      EXPECT_NE(text.find(" 99%"), std::string::npos) << text;
      EXPECT_EQ(text.find("100%"), std::string::npos) << text;
    }
  }
}

TEST(ProgressBar, FitsTheTerminal) {
  for (const bool unicode : {false, true}) {
    for (int width = 20; width <= 200; ++width) {
      EXPECT_LE(columns(cli::progress_bar(half_done(), width, unicode)), width) << width;
    }
  }
}

TEST(ProgressBar, ShowsTheRemainingTimeIn80Columns) {
  const std::string bar = cli::progress_bar(half_done(), 79, false);
  EXPECT_EQ(bar.substr(bar.find(']') + 1),
            "  50%  128 samples  error 2.31%  4.21 Mrays/s  ETA 1 min 15 s");
}

TEST(ProgressBar, KeepsTheTimeLongerThanTheSpeed) {
  const std::string bar = cli::progress_bar(half_done(), 64, false);
  EXPECT_EQ(bar.substr(bar.find(']') + 1), "  50%  128 samples  error 2.31%  ETA 1 min 15 s");
}

TEST(ProgressBar, IsFilledByTheFractionOfTheImage) {
  const std::string bar = cli::progress_bar(half_done(), 200, false);
  EXPECT_EQ(bar.substr(0, bar.find(']') + 1),
            "[" + std::string(15, '#') + std::string(15, '-') + "]");
}

TEST(DurationText, SelectsTheUnit) {
  EXPECT_EQ(cli::duration_text(0.04), "0.04 s");
  EXPECT_EQ(cli::duration_text(9.94), "9.9 s");
  EXPECT_EQ(cli::duration_text(59.4), "59 s");
  EXPECT_EQ(cli::duration_text(200), "3 min 20 s");
  EXPECT_EQ(cli::duration_text(7500), "2 h 5 min");
  EXPECT_EQ(cli::duration_text(1e12), "long");
}

}  // namespace
