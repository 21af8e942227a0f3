#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/json/schemas.h"
#include "api/queries/fireflies.h"
#include "api/queries/queries.h"
#include "api/requests.h"

namespace {

using Query = std::vector<std::pair<std::string, std::string>>;

const std::vector<std::string> kToneMaps = {"srgb", "linear", "aces"};

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

TEST(SceneListQuery, PagesTheList) {
  EXPECT_TRUE(api::parse_scene_list_query(Query{{"limit", "5"}, {"cursor", "x"}}));
}

TEST(SubmitQuery, ParsesDryRun) {
  EXPECT_FALSE(api::parse_submit_query(Query{})->dry_run);
  EXPECT_TRUE(api::parse_submit_query(Query{{"dry_run", "1"}})->dry_run);
  EXPECT_FALSE(api::parse_submit_query(Query{{"dry_run", "0"}})->dry_run);
}

TEST(SubmitQuery, ParsesPictures) {
  EXPECT_FALSE(api::parse_submit_query(Query{{"dry_run", "1"}})->from_image);
  EXPECT_TRUE(api::parse_submit_query(Query{{"from", "image"}})->from_image);
}

TEST(NoQuery, MayBeEmpty) { EXPECT_TRUE(api::parse_no_query(Query{})); }

TEST(SceneUploadQuery, ReadsAName) {
  EXPECT_EQ(api::parse_scene_upload_query(Query{})->name, "");
  EXPECT_EQ(api::parse_scene_upload_query(Query{{"name", "sofa.glb"}})->name, "sofa.glb");
}

TEST(EventsQuery, ReadsJobsAndTheLastEvent) {
  const std::string id = "0f4cf0a4-5b0e-4b0e-9c1e-0123456789ab";
  const auto events =
      api::parse_events_query(Query{{"jobs", id + "," + id}, {"last_event_id", "k-3"}});
  ASSERT_TRUE(events);
  EXPECT_EQ(events->jobs, std::vector{id});
  EXPECT_EQ(api::parse_events_query(Query{{"batch", id}})->batch, id);
  EXPECT_EQ(api::parse_job_events_query(Query{{"last_event_id", "k-4"}})->last_event_id, "k-4");
}

TEST(WaitQuery, AllowsAMinute) {
  EXPECT_EQ(api::parse_wait_query(Query{})->wait_seconds, 0);
  EXPECT_EQ(api::parse_wait_query(Query{{"wait", "2.5"}})->wait_seconds, 2.5);
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
  EXPECT_TRUE(api::parse_image_query(Query{{"exposure", "auto"}}, kToneMaps)->auto_exposure);
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

TEST(Fireflies, AreSetAsideInDisplayFormatsUnlessAskedOtherwise) {
  using api::Fireflies;
  const auto made = [](std::optional<Fireflies> asked, const api::FireflyImage& image) {
    const auto found = api::sets_fireflies_aside(asked, image);
    return found ? (*found ? "set aside" : "kept") : found.error().message;
  };
  const api::FireflyImage shown = {.is_linear = false, .is_denoised = false, .layer = "beauty"};
  const api::FireflyImage linear = {.is_linear = true, .is_denoised = false, .layer = "beauty"};
  const api::FireflyImage all = {.is_linear = true, .is_denoised = false, .layer = {}};
  const api::FireflyImage denoised = {.is_linear = false, .is_denoised = true, .layer = "beauty"};
  const api::FireflyImage depth = {.is_linear = false, .is_denoised = false, .layer = "depth"};
  EXPECT_EQ(made({}, shown), "set aside");
  EXPECT_EQ(made(Fireflies::kKeep, shown), "kept");
  EXPECT_EQ(made({}, linear), "kept");
  EXPECT_EQ(made(Fireflies::kSetAside, linear), "set aside");
  EXPECT_EQ(made({}, all), "kept");
  EXPECT_EQ(made(Fireflies::kKeep, all), "kept");
  EXPECT_EQ(made(Fireflies::kSetAside, all),
            "an EXR of all layers keeps its light; an image of beauty need not");
  EXPECT_EQ(made({}, denoised), "kept") << "denoising has set them aside";
  EXPECT_EQ(made(Fireflies::kSetAside, denoised), "kept");
  EXPECT_EQ(made(Fireflies::kKeep, denoised), "denoised images are made without fireflies");
  EXPECT_EQ(made({}, depth), "kept");
  EXPECT_EQ(made(Fireflies::kKeep, depth), "applies only to beauty and light shares");
}

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

}  // namespace
