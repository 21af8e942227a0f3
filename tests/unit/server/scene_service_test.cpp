#include "server/scenes/scene_service.h"

#include <gtest/gtest.h>

#include "core/base/sha256.h"
#include "core/integrators/registry.h"
#include "core/scene_io/builtin_scenes.h"
#include "server/scenes/scene_facts.h"
#include "tests/support/read_bytes.h"
#include "tests/support/zip_files.h"
#include "tests/unit/server/server_parts.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using core::ErrorCode;
using server::Access;
using test_support::bytes_of;
using test_support::make_zip;
using test_support::triangle_buffer;
using test_support::triangle_gltf;

const server::Assets::InUse kUnused = [](const auto&) { return core::Result<bool>(false); };

class Scenes : public testing::Test, protected test_support::ServerParts {
 protected:
  void SetUp() override {
    ASSERT_EQ(open(folder.file("data")), "");
    load_scenes(0);
  }

  core::Result<server::StoredBlob> upload(const std::string& content) {
    auto blob = blobs->put(content);
    if (blob) {
      EXPECT_TRUE(assets->keep(*blob, Access::of(""), 1));
    }
    return blob;
  }

  test_support::TemporaryFolder folder;
};

TEST_F(Scenes, NamesAGlbByItsHashAndRecognisesItTheSecondTime) {
  const core::Bytes glb = core::find_builtin_scene("cornell-box")->make_glb();
  const auto first = scenes->add_file(glb);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->id, core::sha256_hex(glb.data(), glb.size()));
  EXPECT_FALSE(first->known);
  const auto second = scenes->add_file(glb);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->known);
  EXPECT_EQ(second->description, first->description);
  EXPECT_TRUE(scenes->load(first->id, core::SceneMoment()));
}

TEST_F(Scenes, FactsOfAnOlderVersionAreReadAnew) {
  const auto added = scenes->add_file(core::find_builtin_scene("cornell-box")->make_glb());
  ASSERT_TRUE(added);
  const auto facts = [&] { return *scenes->facts(added->id, Access::of("")); };
  const core::SceneSummary all = facts();
  EXPECT_FALSE(all.extremes.empty());
  ASSERT_TRUE(scene_table->set_facts(added->id, "bounds 0 0 0 1 1 1\nload_bytes 17\n"));
  EXPECT_EQ(facts().extremes, all.extremes);
  EXPECT_EQ(facts().triangles, all.triangles);
  const auto row = scene_table->find_scene(added->id, Access::of(""));
  ASSERT_TRUE(row && *row);
  EXPECT_EQ(server::load_bytes_of((*row)->facts), 17U);
  EXPECT_FALSE(server::lacks_extremes(server::decode_facts((*row)->facts)));
}

TEST_F(Scenes, ReloadsAStoredSceneFromItsFiles) {
  const auto added =
      scenes->add_zip(bytes_of(make_zip({{"model/scene.gltf", triangle_gltf("data/mesh.bin"), true},
                                         {"model/data/mesh.bin", triangle_buffer()}})));
  ASSERT_TRUE(added) << added.error().message;
  load_scenes(0);
  const auto scene = scenes->load(added->id, core::SceneMoment());
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ((*scene)->summary().triangles, 1U);
}

TEST_F(Scenes, SameFilesHaveTheSameIdForEveryUpload) {
  const auto zipped = scenes->add_zip(bytes_of(make_zip(
      {{"readme.txt", "x"}, {"a.gltf", triangle_gltf("m.bin")}, {"m.bin", triangle_buffer()}})));
  ASSERT_TRUE(zipped) << zipped.error().message;
  const auto gltf = upload(triangle_gltf("m.bin"));
  const auto mesh = upload(triangle_buffer());
  const auto named = scenes->add_from_assets({.gltf = gltf->id, .files = {{"m.bin", mesh->id}}});
  ASSERT_TRUE(named) << named.error().message;
  EXPECT_EQ(named->id, zipped->id);
  EXPECT_TRUE(named->known);
}

TEST_F(Scenes, UriMayGoUpInsideTheArchiveButNotOutOfIt) {
  EXPECT_TRUE(scenes->add_zip(bytes_of(
      make_zip({{"gltf/a.gltf", triangle_gltf("../m.bin")}, {"m.bin", triangle_buffer()}}))));
  const auto outside = scenes->add_zip(
      bytes_of(make_zip({{"a.gltf", triangle_gltf("../m.bin")}, {"m.bin", triangle_buffer()}})));
  ASSERT_TRUE(outside);
  EXPECT_EQ(outside->missing, std::vector<std::string>{"../m.bin"});
  EXPECT_EQ(outside->outside, outside->missing);
  EXPECT_EQ(outside->near.at(0), "; there is \"m.bin\"");
}

TEST_F(Scenes, ListsMissingFiles) {
  const auto zipped = scenes->add_zip(bytes_of(make_zip({{"a.gltf", triangle_gltf("m.bin")}})));
  ASSERT_TRUE(zipped) << zipped.error().message;
  EXPECT_EQ(zipped->missing, std::vector<std::string>{"m.bin"});
  EXPECT_TRUE(zipped->outside.empty());
  const auto alone = scenes->add_file(bytes_of(triangle_gltf("/etc/passwd")));
  ASSERT_TRUE(alone) << alone.error().message;
  EXPECT_EQ(alone->missing, std::vector<std::string>{"/etc/passwd"});
  EXPECT_EQ(alone->outside, alone->missing);
  EXPECT_TRUE(scenes->list(Access::of(""), std::nullopt, 10)->empty());
}

TEST_F(Scenes, ZipsOfWindowsAndMacosAreRead) {
  const std::string mesh = triangle_buffer();
  const std::vector<std::vector<test_support::ZipFile>> archives = {
      {{"a.gltf", triangle_gltf("m.bin")}, {"m.bin", mesh}, {"._a.gltf", "x"}, {"._m.bin", "x"}},
      {{"in/a.gltf", triangle_gltf("m.bin")},
       {"in/m.bin", mesh},
       {"__MACOSX/in/._a.gltf", "x"},
       {"__MACOSX/a.gltf", "x"}},
      {{"in\\a.gltf", triangle_gltf("d/m.bin")}, {"in\\d\\m.bin", mesh}},
      {{"a.gltf", triangle_gltf("d\\\\m.bin")}, {"d/m.bin", mesh}},
      {{"A.GLTF", triangle_gltf("m.bin")}, {"m.bin", mesh}},
      {{"a.gltf", triangle_gltf("Mesh.bin")}, {"MESH.BIN", mesh}},
      {{"a.gltf", triangle_gltf("K\u00fcche.bin")}, {"Ku\u0308che.bin", mesh}},
      {{"a.gltf", triangle_gltf("K\u00fcche.bin")},
       {"K\x81"
        "che.bin",
        mesh}},  // code page 437
      {{"Fox/glTF/Fox.gltf", triangle_gltf("none.bin")},
       {"Fox/glTF-Binary/Fox.glb", triangle_gltf("m.bin")},
       {"Fox/glTF-Binary/m.bin", mesh}},
  };
  for (std::size_t i = 0; i < archives.size(); ++i) {
    const auto added = scenes->add_zip(bytes_of(make_zip(archives[i])));
    ASSERT_TRUE(added) << i << ": " << added.error().message;
    EXPECT_TRUE(added->missing.empty()) << i;
  }
}

TEST_F(Scenes, AmongNamesThatDifferByCaseOnlyTheSameOneIsRead) {
  const auto exact = scenes->add_zip(bytes_of(make_zip(
      {{"a.gltf", triangle_gltf("m.bin")}, {"M.bin", "x"}, {"m.bin", triangle_buffer()}})));
  ASSERT_TRUE(exact) << exact.error().message;
  EXPECT_TRUE(exact->missing.empty());
  const auto neither = scenes->add_zip(bytes_of(make_zip({{"a.gltf", triangle_gltf("m.Bin")},
                                                          {"M.bin", triangle_buffer()},
                                                          {"m.bin", triangle_buffer()}})));
  ASSERT_TRUE(neither) << neither.error().message;
  EXPECT_EQ(neither->missing, std::vector<std::string>{"m.Bin"});
  EXPECT_EQ(neither->near.at(0), "; there is \"M.bin\", \"m.bin\"");
}

TEST_F(Scenes, ZipsWithoutOneSceneAreRefusedWithTheCause) {
  const auto refusal = [&](const std::vector<test_support::ZipFile>& files) {
    const auto added = scenes->add_zip(bytes_of(make_zip(files)));
    return added ? "added" : added.error().message;
  };
  const std::string two = refusal({{"high.gltf", "{}"}, {"low.gltf", "{}"}});
  EXPECT_NE(two.find("\"high.gltf\" and \"low.gltf\""), std::string::npos) << two;
  const std::string inner = refusal({{"source/model.zip", "PK"}, {"textures/a.png", "x"}});
  EXPECT_NE(inner.find("\"source/model.zip\""), std::string::npos) << inner;
  const std::string other = refusal({{"source/model.fbx", "x"}});
  EXPECT_NE(other.find("\"source/model.fbx\""), std::string::npos) << other;
}

TEST_F(Scenes, ReportsUnknownAssetsByTheirPointer) {
  const std::string nothing(64, '0');
  EXPECT_EQ(scenes->add_from_assets({.gltf = nothing, .files = {}}).error().where, "/gltf");
  const auto gltf = upload(triangle_gltf("a/m.bin"));
  EXPECT_EQ(
      scenes->add_from_assets({.gltf = gltf->id, .files = {{"a/m.bin", nothing}}}).error().where,
      "/files/a~1m.bin");
}

TEST_F(Scenes, RefusedUploadLeavesNothingBehind) {
  EXPECT_FALSE(scenes->add_file(bytes_of("{\"asset\": 3}")));
  EXPECT_TRUE(scenes->list(Access::of(""), std::nullopt, 10)->empty());
}

TEST_F(Scenes, RemovingASceneRemovesItsUploadedFiles) {
  const auto uploaded = upload(triangle_buffer());
  const auto added = scenes->add_zip(
      bytes_of(make_zip({{"a.gltf", triangle_gltf("m.bin")}, {"m.bin", triangle_buffer()}})));
  ASSERT_TRUE(added);
  const std::string document = triangle_gltf("m.bin");
  const std::string document_id = core::sha256_hex(document.data(), document.size());
  EXPECT_TRUE(blobs->find(document_id));
  ASSERT_TRUE(scenes->remove(added->id, Access::of(""), kUnused));
  EXPECT_FALSE(blobs->find(document_id));
  EXPECT_TRUE(blobs->find(uploaded->id));
  EXPECT_EQ(scenes->load(added->id, core::SceneMoment()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(scenes->remove(added->id, Access::of(""), kUnused).error().code, ErrorCode::kNotFound);
}

TEST_F(Scenes, FindsBuiltInScenesByName) {
  for (const core::BuiltinScene& scene : core::builtin_scenes()) {
    const auto described = scenes->description(std::string(scene.name), Access::of("me"));
    ASSERT_TRUE(described) << scene.name << ": " << described.error().message;
  }
  EXPECT_EQ(scenes->description("nowhere", Access::operators()).error().code, ErrorCode::kNotFound);
}

TEST_F(Scenes, ReportsAnUnknownEnvironmentByItsPointer) {
  EXPECT_EQ(scenes->check_environment(std::string(64, '0'), Access::operators()).error().where,
            "/environment/asset");
  const auto text = upload("no image");
  const auto checked = scenes->check_environment(text->id, Access::operators());
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::kInvalidArgument);
}

core::SceneSummary two_cameras() {
  core::SceneSummary summary;
  core::CameraDescription main;
  main.name = "main view %";
  core::CameraDescription top;
  top.name = "top";
  top.orthographic = true;
  summary.cameras = {main, top};
  summary.variants = {"red", "dark\nblue"};
  summary.triangles = 12;
  summary.bytes = 3456;
  return summary;
}

TEST(SceneFacts, RoundTrip) {
  core::SceneSummary summary = two_cameras();
  summary.lights.emplace_back();
  summary.has_emissive_strength = true;
  summary.has_scattering = true;
  summary.bounds = {.min = {-1e-7F, 0, 0.1F}, .max = {1, 2e9F, 3}};
  summary.extremes = {{-1e-7F, 2e9F, 3}, {1, 0, 0.1F}};
  summary.origin = {1e9 + 0.1, -2, 0};
  const core::SceneSummary back = server::decode_facts(server::encode_facts(summary));
  ASSERT_EQ(back.cameras.size(), 2U);
  EXPECT_EQ(back.cameras[0].name, "main view %");
  EXPECT_TRUE(back.cameras[1].orthographic);
  EXPECT_EQ(back.variants, summary.variants);
  EXPECT_EQ(back.lights.size(), 1U);
  EXPECT_TRUE(back.has_emissive_strength);
  EXPECT_TRUE(back.has_scattering);
  EXPECT_FALSE(back.has_dispersion);
  EXPECT_EQ(back.triangles, 12U);
  EXPECT_EQ(back.bytes, 3456U);
  EXPECT_EQ(back.bounds.min, summary.bounds.min);
  EXPECT_EQ(back.bounds.max, summary.bounds.max);
  EXPECT_EQ(back.extremes, summary.extremes);
  EXPECT_EQ(back.origin, summary.origin);
  EXPECT_TRUE(server::decode_facts(server::encode_facts({})).bounds.empty());
}

std::string fault_of(const char* members, const core::SceneSummary& facts = two_cameras()) {
  const auto parsed = api::parse_job(std::string("{\"scene\": \"s\", ") + members + "}");
  EXPECT_TRUE(parsed) << members;
  const auto faults = server::faults_against_scene(parsed->spec, facts);
  return faults.empty() ? "" : faults[0].pointer;
}

TEST(SceneFacts, NameMissingPartsOfTheScene) {
  EXPECT_EQ(fault_of(R"("camera": {"name": "side"})"), "/camera/name");
  EXPECT_EQ(fault_of(R"("camera": {"index": 2})"), "/camera/index");
  EXPECT_EQ(fault_of(R"("camera": {"name": "top", "vertical_fov_degrees": 40})"),
            "/camera/vertical_fov_degrees");
  EXPECT_EQ(fault_of(R"("camera": {"name": "main view %", "vertical_fov_degrees": 40})"), "");
  EXPECT_EQ(fault_of(R"("variant": "green")"), "/variant");
  EXPECT_EQ(fault_of(R"("variant": "red")"), "");
}

TEST(SceneFacts, RefuseAnIntegratorThatDoesNotSupportTheMatter) {
  core::SceneSummary milk;
  milk.has_scattering = true;
  core::SceneSummary prism;
  prism.has_dispersion = true;
  const auto stored = [](const core::SceneSummary& summary) {
    return server::decode_facts(server::encode_facts(summary));
  };
  for (const core::IntegratorEntry& row : core::integrators()) {
    const std::string member = R"("integrator": {"type": ")" + std::string(row.name) + R"("})";
    const auto fault = [&](const core::SceneSummary& summary) {
      return fault_of(member.c_str(), stored(summary));
    };
    EXPECT_EQ(fault(milk), core::accepts(row, "/medium") ? "" : "/integrator/type") << row.name;
    EXPECT_EQ(fault(prism), row.disperses ? "" : "/integrator/type") << row.name;
    EXPECT_EQ(fault({}), "") << row.name;
  }
  EXPECT_EQ(fault_of(R"("estimator": {"mis": {"type": "optimal"}})", stored(milk)),
            "/estimator/mis/type");
  // Another time may have other materials.
  milk.extensions = {"KHR_animation_pointer"};
  EXPECT_EQ(fault_of(R"("integrator": {"type": "sppm"})", stored(milk)), "");
}

}  // namespace
