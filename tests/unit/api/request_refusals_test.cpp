// Refusals of queries and of bodies besides those of new jobs: request_refusals.txt.
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "api/job/job_spec.h"
#include "api/queries/queries.h"
#include "api/requests.h"
#include "tests/unit/api/refusals.h"

namespace {

using Outcome = std::optional<api::Problem>;
using Query = std::vector<std::pair<std::string, std::string>>;

template <typename T>
Outcome outcome_of(const api::Parsed<T>& parsed) {
  return parsed ? Outcome() : parsed.problem();
}

/// Splits "?a=b&c=d".
Query query_of(const std::string& text) {
  Query query;
  std::istringstream parts(text.substr(1));
  for (std::string part; std::getline(parts, part, '&');) {
    const std::size_t equals = part.find('=');
    query.emplace_back(part.substr(0, equals), part.substr(equals + 1));
  }
  return query;
}

const std::vector<std::string> kToneMaps = {"srgb", "linear", "aces"};

api::JobSpec current_spec() {
  auto parsed = api::parse_job(
      R"({"scene":"x","name":"old","labels":{"a":"1","b":"2"},"priority":3,)"
      R"("stop":{"samples_per_pixel":64,"relative_error":0.05,"scope":"worst_tile"}})");
  EXPECT_TRUE(parsed);
  return parsed->spec;
}

using Parse = std::function<Outcome(const std::string&)>;

template <typename T>
Parse query(api::Parsed<T> (*parse)(api::QueryParams)) {
  return [parse](const std::string& text) { return outcome_of(parse(query_of(text))); };
}

/// What parses the query or the body of an operation.
const std::map<std::string, Parse> kRequests = {
    {"listJobs?", query(&api::parse_job_list_query)},
    {"listScenes?", query(&api::parse_scene_list_query)},
    {"createJob?", query(&api::parse_submit_query)},
    {"createScene?", query(&api::parse_scene_upload_query)},
    {"getJob?", query(&api::parse_wait_query)},
    {"getServer?", query(&api::parse_no_query)},
    {"watchJobs?", query(&api::parse_events_query)},
    {"streamTiles?", query(&api::parse_tiles_query)},
    {"getImage?",
     [](const auto& text) {
       return outcome_of(api::parse_image_query(query_of(text), kToneMaps));
     }},
    {"patchJob",
     [](const auto& body) { return outcome_of(api::parse_job_patch(body, current_spec())); }},
    {"extendJob",
     [](const auto& body) { return outcome_of(api::parse_extend(body, current_spec())); }},
    {"createScene",
     [](const auto& body) { return outcome_of(api::parse_scene_from_assets(body)); }},
    {"createComparison", [](const auto& body) { return outcome_of(api::parse_comparison(body)); }},
    {"mergeFilms", [](const auto& body) { return outcome_of(api::parse_merge(body)); }},
};

TEST(RequestRefusals, HaveTheStatusThePointersAndTheReasons) {
  std::set<std::string> seen;
  for (const test_support::Refusal& refusal :
       test_support::refusals_in(TESSERA_SOURCE_DIR "/tests/unit/api/request_refusals.txt")) {
    SCOPED_TRACE(refusal.request);
    ASSERT_FALSE(refusal.errors.empty());
    const std::size_t end = refusal.request.find(' ');
    const std::string text = refusal.request.substr(refusal.request.find(' ', end + 1) + 1);
    const std::string name = refusal.request.substr(0, end) + (text.starts_with('?') ? "?" : "");
    ASSERT_TRUE(kRequests.contains(name)) << name;
    seen.insert(name);
    const Outcome problem = kRequests.at(name)(text);
    ASSERT_TRUE(problem);
    EXPECT_EQ(problem->status, std::stoi(refusal.request.substr(end + 1)));
    EXPECT_EQ(problem->errors, refusal.errors);
  }
  EXPECT_EQ(seen.size(), kRequests.size());
}

}  // namespace
