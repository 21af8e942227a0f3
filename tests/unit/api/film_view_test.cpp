#include "api/answers/film_view.h"

#include <gtest/gtest.h>

namespace {

using Differences = std::vector<std::string>;

api::JobSpec spec_of(const std::string& body) {
  auto parsed = api::parse_job(body);
  EXPECT_TRUE(parsed) << body;
  return parsed->spec;
}

TEST(FilmText, HasTheMembersThatAMergeRequires) {
  api::JobView job;
  job.id = "01234567-89ab-cdef-0123-456789abcdef";
  job.spec =
      spec_of(R"({"scene":"glass","seed":7,"sampler":{"replicates":4,"first_replicate":2}})");
  job.state = api::JobState::kFinished;
  job.stop_reason = core::StopReason::kRelativeError;
  job.progress.elapsed_seconds = 2.5;
  job.build = R"({"id":"abc"})";
  job.is_doubted = true;
  const std::string text = api::film_text(job, {{7, 2, 4, 64}}, "d1");
  const auto origin = api::parse_film_text(text);
  ASSERT_TRUE(origin) << text;
  EXPECT_TRUE(api::same_spec(origin->spec, job.spec));
  EXPECT_EQ(origin->stop_reason, core::StopReason::kRelativeError);
  EXPECT_EQ(origin->elapsed_seconds, 2.5);
  EXPECT_EQ(origin->build, R"({"id":"abc"})");
  EXPECT_TRUE(origin->is_doubted);
  EXPECT_NE(
      text.find(
          R"("samples":[{"seed":7,"first_replicate":2,"replicates":4,"samples_per_pixel":64}])"),
      std::string::npos);
}

TEST(FilmText, RefusesTextsThatItDoesNotWrite) {
  for (const char* text :
       {"", "x", "[]", "{}",
        R"({"version":2,"spec":{"scene":"x"},"stop_reason":"","elapsed_seconds":0})",
        R"({"version":1,"stop_reason":"","elapsed_seconds":0})",
        R"({"version":1,"spec":{"scene":"x"},"stop_reason":"bored","elapsed_seconds":0})",
        R"({"version":1,"spec":{"scene":"x"},"stop_reason":"","elapsed_seconds":-1})",
        R"({"version":1,"spec":{"scene":"x"},"stop_reason":"","elapsed_seconds":"1"})",
        R"({"version":1,"spec":{"scene":"x","colour":1},"stop_reason":"","elapsed_seconds":0})"}) {
    EXPECT_FALSE(api::parse_film_text(text)) << text;
  }
}

TEST(FilmDifferences, AreThoseOfTheImage) {
  const auto first = spec_of(R"({"scene":"glass"})");
  EXPECT_EQ(api::film_differences(
                first, spec_of(R"({"scene":"glass","seed":3,"name":"n","labels":{"a":"b"},
      "priority":4,"sampler":{"replicates":8,"first_replicate":2},"stop":{"seconds":4}})")),
            Differences());
  EXPECT_EQ(api::film_differences(first, spec_of(R"({"scene":"interior"})")),
            Differences{"/scene"});
  EXPECT_EQ(api::film_differences(first,
                                  spec_of(R"({"scene":"glass","sampler":{"type":"independent"}})")),
            Differences{"/sampler/type"});
  const Differences film = {"/film/width", "/film/filter/type", "/film/layers"};
  EXPECT_EQ(
      api::film_differences(
          first,
          spec_of(R"({"scene":"glass","film":{"width":9,"filter":{"type":"box"},"layers":[]}})")),
      film);
  EXPECT_EQ(api::film_differences(first, spec_of(R"({"scene":"glass","environment":null})")),
            Differences{"/environment"});
}

TEST(Ledger, IsRestoredFromTheStore) {
  const core::SampleLedger ledger = {{0, 0, 2, 8}, {(std::uint64_t{1} << 53U) - 1, 4, 6, 96}};
  const auto back = api::parse_ledger(api::ledger_json(ledger));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, ledger);
  EXPECT_EQ(api::ledger_json({}), "");
  EXPECT_TRUE(api::parse_ledger("")->empty());
  EXPECT_FALSE(api::parse_ledger(R"([{"seed":-1}])"));
  EXPECT_FALSE(api::parse_ledger("[1]"));
}

}  // namespace
