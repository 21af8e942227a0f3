// Jobs and their specs, as a table: job_specs.txt describes its form.
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"

namespace {

using api::Json;

struct Case {
  std::string members;
  std::vector<std::pair<std::string, std::string>> spec{};  ///< pointers and values as JSON
  std::vector<std::string> warnings{};
};

std::vector<Case> all_cases() {
  std::vector<Case> all;
  std::ifstream file(TESSERA_SOURCE_DIR "/tests/unit/api/job_specs.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("    ")) {
      all.back().warnings.back() += line.substr(3);
    } else if (line.starts_with("  warning ")) {
      all.back().warnings.push_back(line.substr(10));
    } else if (line.starts_with("  ")) {
      const std::size_t space = line.find(' ', 2);
      all.back().spec.emplace_back(line.substr(2, space - 2),
                                   space == std::string::npos ? "" : line.substr(space + 1));
    } else if (line.starts_with('"')) {
      all.push_back({line});
    }
  }
  return all;
}

TEST(JobSpecs, AreAsTheTableSays) {
  const std::vector<Case> all = all_cases();
  ASSERT_GT(all.size(), 30U);
  for (const Case& c : all) {
    SCOPED_TRACE(c.members);
    const auto parsed = api::parse_job(R"({"scene":"x",)" + c.members + "}");
    ASSERT_TRUE(parsed) << parsed.problem().detail;
    ASSERT_FALSE(c.spec.empty());
    const Json spec = api::to_json(parsed->spec);
    for (const auto& [pointer, value] : c.spec) {
      const Json::json_pointer at(pointer);
      EXPECT_EQ(spec.contains(at) ? api::dump(spec[at]) : "", value) << pointer;
    }
    EXPECT_EQ(parsed->warnings, c.warnings);
    const auto again = api::parse_job(api::spec_json(parsed->spec));
    ASSERT_TRUE(again) << again.problem().detail;
    EXPECT_TRUE(api::same_spec(again->spec, parsed->spec));
  }
}

}  // namespace
