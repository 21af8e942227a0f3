#include "clients/cli/files.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/cli/api_client.h"

namespace {

namespace fs = std::filesystem;

/// A folder with scene/part.bin, scene/a b.bin and, outside scene, secret.bin.
class SideFiles : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(root_ / "scene" / "textures");
    for (const char* name :
         {"scene/part.bin", "scene/a b.bin", "scene/textures/t.png", "secret.bin"}) {
      std::ofstream(root_ / name) << "x";
    }
    fs::create_symlink(root_ / "secret.bin", root_ / "scene" / "link.bin");
  }
  void TearDown() override { fs::remove_all(root_); }

  core::Result<std::string> find(const char* uri) const {
    return cli::side_file_path((root_ / "scene").string(), uri);
  }
  fs::path root_ = fs::path(testing::TempDir()) / ("side_files_" + std::to_string(getpid()));
};

TEST_F(SideFiles, AreFoundInTheFolderOfTheScene) {
  for (const char* uri : {"part.bin", "a b.bin", "./part.bin", "textures/t.png",
                          "textures/../part.bin", "./gone/../part.bin", "gone\\..\\part.bin"}) {
    EXPECT_TRUE(find(uri)) << uri;
  }
}

TEST_F(SideFiles, OutsideTheFolderAreRefused) {
  const std::string absolute = (root_ / "secret.bin").string();
  for (const char* uri :
       {"../secret.bin", "textures/../../secret.bin", "../gone.bin", "..\\secret.bin", "link.bin",
        absolute.c_str(), "file:///etc/passwd", "http://example.com/a.bin"}) {
    const auto found = find(uri);
    ASSERT_FALSE(found) << uri;
    EXPECT_EQ(found.error().code, core::ErrorCode::kForbidden) << uri;
    EXPECT_TRUE(found.error().message.starts_with("lies outside")) << found.error().message;
  }
}

TEST_F(SideFiles, NamesAreNotDecodedAgain) {
  EXPECT_FALSE(find("a%20b.bin"));
  std::ofstream(root_ / "scene" / "a%20b.bin") << "x";
  EXPECT_TRUE(fs::equivalent(*find("a%20b.bin"), root_ / "scene" / "a%20b.bin"));
}

TEST_F(SideFiles, AreFoundAsOnWindowsAndMacos) {
  std::ofstream(root_ / "scene" / "K\u00fcche.PNG") << "x";  // composed
  for (const char* name : {"PART.bin", "textures\\T.png", "Textures/t.PNG", "Ku\u0308che.png"}) {
    EXPECT_TRUE(find(name)) << name;
  }
  std::ofstream(root_ / "scene" / "Part.bin") << "x";
  EXPECT_FALSE(find("PART.bin"));  // two, and none is the same
  EXPECT_TRUE(find("part.bin"));
}

TEST_F(SideFiles, ReportsMissingOnes) {
  const auto found = find("nowhere.bin");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, core::ErrorCode::kNotFound);
  EXPECT_EQ(found.error().where, "nowhere.bin");
  EXPECT_EQ(found.error().message, "is used by the scene but does not exist");
}

TEST_F(SideFiles, MissingOnesAreReportedWithThoseAlike) {
  std::ofstream(root_ / "scene" / "a%20c.bin") << "x";
  std::ofstream(root_ / "scene" / "textures" / "T.png") << "x";
  EXPECT_EQ(find("a c.bin").error().message,
            "is used by the scene but does not exist; there is \"a%20c.bin\"");
  EXPECT_EQ(find("textures/part.bin").error().message,
            "is used by the scene but does not exist; there is \"part.bin\"");
  const auto two = find("textures/t.PNG");
  ASSERT_FALSE(two);
  EXPECT_NE(two.error().message.find("\"T.png\""), std::string::npos) << two.error().message;
}

TEST_F(SideFiles, BelongToTheOnlyModelOfTheFolder) {
  const std::string folder = (root_ / "scene").string();
  EXPECT_EQ(cli::model_file(folder).error().code, core::ErrorCode::kNotFound);
  std::ofstream(root_ / "scene" / "chair.GLTF") << "{}";
  std::ofstream(root_ / "scene" / "textures" / "inside.glb") << "x";
  const auto found = cli::model_file(folder + "/");
  ASSERT_TRUE(found && *found) << found.error().message;
  EXPECT_TRUE(fs::equivalent(**found, root_ / "scene" / "chair.GLTF"));
  EXPECT_EQ(**cli::model_file(**found), **found);
  std::ofstream(root_ / "scene" / "table.glb") << "x";
  const auto several = cli::model_file(folder);
  ASSERT_FALSE(several);
  EXPECT_EQ(several.error().message, "2 models are in this folder; choose one of them");
  const auto name = cli::model_file("cornell-box");
  ASSERT_TRUE(name);
  EXPECT_FALSE(*name);
}

TEST(Files, AreWrittenCompletelyOrNotAtAll) {
  const std::string path = testing::TempDir() + "files_test_" + std::to_string(getpid());
  ASSERT_TRUE(cli::write_file(path, "abc"));
  EXPECT_EQ(*cli::read_file(path), "abc");
  fs::remove(path);
  EXPECT_FALSE(cli::write_file("/nonexistent/folder/file", "abc"));
  EXPECT_TRUE(cli::check_writable(path));
  EXPECT_TRUE(cli::check_writable("-"));
  EXPECT_TRUE(cli::check_writable("/dev/null"));
  EXPECT_TRUE(cli::check_writable("in_this_folder"));
  const auto nowhere = cli::check_writable("/nonexistent/folder/file");
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().where, "/nonexistent/folder/file");
}

TEST(Files, SymbolicLinksAreKept) {
  const fs::path folder = testing::TempDir() + "links_test_" + std::to_string(getpid());
  fs::create_directories(folder / "there");
  std::ofstream(folder / "there" / "file") << "old";
  fs::create_symlink("there/file", folder / "link");
  fs::create_symlink("link", folder / "second");
  fs::create_symlink("there/new", folder / "dangling");
  ASSERT_TRUE(cli::write_file((folder / "second").string(), "new"));
  EXPECT_TRUE(fs::is_symlink(folder / "second"));
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(*cli::read_file((folder / "there" / "file").string()), "new");
  ASSERT_TRUE(cli::write_file((folder / "dangling").string(), "made"));
  EXPECT_TRUE(fs::is_symlink(folder / "dangling"));
  EXPECT_EQ(*cli::read_file((folder / "there" / "new").string()), "made");
  fs::create_symlink("itself", folder / "itself");
  EXPECT_FALSE(cli::write_file((folder / "itself").string(), "x"));
  EXPECT_TRUE(fs::is_symlink(folder / "itself"));
  fs::remove_all(folder);
}

TEST(Files, DevicesAndPipesAreWrittenInPlace) {
  EXPECT_FALSE(cli::write_file("/dev/full", "abc"));
  const fs::path pipe = testing::TempDir() + "pipe_test_" + std::to_string(getpid());
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = *cli::read_file(pipe.string()); });
  EXPECT_TRUE(cli::write_file(pipe.string(), "abc"));
  reader.join();
  EXPECT_EQ(got, "abc");
  EXPECT_TRUE(fs::is_fifo(pipe));
  fs::remove(pipe);
}

TEST(ErrorOfReply, ShowsEveryFaultWithItsPointer) {
  cli::Reply reply;
  reply.status = 422;
  reply.body = R"({"title":"Unprocessable","detail":"1 fault","errors":[)"
               R"({"pointer":"/film/width","detail":"0 is outside [1, 16384]"}]})";
  EXPECT_EQ(
      cli::error_of_reply(reply).message,
      "the server answered 422 (Unprocessable): 1 fault\n  /film/width: 0 is outside [1, 16384]");
}

TEST(ErrorOfReply, OfAForeignPageNamesTheStatusAndAProxy) {
  cli::Reply reply;
  reply.status = 502;
  reply.body = "<html>";
  EXPECT_EQ(cli::error_of_reply(reply).message,
            "a proxy before the server, or another program, answered 502");
}

TEST(ApiClient, RefusesInvalidAddresses) {
  for (const char* url : {"", "localhost:8080", "ftp://host", "http://"}) {
    EXPECT_FALSE(cli::ApiClient::connect(url, "")) << url;
  }
}

TEST(ApiClient, ReportsAnUnreachableServer) {
  const auto client = cli::ApiClient::connect("http://127.0.0.1:9", "");
  ASSERT_TRUE(client);
  const auto reply = (*client)->get("/v1/jobs");
  ASSERT_FALSE(reply);
  EXPECT_NE(reply.error().message.find("http://127.0.0.1:9"), std::string::npos);
}

}  // namespace
