#include "clients/cli/job_flags.h"

#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "api/json/schemas.h"
#include "clients/cli/command.h"

namespace {

/// A file that is deleted with this object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text)
      : path_(testing::TempDir() + "job_flags_test_" + std::to_string(getpid()) + ".json") {
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { std::remove(path_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// The request of a command line.
cli::Json request_of(const std::vector<std::string>& args) {
  CLI::App app;
  cli::JobFlags flags;
  cli::add_job_flags(app, flags, "scene");
  EXPECT_EQ(cli::parse_and_run(app, args, [] { return 0; }), cli::kDone);
  const auto request = cli::make_request(flags);
  EXPECT_TRUE(request);
  return request ? *request : cli::Json();
}

/// Members in any order.
void expect_request(const std::vector<std::string>& args, const char* expected) {
  EXPECT_EQ(nlohmann::json(request_of(args)), nlohmann::json::parse(expected));
}

TEST(MakeRequest, ContainsOnlyTheSceneWithoutFlags) {
  expect_request({"glass"}, R"({"scene":"glass"})");
}

TEST(MakeRequest, EveryFlagHasItsMember) {
  expect_request({"glass", "--spp=64", "--relative-error=2%", "--seconds=5", "--size=640x360",
                  "--camera=left", "--integrator=path", "--sampler=independent",
                  "--light-sampler=ris", "--roulette=none", "--split=2", "--seed=7",
                  "--aperture=0.5", "--transparent", "--spectral", "--shadow-strength=0.25"},
                 R"({"scene":"glass","film":{"width":640,"height":360},)"
                 R"("camera":{"name":"left","aperture_radius":0.5},)"
                 R"("integrator":{"type":"path"},"sampler":{"type":"independent"},)"
                 R"("light_sampler":{"type":"ris"},"estimator":{"roulette":{"type":"none"},)"
                 R"("splitting":{"type":"fixed","count":2}},"seed":7,"spectral":true,)"
                 R"("environment":{"visible":false},"ground":{"shadow":{"strength":0.25}},)"
                 R"("stop":{"samples_per_pixel":64,"relative_error":0.02,"seconds":5}})");
}

TEST(MakeRequest, WeightsAndControlVariatesAreTypesOfTheEstimator) {
  expect_request({"glass", "--mis=optimal", "--control-variate=none"},
                 R"({"scene":"glass","estimator":{"mis":{"type":"optimal"},)"
                 R"("control_variate":{"type":"none"}}})");
}

TEST(MakeRequest, AnyMemberCanBeSet) {
  expect_request({"glass", "--set", "integrator.max_depth=4", "--set", "units=lux", "--set",
                  "film=null", "--set=ground.shadow.softness=0.5"},
                 R"({"scene":"glass","integrator":{"max_depth":4},"units":"lux","film":null,)"
                 R"("ground":{"shadow":{"softness":0.5}}})");
}

// Options and members of the API cannot diverge: each pointer is a member of its schema.
TEST(JobFlags, AreMembersOfTheRequest) {
  const nlohmann::json schema = api::job_request_schema();
  for (const auto flags : {cli::stop_flags(), cli::view_flags(), cli::method_flags()}) {
    for (const cli::MemberFlag& flag : flags) {
      std::string path = flag.pointer;
      for (std::size_t at = 0; (at = path.find('/', at)) != std::string::npos;) {
        path.replace(at, 1, "/properties/");
        at += std::string_view("/properties/").size();
      }
      EXPECT_TRUE(schema.contains(nlohmann::json::json_pointer(path))) << flag.names;
    }
  }
}

TEST(MakeRequest, FlagsOverrideTheJobFileAndKeepTheRest) {
  const TemporaryFile file(
      R"({"scene":"interior","film":{"width":10,"height":20,"filter":{"type":"box"}},)"
      R"("camera":{"index":2}})");
  expect_request({"--job", file.path(), "--size=30x40", "--camera=right"},
                 R"({"scene":"interior","film":{"width":30,"height":40,"filter":{"type":"box"}},)"
                 R"("camera":{"name":"right"}})");
}

TEST(MakeRequest, RequiresAScene) { EXPECT_FALSE(cli::make_request(cli::JobFlags())); }

TEST(MakeRequest, ReportsTheLocationOfSyntaxErrors) {
  const TemporaryFile file("{\"scene\": }");
  cli::JobFlags flags;
  flags.job_file = file.path();
  const auto request = cli::make_request(flags);
  ASSERT_FALSE(request);
  EXPECT_EQ(request.error().message, "is not JSON at byte 11");
  EXPECT_EQ(request.error().where, file.path());
}

TEST(ParseAndRun, WrongUsageExitsWithTwoAndHelpWithZero) {
  CLI::App app;
  cli::JobFlags flags;
  cli::add_job_flags(app, flags, "scene");
  const auto body = [] { return 0; };
  testing::internal::CaptureStdout();
  EXPECT_EQ(cli::parse_and_run(app, {"--help"}, body), cli::kDone);
  testing::internal::GetCapturedStdout();
  for (const char* wrong : {"--size=3",
                            "--size=0xAx1",
                            "--size=0x10",
                            "--size=16385x1",
                            "--size=16384x16384",
                            "--spp=many",
                            "--spp=0",
                            "--spp=-1",
                            "--spp=65537",
                            "--relative-error=0",
                            "--relative-error=few%",
                            "--relative-error=101%",
                            "--relative-error=5",
                            "--seconds=0",
                            "--seconds=604801",
                            "--split=65",
                            "--seed=-1",
                            "--threads=1025",
                            "--focus=0",
                            "--rotation=east",
                            "--set=seed",
                            "--set=environment={\"color\":[.2,.3]}",
                            "--nonsense"}) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(cli::parse_and_run(app, {wrong}, body), cli::kWrongUsage) << wrong;
    EXPECT_FALSE(testing::internal::GetCapturedStderr().empty());
  }
}

TEST(JobFlags, NamesWhereAValueIsNotJson) {
  CLI::App app;
  cli::JobFlags flags;
  cli::add_job_flags(app, flags, "scene");
  testing::internal::CaptureStderr();
  cli::parse_and_run(app, {R"(--set=environment={"color":[.2]})"}, [] { return 0; });
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find(R"({"color":[.2]}" is not JSON at byte 11: ".2]}")"), std::string::npos)
      << said;
}

TEST(JobFlags, AcceptsTheEndsOfRanges) {
  for (const char* right : {"--size=16384x1", "--spp=1", "--spp=65536", "--relative-error=0.00001",
                            "--seconds=0.001", "--seconds=604800", "--split=64",
                            "--seed=9007199254740991", "--seed=+5", "--threads=1024"}) {
    CLI::App app;
    cli::JobFlags flags;
    cli::add_job_flags(app, flags, "scene");
    EXPECT_EQ(cli::parse_and_run(app, {right}, [] { return 0; }), cli::kDone) << right;
  }
}

TEST(JobFlags, AcceptsARelativeErrorAsAPercentage) {
  for (const auto& [text, value] :
       {std::pair("5%", 0.05), std::pair("0.05", 0.05), std::pair("12.5%", 0.125),
        std::pair("100%", 1.0), std::pair("1e-3%", 1e-5)}) {
    EXPECT_EQ(request_of({"glass", "--relative-error", text})["stop"]["relative_error"], value)
        << text;
  }
}

TEST(JobFlags, FileErrorIsAFailureNotWrongUsage) {
  cli::JobFlags flags;
  const auto code = [&flags] {
    return cli::request_fault_code(cli::make_request(flags).error(), flags);
  };
  EXPECT_EQ(code(), cli::kWrongUsage);  // no scene
  flags.job_file = "/nowhere/job.json";
  EXPECT_EQ(code(), cli::kFailed);
  const TemporaryFile broken("{");
  flags.job_file = broken.path();
  EXPECT_EQ(code(), cli::kFailed);
  const TemporaryFile without_scene("{}");
  flags.job_file = without_scene.path();
  EXPECT_EQ(code(), cli::kWrongUsage);
}

}  // namespace
