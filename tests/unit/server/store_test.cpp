#include <filesystem>
#include <set>

#include <gtest/gtest.h>
#include <unistd.h>

#include "server/jobs/job_record.h"
#include "server/store/assets.h"
#include "server/store/batch_table.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/delivery_table.h"
#include "server/store/job_table.h"
#include "server/store/key_table.h"
#include "server/store/preset_table.h"
#include "server/store/scene_table.h"
#include "server/store/schema.h"
#include "server/store/worker_table.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::Access;
using server::Database;
using server::JobQuery;
using server::JobRow;
using server::JobTable;
using server::SceneTable;
using server::WorkerTable;
using test_support::TemporaryFolder;

JobRow made_job(std::int64_t sequence, std::string id) {
  JobRow row;
  row.sequence = sequence;
  row.id = std::move(id);
  row.record = R"({"spec": {"scene": "cornell-box"}, "stop_reason": "", "samples_mean": 0})";
  row.scene = "cornell-box";
  row.state = "queued";
  return row;
}

class Store : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::open(folder.file("tessera.db"));
    ASSERT_TRUE(opened) << opened.error().message;
    database = std::move(*opened);
    jobs = std::make_unique<JobTable>(*database);
    scenes = std::make_unique<SceneTable>(*database);
    auto store = server::BlobStore::open(folder.file("assets"));
    ASSERT_TRUE(store);
    blobs = std::make_unique<server::BlobStore>(std::move(*store));
    assets = std::make_unique<server::Assets>(*database, *blobs);
  }
  void reopen() {
    assets.reset();
    jobs.reset();
    scenes.reset();
    database.reset();
    SetUp();
  }
  std::vector<std::string> listed(const JobQuery& query) {
    std::vector<std::string> ids;
    const auto rows = jobs->list(query);
    for (const JobRow& row : *rows) {
      ids.push_back(row.id);
    }
    return ids;
  }

  TemporaryFolder folder;
  std::unique_ptr<Database> database;
  std::unique_ptr<JobTable> jobs;
  std::unique_ptr<SceneTable> scenes;
  std::unique_ptr<server::BlobStore> blobs;
  std::unique_ptr<server::Assets> assets;
};

TEST_F(Store, ReadsSigningKeysOnceUntilTheyChange) {
  server::PresetTable presets(*database);
  const auto ids = [&] {
    std::vector<std::string> found;
    for (const server::SigningKeyRow& row : **presets.keys()) {
      found.push_back(row.id);
    }
    return found;
  };
  const server::SigningKeyRow first = server::make_signing_key("ours", 1);
  const server::SigningKeyRow second = server::make_signing_key("theirs", 2);
  EXPECT_TRUE(ids().empty());
  ASSERT_TRUE(presets.insert_key(first));
  EXPECT_EQ(ids(), (std::vector{first.id}));
  EXPECT_EQ(presets.keys()->get(), presets.keys()->get());  // one list: not read again
  ASSERT_TRUE(presets.insert_key(second));
  EXPECT_EQ(ids(), (std::vector{first.id, second.id}));
  ASSERT_TRUE(presets.remove_key(first.id));
  EXPECT_EQ(ids(), (std::vector{second.id}));
}

TEST_F(Store, RestoresAJobWithEveryMember) {
  JobRow row = made_job(1, "a");
  row.environment_asset = "e";
  row.state = "failed";
  row.finished_at = 1002.25;
  row.film = server::FilmPlace::kOnDisk;
  row.film_bytes = 1ULL << 40U;
  row.cpu_seconds = 7.5;
  row.tenant = "me";
  ASSERT_TRUE(jobs->insert(row, {}, std::nullopt));
  reopen();
  const auto found = jobs->find("a");
  ASSERT_TRUE(found && *found);
  const JobRow& back = **found;
  EXPECT_EQ(back.record, row.record);
  EXPECT_FALSE(back.is_damaged);
  EXPECT_EQ(back.state, "failed");
  EXPECT_EQ(back.scene, "cornell-box");
  EXPECT_EQ(back.environment_asset, "e");
  EXPECT_EQ(back.finished_at, row.finished_at);
  EXPECT_EQ(back.film, server::FilmPlace::kOnDisk);
  EXPECT_EQ(back.film_bytes, row.film_bytes);
  EXPECT_EQ(back.cpu_seconds, 7.5);
  EXPECT_EQ(back.tenant, "me");
}

TEST_F(Store, ARecordThatWasChangedByOthersIsDamaged) {
  ASSERT_TRUE(jobs->insert(made_job(1, "a"), {}, std::nullopt));
  ASSERT_TRUE(database->session().execute(
      "UPDATE jobs SET record=replace(record, 'cornell-box', 'cornell-bow')"));
  EXPECT_TRUE((**jobs->find("a")).is_damaged);
  EXPECT_TRUE(jobs->list({})->front().is_damaged);
  ASSERT_TRUE(jobs->update(made_job(1, "a"), {}));
  EXPECT_FALSE((**jobs->find("a")).is_damaged);
}

TEST_F(Store, ListsAreNewestFirstAndPaged) {
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(jobs->insert(made_job(i, "job" + std::to_string(i)), {}, std::nullopt));
  }
  JobQuery query;
  query.limit = 2;
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job5", "job4"}));
  query.before = 4;
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job3", "job2"}));
}

TEST_F(Store, ListsFilterByAnyStateAndAllLabels) {
  for (int i = 1; i <= 4; ++i) {
    JobRow row = made_job(i, "job" + std::to_string(i));
    row.state = i % 2 == 0 ? "finished" : "queued";
    row.labels["n"] = std::to_string(i);
    if (i > 2) {
      row.labels["big"] = "";
    }
    ASSERT_TRUE(jobs->insert(row, {}, std::nullopt));
  }
  JobQuery query;
  query.states = {"finished"};
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job4", "job2"}));
  query.states = {"finished", "queued"};
  query.labels = {{"big", std::nullopt}};
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job4", "job3"}));
  query.labels = {{"big", std::nullopt}, {"n", "3"}};
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job3"}));
  query.labels = {{"n", "x' OR 1=1 --"}};
  EXPECT_TRUE(listed(query).empty());
}

TEST_F(Store, ListsFindPartsOfNamesAndScenesOfUnnamedJobs) {
  const auto add = [this](int i, const char* name, const char* label) {
    JobRow row = made_job(i, "job" + std::to_string(i));
    row.name = name;
    row.labels[label] = "";
    ASSERT_TRUE(jobs->insert(row, {}, std::nullopt));
  };
  add(1, "Red Sofa", "a");
  add(2, "", "a");
  add(3, "sofa 100%", "b");
  JobQuery query;
  query.title = "SOFA";
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job3", "job1"}));
  query.before = 3;
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job1"}));
  query.before.reset();
  query.labels = {{"a", std::nullopt}};
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job1"}));
  query.labels.clear();
  query.title = "0%";  // not a pattern
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job3"}));
  query.title = "cornell";  // the scene of all, which is the title of the unnamed one
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job2"}));
  JobRow renamed = made_job(1, "job1");
  renamed.name = "Green Chair";
  ASSERT_TRUE(jobs->update(renamed, {}));
  query.title = "red";
  EXPECT_TRUE(listed(query).empty());
  query.title = "green";
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job1"}));
}

TEST_F(Store, FindsJobsOfAnOlderStoreByTheirNames) {
  JobRow row = made_job(1, "job1");
  row.record = R"({"spec": {"scene": "cornell-box", "name": "Red Sofa"}, "stop_reason": "",
                   "samples_mean": 0})";
  ASSERT_TRUE(jobs->insert(row, {}, std::nullopt));
  ASSERT_TRUE(jobs->insert(made_job(2, "job2"), {}, std::nullopt));
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema15));
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema7));
  ASSERT_TRUE(database->session().execute(
      "ALTER TABLE jobs DROP COLUMN samples_by_error; ALTER TABLE jobs DROP COLUMN split_count;"
      "DROP TABLE job_titles; PRAGMA user_version=5;"));
  reopen();
  JobQuery query;
  query.title = "sofa";
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job1"}));
  query.title = "cornell";
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job2"}));
}

TEST_F(Store, RecognisesJobsOfAnOlderStoreThatAnErrorEnded) {
  JobRow row = made_job(1, "a");
  row.record = R"({"spec": {"scene": "cornell-box"}, "stop_reason": "relative_error",
                   "samples_mean": 96.25})";
  ASSERT_TRUE(jobs->insert(row, {}, std::nullopt));
  ASSERT_TRUE(jobs->insert(made_job(2, "b"), {}, std::nullopt));
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema15));
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema7));
  ASSERT_TRUE(
      database->session().execute("ALTER TABLE jobs DROP COLUMN samples_by_error; ALTER TABLE jobs "
                                  "DROP COLUMN split_count; PRAGMA user_version=6;"));
  reopen();
  EXPECT_EQ(server::to_record(**jobs->find("a"))->view.samples_by_error, 96);
  EXPECT_EQ(server::to_record(**jobs->find("b"))->view.samples_by_error, 0);
}

TEST_F(Store, OrdersEventsByStreamThenNumber) {
  ASSERT_TRUE(jobs->insert(made_job(1, "a"), {{1, 1, "state", "x"}, {1, 9, "warning", "y"}}, {}));
  JobRow row = made_job(1, "a");
  row.state = "finished";
  ASSERT_TRUE(jobs->update(row, {{2, 3, "end", "z"}}));
  const auto all = jobs->events_after(1, 0, 0);
  ASSERT_TRUE(all);
  ASSERT_EQ(all->size(), 3U);
  EXPECT_EQ((*all)[2].data, "z");
  // Number 3 of the second stream comes after number 9 of the first.
  const auto later = jobs->events_after(1, 1, 5);
  ASSERT_EQ(later->size(), 2U);
  EXPECT_EQ((*later)[0].data, "y");
}

TEST_F(Store, CommitsAChangeAndItsEventsTogetherOrNotAtAll) {
  ASSERT_TRUE(jobs->insert(made_job(1, "a"), {{1, 1, "state", "x"}}, {}));
  JobRow row = made_job(1, "a");
  row.state = "finished";
  // The number of the second event is already in use.
  EXPECT_FALSE(jobs->update(row, {{1, 2, "state", "y"}, {1, 1, "end", "z"}}));
  EXPECT_EQ((**jobs->find("a")).state, "queued");
  EXPECT_EQ(jobs->events_after(1, 0, 0)->size(), 1U);
}

TEST_F(Store, AnUpdateStoresEachMemberThatChanged) {
  const JobRow queued = made_job(1, "a");
  ASSERT_TRUE(jobs->insert(queued, {}, {}));
  const auto changed = [&](const auto& change) {
    JobRow row = queued;
    change(row);
    EXPECT_TRUE(jobs->update(row, {}));
    const auto found = jobs->find("a");
    EXPECT_TRUE(jobs->update(queued, {}));
    return **found;
  };
  EXPECT_EQ(changed([](JobRow& row) { row.state = "paused"; }).state, "paused");
  EXPECT_EQ(changed([](JobRow& row) { row.finished_at = 2.5; }).finished_at, 2.5);
  EXPECT_EQ(changed([](JobRow& row) { row.film = server::FilmPlace::kOnDisk; }).film,
            server::FilmPlace::kOnDisk);
  EXPECT_EQ(changed([](JobRow& row) { row.film_bytes = 7; }).film_bytes, 7U);
  EXPECT_EQ(changed([](JobRow& row) { row.cpu_seconds = 3; }).cpu_seconds, 3);
  EXPECT_EQ(changed([](JobRow& row) { row.record = "{}"; }).record, "{}");
  const auto last = jobs->find("a");
  EXPECT_EQ((**last).state, "queued");
  EXPECT_EQ((**last).finished_at, std::nullopt);
  EXPECT_EQ((**last).film, server::FilmPlace::kNone);
  EXPECT_EQ((**last).film_bytes, 0U);
}

TEST_F(Store, AnUpdateChangesLabelsAndTitles) {
  JobRow row = made_job(1, "a");
  row.labels = {{"shot", "1"}, {"take", "2"}};
  ASSERT_TRUE(jobs->insert(row, {}, {}));
  const auto finds = [&](const std::string& name, const std::optional<std::string>& value) {
    JobQuery query;
    query.labels = {{name, value}};
    return !listed(query).empty();
  };
  JobQuery titled;
  titled.title = "lamp";
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_TRUE(finds("shot", "1") && finds("take", "2"));
  row.labels = {{"shot", "1"}, {"take", "3"}};
  row.name = "Lamp";
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_TRUE(finds("shot", "1") && finds("take", "3"));
  EXPECT_FALSE(finds("take", "2"));
  EXPECT_EQ(listed(titled).size(), 1U);
  row.labels = {};
  row.name = "";
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_FALSE(finds("shot", std::nullopt) || finds("take", std::nullopt));
  EXPECT_TRUE(listed(titled).empty());
}

TEST_F(Store, AnUpdateWritesNoPageOfWhatIsAsBefore) {
  JobRow row = made_job(1, "a");
  row.labels = {{"shot", "1"}};
  row.tenant = "me";
  ASSERT_TRUE(jobs->insert(row, {}, {}));
  const auto pages = [&] {
    EXPECT_TRUE(database->checkpoint());
    EXPECT_TRUE(jobs->update(row, {}));
    // Of the log's head, and of each page with its own.
    return (std::filesystem::file_size(folder.file("tessera.db-wal")) - 32) / (24 + 4096);
  };
  row.record = R"({"samples_mean": 8})";
  EXPECT_EQ(pages(), 1U);  // the job
  row.state = "rendering";
  EXPECT_EQ(pages(), 4U);  // and by state, scene and environment
  row.finished_at = 1;
  EXPECT_EQ(pages(), 3U);  // by film and by end
}

TEST_F(Store, DeletingAJobDeletesItsEventsLabelsAndKeys) {
  JobRow row = made_job(1, "a");
  row.labels["x"] = "y";
  const server::IdempotencyRow key{"k", "hash", "a", 100};
  ASSERT_TRUE(jobs->insert(row, {{1, 1, "state", "x"}}, key));
  ASSERT_TRUE(jobs->remove("a"));
  EXPECT_FALSE(*jobs->find("a"));
  EXPECT_FALSE(*jobs->find_key("k"));
  EXPECT_TRUE(jobs->events_after(1, 0, 0)->empty());
  ASSERT_TRUE(jobs->insert(made_job(1, "b"), {{1, 1, "state", "x"}}, {}));
  JobQuery labelled;
  labelled.labels.emplace_back("x", std::nullopt);
  EXPECT_TRUE(listed(labelled).empty());
}

TEST_F(Store, ADeletedJobsFilmIsLooseUntilItsFileIsGone) {
  ASSERT_TRUE(jobs->insert(made_job(1, "a"), {}, {}));
  EXPECT_TRUE(jobs->loose_films()->empty());
  ASSERT_TRUE(jobs->remove("a"));
  EXPECT_EQ(*jobs->loose_films(), std::vector<std::string>{"a"});
  ASSERT_TRUE(jobs->forget_loose_film("a"));
  EXPECT_TRUE(jobs->loose_films()->empty());
}

// The answer "none" is remembered: what is stored afterwards, and time, must end that.
TEST_F(Store, JobsExpireAtTheirTimeAlsoIfNoneWasDueBefore) {
  const auto expired = [&](double now, const JobTable::Retention& retention = {}) {
    return *jobs->expired(now, retention, 10);
  };
  const std::vector<std::string> none;
  EXPECT_EQ(expired(100), none);
  JobRow a = made_job(1, "a");
  a.state = "finished";
  a.finished_at = 40;
  ASSERT_TRUE(jobs->insert(a, {}, {}));
  EXPECT_EQ(expired(100), none);
  a.delete_at = 50;
  ASSERT_TRUE(jobs->update(a, {}));
  EXPECT_EQ(expired(100), std::vector<std::string>{"a"});
  a.delete_at = 200;
  ASSERT_TRUE(jobs->update(a, {}));
  EXPECT_EQ(expired(199), none);
  EXPECT_EQ(expired(200), std::vector<std::string>{"a"});
  EXPECT_EQ(expired(199), none);  // The clock may be set back.
  EXPECT_EQ(expired(199, {.seconds = 160}), none);
  EXPECT_EQ(expired(199.5, {.seconds = 160}), none);
  EXPECT_EQ(expired(200, {.seconds = 160}), (std::vector<std::string>{"a", "a"}));
  EXPECT_EQ(expired(199, {.seconds = 150}), std::vector<std::string>{"a"});
  ASSERT_TRUE(jobs->remove("a"));
  EXPECT_EQ(expired(1000, {.seconds = 1}), none);
}

// Two jobs of a batch that end at once both find it ended.
TEST_F(Store, ABatchIsReportedOnceUntilItsJobsRunAgain) {
  JobRow job = made_job(1, "a");
  job.state = "finished";
  ASSERT_TRUE(jobs->insert(job, {}, {}));
  server::BatchRow row;
  row.id = "b";
  row.webhook = "http://x/";
  ASSERT_TRUE(database->transact([&](Database::Session& session) {
    return server::BatchTable::insert(session, row, {1}, {"{}"});
  }));
  server::BatchTable batches(*database);
  server::DeliveryTable deliveries(*database);
  const auto ended = batches.ended({});
  ASSERT_EQ(ended->size(), 1U);
  const auto report = [&](const char* id) {
    server::DeliveryRow call;
    call.id = id;
    call.job = row.id;
    call.event = "end";
    call.url = row.webhook;
    return batches.report_end((*ended)[0], call);
  };
  ASSERT_TRUE(report("1"));
  EXPECT_TRUE(batches.ended({})->empty());
  ASSERT_TRUE(report("2"));
  EXPECT_EQ(*deliveries.pending_count(), 1);
  ASSERT_TRUE(batches.reopen((*ended)[0]));
  ASSERT_TRUE(report("3"));
  EXPECT_EQ(*deliveries.pending_count(), 2);
}

TEST_F(Store, UpdatingADeletedJobChangesNothing) {
  EXPECT_TRUE(jobs->update(made_job(7, "gone"), {{1, 1, "state", "x"}}));
  EXPECT_FALSE(*jobs->find("gone"));
}

TEST_F(Store, NeverGivesASequenceNumberTwice) {
  EXPECT_EQ(*jobs->last_sequence(), 0);
  ASSERT_TRUE(jobs->insert(made_job(5, "a"), {}, {}));
  ASSERT_TRUE(jobs->remove("a"));
  reopen();
  EXPECT_EQ(*jobs->last_sequence(), 5);
}

TEST_F(Store, EveryRunHasItsOwnNumber) {
  EXPECT_EQ(*jobs->next_run(), 1);
  reopen();
  EXPECT_EQ(*jobs->next_run(), 2);
}

TEST_F(Store, KeysAreStoredAndDeleted) {
  ASSERT_TRUE(jobs->insert(made_job(1, "a"), {}, server::IdempotencyRow{"k", "hash", "a", 100}));
  const auto found = jobs->find_key("k");
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((**found).job, "a");
  ASSERT_TRUE(jobs->forget_keys_before(100));
  EXPECT_TRUE(*jobs->find_key("k"));
  ASSERT_TRUE(jobs->forget_keys_before(101));
  EXPECT_FALSE(*jobs->find_key("k"));
}

TEST_F(Store, UnfinishedJobsKeepScenesAndAssetsInUse) {
  JobRow row = made_job(1, "a");
  row.environment_asset = "sky";
  row.state = "rendering";
  ASSERT_TRUE(jobs->insert(row, {}, {}));
  EXPECT_TRUE(*jobs->scene_in_use("cornell-box", std::nullopt));
  EXPECT_TRUE(*jobs->environment_in_use("sky", std::nullopt));
  EXPECT_EQ(jobs->unfinished()->size(), 1U);
  row.state = "finished";
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_FALSE(*jobs->scene_in_use("cornell-box", std::nullopt));
  EXPECT_FALSE(*jobs->environment_in_use("sky", std::nullopt));
  EXPECT_TRUE(jobs->unfinished()->empty());
}

TEST_F(Store, SceneOwnsItsFilesAndLeavesOnlyOrphans) {
  const Access me = Access::of("me");
  const auto id = [&](const std::string& content) { return assets->put_for_scene(content, 1)->id; };
  const std::string uploaded = id("uploaded");
  ASSERT_TRUE(assets->keep({.id = uploaded, .bytes = 8}, me, 1));
  server::SceneRow first;
  first.id = "s1";
  first.description = "{}";
  first.files = {{"", id("doc1")}, {"a", id("shared")}, {"b", id("own")}, {"c", uploaded}};
  server::SceneRow second;
  second.id = "s2";
  second.files = {{"", id("doc2")}, {"a", id("shared")}};
  ASSERT_TRUE(scenes->insert_scene(first, me));
  ASSERT_TRUE(scenes->insert_scene(second, me));
  EXPECT_EQ((**scenes->find_scene("s1", me)).files, first.files);
  const auto removal = scenes->plan_removal("s1", me);
  ASSERT_TRUE(removal && removal->scene_goes);
  const auto orphans = scenes->remove_scene("s1", me, *removal);
  ASSERT_TRUE(orphans);
  EXPECT_EQ(std::set<std::string>(orphans->begin(), orphans->end()),
            (std::set<std::string>{id("doc1"), id("own")}));
  EXPECT_TRUE(assets->find(uploaded, me));
  EXPECT_TRUE(assets->find(id("shared"), me));
  EXPECT_EQ(scenes->list_scenes(me, std::nullopt, 10)->size(), 1U);
}

/// A store from before there were tenants: the key `k1` added an asset, a scene and a job with
/// another scene; `k2` has a job with the scene of `k1`; the rest has no known owner.
constexpr const char* kOfTwoKeys = R"sql(
INSERT INTO keys(id, name, token_hash, session_hash, scopes, created_at)
VALUES('k1', 'one', 'a', 'b', 'read,write', 1);
INSERT INTO assets(id, bytes, uploaded, created_at, owner)
  VALUES('sky', 5, 1, 1, 'k1'), ('doc1', 7, 0, 1, 'k1'),
  ('doc2', 9, 0, 1, ''), ('loose', 1, 1, 1, '');
INSERT INTO scenes(id, description, facts, created_at) VALUES('s1', '{"name":"sofa"}', '', 1),
('s2', '{}', '', 1);
INSERT INTO scene_files(scene, uri, asset) VALUES('s1', '', 'doc1'), ('s2', '', 'doc2');
UPDATE jobs SET scene='s2', environment_asset='sky' WHERE id='job1';
UPDATE jobs SET scene='s1' WHERE id='job2';
INSERT INTO idempotency(key, body_hash, job, created_at)
  VALUES('k1 order', 'h', 'job1', 5), (' order', 'h', 'job3', 5), ('put job2', 'h', 'job2', 5);
INSERT INTO comparisons(id, body, bytes, created_at)
  VALUES('c1', '{"a":"job2","b":"job1"}', 1, 1), ('c2', '{"a":"job3","b":"job3"}', 1, 1);
)sql";

TEST_F(Store, OlderStoreBelongsToTheKeysThatMadeItElseToTheOperator) {
  for (const auto& [sequence, tenant] : {std::pair{1, "k1"}, {2, "k2"}, {3, ""}}) {
    JobRow row = made_job(sequence, "job" + std::to_string(sequence));
    row.tenant = tenant;
    ASSERT_TRUE(jobs->insert(row, {}, {}));
  }
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema15));
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema7));
  ASSERT_TRUE(database->session().execute(kOfTwoKeys));
  reopen();
  const auto tenants_of = [&](const std::string& what, const std::string& id) {
    auto session = database->session();
    const std::string sql =
        "SELECT tenant FROM " + what + "_tenants WHERE " + what + "=? ORDER BY tenant";
    server::Statement select = session.prepare(sql.c_str());
    select.bind(id);
    std::vector<std::string> found;
    while (select.step()) {
      found.push_back(select.text(0));
    }
    return found;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(tenants_of("asset", "sky"), Names{"k1"});
  EXPECT_EQ(tenants_of("asset", "loose"), Names{""});
  EXPECT_EQ(tenants_of("asset", "doc1"), Names{});  // the scene keeps it
  EXPECT_EQ(tenants_of("scene", "s1"), (Names{"k1", "k2"}));
  EXPECT_EQ(tenants_of("scene", "s2"), (Names{"", "k1"}));
  EXPECT_EQ((**scenes->find_scene("s1", Access::of("k2"))).description, R"({"name":"sofa"})");
  EXPECT_EQ((*jobs->find("job2"))->tenant, "k2");
  EXPECT_EQ((*jobs->find("job3"))->tenant, "");
  EXPECT_EQ((*jobs->find_key("of k1 order"))->job, "job1");
  EXPECT_EQ((*jobs->find_key("of  order"))->job, "job3");
  EXPECT_EQ((*jobs->find_key("put job2"))->job, "job2");
  const auto keys = server::KeyTable(*database).list();
  ASSERT_TRUE(keys);
  EXPECT_EQ(keys->front().tenant, "k1");
  EXPECT_EQ(keys->front().priority_max, 100);
  auto session = database->session();
  server::Statement select = session.prepare("SELECT tenant FROM comparisons ORDER BY id");
  ASSERT_TRUE(select.step());
  EXPECT_EQ(select.text(0), "k2");
  ASSERT_TRUE(select.step());
  EXPECT_EQ(select.text(0), "");
}

TEST_F(Store, ListsContainOnlyTheJobsOfOneTenant) {
  for (int i = 1; i <= 4; ++i) {
    JobRow row = made_job(i, "job" + std::to_string(i));
    row.name = i < 3 ? "sofa" : "chair";
    row.labels = {{"team", "light"}};
    row.tenant = i % 2 == 0 ? "even" : "odd";
    ASSERT_TRUE(jobs->insert(row, {}, {}));
  }
  JobQuery query;
  query.tenant = "even";
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job4", "job2"}));
  query.title = "sofa";
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job2"}));
  query.labels = {{"team", "light"}};
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job2"}));
  query.title = "";
  query.before = 4;
  EXPECT_EQ(listed(query), (std::vector<std::string>{"job2"}));
}

TEST_F(Store, PreparedStatementsAreUsedAgainWithoutTheirParametersAndRows) {
  constexpr const char* kText = "SELECT ? UNION ALL SELECT 'second'";
  auto session = database->session();
  {
    server::Statement first = session.prepare(kText);
    ASSERT_TRUE(first.bind("a").step());
    EXPECT_EQ(first.text(0), "a");
  }  // In the middle of its rows.
  server::Statement again = session.prepare(kText);
  server::Statement beside = session.prepare(kText);
  ASSERT_TRUE(beside.bind("b").step());
  ASSERT_TRUE(again.step());
  EXPECT_EQ(again.text(0), "");
  EXPECT_EQ(beside.text(0), "b");
}

TEST(StoreFile, RefusesAFileThatIsNotADatabaseByPath) {
  const TemporaryFolder folder;
  const std::string path = folder.file("tessera.db");
  test_support::write_file(path, std::string(8192, 'x'));
  const auto opened = Database::open(path);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().where, path);
}

TEST(StoreFile, RefusesAStoreOfANewerVersion) {
  const TemporaryFolder folder;
  const std::string path = folder.file("tessera.db");
  {
    auto opened = Database::open(path);
    auto session = (*opened)->session();
    ASSERT_TRUE(session.execute("PRAGMA user_version=1000"));
  }
  const auto opened = Database::open(path);
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("newer version"), std::string::npos);
}

/// Truncates the database at many positions: it opens with the committed content, or is refused;
/// never a crash.
TEST(StoreFile, TruncatedDatabaseIsRefusedOrReadsAsItWas) {
  const TemporaryFolder folder;
  const std::string path = folder.file("tessera.db");
  {
    auto opened = Database::open(path);
    JobTable table(**opened);
    for (int i = 1; i <= 50; ++i) {
      JobRow row = made_job(i, "job" + std::to_string(i));
      row.record = std::string(500, 's');
      ASSERT_TRUE(table.insert(row, {}, std::nullopt));
    }
  }
  const std::string whole = test_support::read_file(path);
  ASSERT_GT(whole.size(), 8192U);
  for (std::size_t size = 0; size < whole.size(); size += 1500) {
    test_support::write_file(path, std::string_view(whole).substr(0, size));
    std::filesystem::remove(path + "-wal");
    std::filesystem::remove(path + "-shm");
    auto opened = Database::open(path);
    if (!opened) {
      continue;
    }
    JobTable table(**opened);
    const auto rows = table.list(JobQuery{.states = {}, .labels = {}, .before = {}, .limit = 100});
    for (const JobRow& row : rows ? *rows : std::vector<JobRow>()) {
      EXPECT_EQ(row.record.size(), 500U) << size;
    }
  }
}

TEST(DataDir, SecondServerIsRefusedWithAMessage) {
  const TemporaryFolder folder;
  auto first = server::DataDir::open(folder.file("data"));
  ASSERT_TRUE(first);
  const auto second = server::DataDir::open(folder.file("data"));
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, core::ErrorCode::kConflict);
  EXPECT_NE(second.error().message.find(std::to_string(::getpid())), std::string::npos);
}

TEST(DataDir, RefusesAPathThatIsAFile) {
  const TemporaryFolder folder;
  test_support::write_file(folder.file("data"), "x");
  const auto opened = server::DataDir::open(folder.file("data"));
  ASSERT_FALSE(opened);
  EXPECT_FALSE(opened.error().message.empty());
}

TEST_F(Store, KeepsTheNewestSuspendedWorkers) {
  constexpr int kMost = 12;
  WorkerTable workers(*database, kMost);
  for (int i = 0; i < kMost; ++i) {
    ASSERT_TRUE(workers.suspend(std::to_string(i)));
  }
  ASSERT_TRUE(workers.suspend("9"));  // known
  ASSERT_TRUE(workers.suspend("a"));
  ASSERT_TRUE(workers.suspend("b"));
  const auto suspended = workers.suspended();
  ASSERT_TRUE(suspended);
  EXPECT_EQ(suspended->size(), std::size_t{kMost});
  EXPECT_FALSE(suspended->contains("1"));
  EXPECT_TRUE(suspended->contains("2"));
  EXPECT_TRUE(suspended->contains("b"));
}

}  // namespace
