#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/json/schemas.h"
#include "api/queries/queries.h"
#include "api/requests.h"

namespace {

using Query = std::vector<std::pair<std::string, std::string>>;
using Errors = std::vector<api::FieldError>;

const std::vector<std::string> kToneMaps = {"srgb", "linear", "aces"};

template <typename T>
Errors errors_of(const api::Parsed<T>& parsed, int status) {
  EXPECT_FALSE(parsed);
  if (parsed) {
    return {};
  }
  EXPECT_EQ(parsed.problem().status, status);
  return parsed.problem().errors;
}

TEST(JobListQuery, ReadsFilters) {
  const auto list = api::parse_job_list_query(Query{{"state", "queued,rendering"},
                                                    {"state", "paused"},
                                                    {"label", "team=a=b"},
                                                    {"label", "urgent"},
                                                    {"name", "Red Sofa"},
                                                    {"class", "normal"},
                                                    {"cursor", "abc-_9"},
                                                    {"limit", "200"}});
  ASSERT_TRUE(list);
  EXPECT_EQ(list->states, (std::vector{api::JobState::kQueued, api::JobState::kRendering,
                                       api::JobState::kPaused}));
  ASSERT_EQ(list->labels.size(), 2U);
  EXPECT_EQ(list->labels[0].key, "team");
  EXPECT_EQ(list->labels[0].value, "a=b");
  EXPECT_EQ(list->labels[1].key, "urgent");
  EXPECT_FALSE(list->labels[1].value.has_value());
  EXPECT_EQ(list->name, "Red Sofa");
  EXPECT_EQ(list->job_class, api::ListQuery::Class::kNormal);
  EXPECT_EQ(api::parse_job_list_query(Query{})->job_class, api::ListQuery::Class::kNormal);
  EXPECT_EQ(list->cursor, "abc-_9");
  EXPECT_EQ(list->limit, 200);
  EXPECT_EQ(api::parse_job_list_query(Query{})->limit, 50);
}

TEST(JobListQuery, Answers400ToWrongValues) {
  const auto errors = [](Query query) { return errors_of(api::parse_job_list_query(query), 400); };
  EXPECT_EQ(errors({{"state", "done"}}),
            (Errors{{"/state",
                     "'done' is not a state; states: queued, loading, rendering, paused, "
                     "finished, failed, cancelled"}}));
  EXPECT_EQ(errors({{"class", "Preview"}}),
            (Errors{{"/class", "Unknown value 'Preview'; expected one of: normal, preview, all"}}));
  EXPECT_EQ(errors({{"name", ""}}), (Errors{{"/name", "is empty"}}));
  EXPECT_EQ(errors({{"name", std::string(256, 'n')}}),
            (Errors{{"/name", "has 256 characters, outside [1, 255]"}}));
  EXPECT_EQ(errors({{"limit", "0"}}), (Errors{{"/limit", "0 is outside [1, 200]"}}));
  EXPECT_EQ(errors({{"limit", "201"}}), (Errors{{"/limit", "201 is outside [1, 200]"}}));
  EXPECT_EQ(errors({{"limit", "ten"}}),
            (Errors{{"/limit", "expected a whole number, got a string"}}));
  EXPECT_EQ(errors({{"limit", ""}}), (Errors{{"/limit", "expected a whole number, got a string"}}));
  EXPECT_EQ(errors({{"limit", " 5"}}),
            (Errors{{"/limit", "expected a whole number, got a string"}}));
  EXPECT_EQ(errors({{"limit", "1e999"}}),
            (Errors{{"/limit", "expected a whole number, got a string"}}));
  EXPECT_EQ(errors({{"cursor", "a b"}}), (Errors{{"/cursor", "Invalid page cursor 'a b'"}}));
  EXPECT_EQ(errors({{"label", "=x"}}), (Errors{{"/label", "'=x' is not key=value"}}));
  EXPECT_EQ(errors({{"sort", "x"}}), (Errors{{"/sort", "unknown query parameter"}}));
  EXPECT_EQ(errors({{"limit", "1"}, {"limit", "2"}}),
            (Errors{{"/limit", "appears more than once"}}));
}

TEST(SceneListQuery, HasNoFilters) {
  EXPECT_TRUE(api::parse_scene_list_query(Query{{"limit", "5"}, {"cursor", "x"}}));
  EXPECT_EQ(errors_of(api::parse_scene_list_query(Query{{"state", "queued"}}), 400),
            (Errors{{"/state", "unknown query parameter"}}));
}

TEST(SubmitQuery, ParsesDryRun) {
  EXPECT_FALSE(api::parse_submit_query(Query{})->dry_run);
  EXPECT_TRUE(api::parse_submit_query(Query{{"dry_run", "1"}})->dry_run);
  EXPECT_FALSE(api::parse_submit_query(Query{{"dry_run", "0"}})->dry_run);
  EXPECT_EQ(errors_of(api::parse_submit_query(Query{{"dry_run", "yes"}}), 422),
            (Errors{{"/dry_run", "expected true or false, got a string"}}));
}

TEST(SubmitQuery, ParsesPictures) {
  EXPECT_FALSE(api::parse_submit_query(Query{{"dry_run", "1"}})->from_image);
  EXPECT_TRUE(api::parse_submit_query(Query{{"from", "image"}})->from_image);
  EXPECT_EQ(errors_of(api::parse_submit_query(Query{{"from", "film"}}), 422),
            (Errors{{"/from", "'film' is not 'image'"}}));
}

TEST(SceneUploadQuery, ReadsAName) {
  EXPECT_EQ(api::parse_scene_upload_query(Query{})->name, "");
  EXPECT_EQ(api::parse_scene_upload_query(Query{{"name", "sofa.glb"}})->name, "sofa.glb");
  EXPECT_EQ(errors_of(api::parse_scene_upload_query(Query{{"name", ""}}), 422),
            (Errors{{"/name", "is empty"}}));
  EXPECT_EQ(errors_of(api::parse_scene_upload_query(Query{{"name", "a"}, {"name", "b"}}), 422),
            (Errors{{"/name", "appears more than once"}}));
}

TEST(EventsQuery, ReadsJobsAndTheLastEvent) {
  const std::string id = "0f4cf0a4-5b0e-4b0e-9c1e-0123456789ab";
  const auto events =
      api::parse_events_query(Query{{"jobs", id + "," + id}, {"last_event_id", "k-3"}});
  ASSERT_TRUE(events);
  EXPECT_EQ(events->jobs, std::vector{id});
  EXPECT_EQ(api::parse_events_query(Query{{"batch", id}})->batch, id);
  EXPECT_EQ(errors_of(api::parse_events_query(Query{}), 422),
            (Errors{{"/jobs", "is required, or batch"}}));
  EXPECT_EQ(errors_of(api::parse_events_query(Query{{"batch", id}, {"jobs", id}}), 422),
            (Errors{{"/jobs", "and batch exclude each other"}}));
  EXPECT_EQ(errors_of(api::parse_events_query(Query{{"jobs", "a"}}), 422),
            (Errors{{"/jobs", "'a' is not a job id (UUID)"}}));
  EXPECT_EQ(api::parse_job_events_query(Query{{"last_event_id", "k-4"}})->last_event_id, "k-4");
}

TEST(WaitQuery, AllowsAMinute) {
  EXPECT_EQ(api::parse_wait_query(Query{})->wait_seconds, 0);
  EXPECT_EQ(api::parse_wait_query(Query{{"wait", "2.5"}})->wait_seconds, 2.5);
  EXPECT_EQ(errors_of(api::parse_wait_query(Query{{"wait", "61"}}), 422),
            (Errors{{"/wait", "61 is outside [0, 60]"}}));
  EXPECT_EQ(errors_of(api::parse_wait_query(Query{{"wait", "nan"}}), 422),
            (Errors{{"/wait", "expected a number, got a string"}}));
}

TEST(PreferWait, FollowsTheHeaderGrammar) {
  EXPECT_EQ(api::prefer_wait_seconds("wait=10"), 10);
  EXPECT_EQ(api::prefer_wait_seconds("respond-async, Wait = \"5\"; x=y"), 5);
  EXPECT_EQ(api::prefer_wait_seconds("wait=3600"), 60);
  EXPECT_EQ(api::prefer_wait_seconds("wait=99999999999999999999"), 60);
  for (const char* text : {"", "wait", "wait=", "wait=-1", "wait=1.5", "wait=x", "awaiting=3"}) {
    EXPECT_FALSE(api::prefer_wait_seconds(text).has_value()) << text;
  }
}

TEST(TilesQuery, ReadsARevision) {
  EXPECT_EQ(api::parse_tiles_query(Query{})->after, 0U);
  EXPECT_EQ(api::parse_tiles_query(Query{{"after", "4294967295"}})->after, 4294967295U);
  EXPECT_EQ(errors_of(api::parse_tiles_query(Query{{"after", "4294967296"}}), 422),
            (Errors{{"/after", "4294967296 is outside [0, 4294967295]"}}));
}

TEST(ImageQuery, ReadsEveryParameter) {
  const auto image = api::parse_image_query(Query{{"layer", "normal"},
                                                  {"exposure", "-1.5"},
                                                  {"tonemap", "aces"},
                                                  {"range", "-1,2.5"},
                                                  {"revision", "9"},
                                                  {"x", "1"},
                                                  {"y", "2"},
                                                  {"width", "3"},
                                                  {"height", "4"},
                                                  {"max_size", "64"}},
                                            kToneMaps);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->layer, "normal");
  EXPECT_EQ(image->exposure_stops, -1.5F);
  EXPECT_EQ(image->tone_map, "aces");
  ASSERT_TRUE(image->range);
  EXPECT_EQ(image->range->ends, (std::array<float, 2>{-1, 2.5F}));
  EXPECT_EQ(image->revision, 9U);
  EXPECT_EQ(image->rect, (core::PixelRect{1, 2, 3, 4}));
  EXPECT_EQ(image->max_size, 64);
  const auto plain = api::parse_image_query(Query{}, kToneMaps);
  ASSERT_TRUE(plain);
  EXPECT_FALSE(plain->layer || plain->range || plain->revision || plain->rect || plain->max_size);
  const auto automatic = api::parse_image_query(Query{{"range", "auto"}}, kToneMaps);
  ASSERT_TRUE(automatic && automatic->range);
  EXPECT_FALSE(automatic->range->ends);
}

/// Values of each parameter that changes the image; x stands for the rectangle.
const std::vector<Query> kOtherImages = {{{"layer", "normal"}},
                                         {{"exposure", "1"}},
                                         {{"exposure", "auto"}},
                                         {{"curve", "linear"}},
                                         {{"tonemap", "aces"}},
                                         {{"background", "ff8000"}},
                                         {{"white_balance", "5000"}},
                                         {{"contrast", "1.5"}},
                                         {{"bits", "16"}},
                                         {{"denoise", "full"}},
                                         {{"fireflies", "keep"}},
                                         {{"range", "auto"}},
                                         {{"range", "0,1"}},
                                         {{"mix", "1,0.5"}},
                                         {{"x", "0"}, {"y", "0"}, {"width", "8"}, {"height", "8"}},
                                         {{"max_size", "64"}},
                                         {{"parts", "1"}}};

TEST(ImageKey, DiffersForEveryParameterThatChangesTheImage) {
  std::set<std::string> keys = {api::image_key({})};
  std::set<std::string> names = {"revision", "stream", "ticket", "y", "width", "height"};
  for (const Query& query : kOtherImages) {
    const auto image = api::parse_image_query(query, kToneMaps);
    ASSERT_TRUE(image) << query[0].first;
    EXPECT_TRUE(keys.insert(api::image_key(*image)).second) << query[0].first;
    names.insert(query[0].first);
  }
  api::Capabilities capabilities;
  capabilities.tone_maps = kToneMaps;
  for (const api::Json& parameter : api::image_parameters(capabilities)) {
    EXPECT_TRUE(names.contains(parameter["name"])) << parameter["name"];
  }
}

TEST(ImageKey, IsThatOfEqualImages) {
  const auto image = api::parse_image_query(Query{{"revision", "3"}, {"stream", "1"}}, kToneMaps);
  ASSERT_TRUE(image);
  EXPECT_EQ(api::image_key(*image), api::image_key({}));
}

TEST(ImageQuery, Answers422ToWrongValues) {
  const auto errors = [](Query query) {
    return errors_of(api::parse_image_query(query, kToneMaps), 422);
  };
  EXPECT_EQ(
      errors({{"layer", "heat"}}),
      (Errors{
          {"/layer",
           "Unknown value 'heat'; expected one of: beauty, albedo, "
           "normal, depth, object, instance, material, primitive, position, uv, motion, z_depth, "
           "cryptomatte:object, cryptomatte:material, alpha, samples, variance, error, denoised, "
           "denoised_error, denoise_bias, denoise_bias_error, irradiance, bounce:N, bounce:N-, "
           "light:NAME, st:S,T, st:S,T:unweighted"}}));
  const auto automatic = api::parse_image_query(Query{{"exposure", "auto"}}, kToneMaps);
  ASSERT_TRUE(automatic);
  EXPECT_TRUE(automatic->auto_exposure);
  EXPECT_EQ(errors({{"exposure", "30.5"}}), (Errors{{"/exposure", "30.5 is outside [-30, 30]"}}));
  EXPECT_EQ(errors({{"exposure", "inf"}}),
            (Errors{{"/exposure", "expected a number, got a string"}}));
  EXPECT_EQ(errors({{"tonemap", "film"}}),
            (Errors{{"/tonemap", "Unknown value 'film'; expected one of: srgb, linear, aces"}}));
  EXPECT_EQ(errors({{"range", "1"}}),
            (Errors{{"/range", R"('1' is neither auto nor two numbers separated by a comma)"}}));
  EXPECT_EQ(errors({{"range", "2,2"}}),
            (Errors{{"/range", "the first number must be below the second"}}));
  EXPECT_EQ(errors({{"range", "0,far"}}), (Errors{{"/range", "expected a number, got a string"}}));
  EXPECT_EQ(errors({{"revision", "-1"}}), (Errors{{"/revision", "-1 is outside [0, 4294967295]"}}));
  EXPECT_EQ(errors({{"max_size", "0"}}), (Errors{{"/max_size", "0 is outside [1, 16384]"}}));
  EXPECT_EQ(errors({{"x", "0"}, {"y", "0"}, {"width", "8"}}),
            (Errors{{"/height", "is required; x, y, width and height must be given together"}}));
  EXPECT_EQ(errors({{"width", "0"}}), (Errors{{"/width", "0 is outside [1, 16384]"}}));
  EXPECT_EQ(errors({{"gamma", "2.2"}}), (Errors{{"/gamma", "unknown query parameter"}}));
}

TEST(NoQuery, RefusesAny) {
  EXPECT_TRUE(api::parse_no_query(Query{}));
  EXPECT_EQ(errors_of(api::parse_no_query(Query{{"a", ""}}), 422),
            (Errors{{"/a", "unknown query parameter"}}));
}

}  // namespace
