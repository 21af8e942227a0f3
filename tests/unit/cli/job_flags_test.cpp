#include "clients/cli/job_flags.h"

#include <cstdio>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

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

TEST(MakeRequest, ContainsOnlyTheSceneWithoutFlags) {
  cli::JobFlags flags;
  flags.scene = "glass";
  EXPECT_EQ(cli::make_request(flags)->dump(), R"({"scene":"glass"})");
}

TEST(MakeRequest, EveryFlagHasItsMember) {
  cli::JobFlags flags;
  flags.scene = "glass";
  flags.samples_per_pixel = 64;
  flags.relative_error = 0.02;
  flags.seconds = 5;
  flags.size = "640x360";
  flags.camera = "left";
  flags.integrator = "path";
  flags.sampler = "independent";
  flags.light_sampler = "ris";
  flags.roulette = "none";
  flags.split = 2;
  flags.seed = 7;
  EXPECT_EQ(cli::make_request(flags)->dump(),
            R"({"scene":"glass","film":{"width":640,"height":360},"camera":{"name":"left"},)"
            R"("integrator":{"type":"path"},"sampler":{"type":"independent"},)"
            R"("light_sampler":{"type":"ris"},"estimator":{"roulette":{"type":"none"},)"
            R"("splitting":{"type":"fixed","count":2}},"seed":7,)"
            R"("stop":{"samples_per_pixel":64,"relative_error":0.02,"seconds":5.0}})");
}

TEST(MakeRequest, WeightsAndControlVariatesAreTypesOfTheEstimator) {
  cli::JobFlags flags;
  flags.scene = "glass";
  flags.mis = "optimal";
  flags.control_variate = "none";
  EXPECT_EQ(cli::make_request(flags)->dump(),
            R"({"scene":"glass","estimator":{"mis":{"type":"optimal"},)"
            R"("control_variate":{"type":"none"}}})");
}

TEST(MakeRequest, FlagsOverrideTheJobFileAndKeepTheRest) {
  const TemporaryFile file(
      R"({"scene":"interior","film":{"width":10,"height":20,"filter":{"type":"box"}},)"
      R"("camera":{"index":2}})");
  cli::JobFlags flags;
  flags.job_file = file.path();
  flags.size = "30x40";
  flags.camera = "right";
  EXPECT_EQ(cli::make_request(flags)->dump(),
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
  for (const char* wrong :
       {"--size=3", "--size=0xAx1", "--size=0x10", "--size=16385x1", "--size=16384x16384",
        "--spp=many", "--spp=0", "--spp=-1", "--spp=65537", "--relative-error=0",
        "--relative-error=few%", "--relative-error=101%", "--relative-error=5", "--seconds=0",
        "--seconds=604801", "--split=65", "--seed=-1", "--threads=1025", "--nonsense"}) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(cli::parse_and_run(app, {wrong}, body), cli::kWrongUsage) << wrong;
    EXPECT_FALSE(testing::internal::GetCapturedStderr().empty());
  }
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
    CLI::App app;
    cli::JobFlags flags;
    cli::add_job_flags(app, flags, "scene");
    EXPECT_EQ(cli::parse_and_run(app, {"--relative-error", text}, [] { return 0; }), cli::kDone)
        << text;
    EXPECT_EQ(flags.relative_error, value) << text;
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
