#include "clients/cli/job_flags.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
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

// Client verbs do not link the renderer, whose tables make the schema of the request, so flags and
// members of the API have texts and ranges of their own. These tests keep them from diverging.
class JobFlagsAndSchema : public testing::Test {
 protected:
  using Json = nlohmann::json;

  JobFlagsAndSchema() {
    for (const auto group : {cli::stop_flags(), cli::view_flags(), cli::method_flags()}) {
      flags.insert(flags.end(), group.begin(), group.end());
    }
  }
  /// Returns the schema of the flag's member; null if there is no such member.
  Json member(const cli::MemberFlag& flag) const {
    std::string path = flag.pointer;
    for (std::size_t at = 0; (at = path.find('/', at)) != std::string::npos;) {
      path.replace(at, 1, "/properties/");
      at += std::string_view("/properties/").size();
    }
    const Json::json_pointer pointer(path);
    return schema.contains(pointer) ? schema.at(pointer) : Json();
  }

  const Json schema = api::job_request_schema();
  std::vector<cli::MemberFlag> flags;
};

TEST_F(JobFlagsAndSchema, FlagsAreMembersOfTheRequest) {
  for (const cli::MemberFlag& flag : flags) {
    EXPECT_FALSE(member(flag).is_null()) << flag.names;
  }
}

TEST_F(JobFlagsAndSchema, HaveTheSameRanges) {
  int checked = 0;
  for (const cli::MemberFlag& flag : flags) {
    using Value = cli::MemberFlag::Value;
    const bool has_range = flag.max > flag.min;
    if (!has_range || (flag.value != Value::kNumber && flag.value != Value::kShare)) {
      continue;
    }
    const Json here = member(flag);
    const char* low = flag.is_open ? "exclusiveMinimum" : "minimum";
    const char* high = here.contains("maximum") ? "maximum" : "exclusiveMaximum";
    ASSERT_TRUE(here.contains(low) && here.contains(high)) << flag.names;
    EXPECT_EQ(here.at(low), flag.min) << flag.names;
    EXPECT_EQ(here.at(high), flag.max) << flag.names;
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

TEST_F(JobFlagsAndSchema, HaveTheSameDefaults) {
  int checked = 0;
  for (const cli::MemberFlag& flag : flags) {
    const Json standard = member(flag).value("default", Json());
    if (std::string(flag.standard).empty() || standard.is_null()) {
      continue;  // It is not said, or said in words.
    }
    EXPECT_EQ(standard.is_string() ? standard.get<std::string>() : standard.dump(), flag.standard)
        << flag.names;
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

TEST_F(JobFlagsAndSchema, ListAllNamesIfTheyListSome) {
  int lists = 0;
  for (const cli::MemberFlag& flag : flags) {
    const std::string text = std::string(" ") + flag.text + ",";
    const Json names = member(flag).value("enum", Json::array());
    const auto listed = std::count_if(names.begin(), names.end(), [&](const Json& name) {
      const std::size_t at = text.find(" " + name.get<std::string>());
      return at != std::string::npos &&
             text.find_first_of(",( ", at + 1) == at + 1 + name.get<std::string>().size();
    });
    if (listed > 1) {
      EXPECT_EQ(static_cast<std::size_t>(listed), names.size()) << flag.names;
      ++lists;
    }
  }
  EXPECT_GT(lists, 4);
}

TEST(MakeRequest, FlagsOverrideTheJobFileAndKeepTheRest) {
  const TemporaryFile file(
      R"({"scene":"interior","film":{"width":10,"height":20,"filter":{"type":"box"}},)"
      R"("camera":{"index":2}})");
  expect_request({"--job", file.path(), "--size=30x40", "--camera=right"},
                 R"({"scene":"interior","film":{"width":30,"height":40,"filter":{"type":"box"}},)"
                 R"("camera":{"name":"right"}})");
}

TEST(MakeRequest, NamesTheFormOfABackgroundColor) {
  const auto made = [](const char* background) {
    cli::JobFlags flags;
    flags.scene = "glass";
    flags.background = background;
    return cli::make_request(flags);
  };
  EXPECT_TRUE(made("ff8000"));
  EXPECT_TRUE(made("transparent"));
  for (const char* wrong : {"ff00zz", "#ff8000", "f80"}) {
    const auto refused = made(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_NE(refused.error().message.find("six hexadecimal digits"), std::string::npos);
  }
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

TEST(MakeRequest, RefusesJsonThatIsNestedTooDeep) {
  const auto made = [](std::size_t levels) {
    const TemporaryFile file(R"({"scene": "x", "labels": )" + std::string(levels - 1, '[') +
                             std::string(levels - 1, ']') + "}");
    cli::JobFlags flags;
    flags.job_file = file.path();
    return cli::make_request(flags);
  };
  EXPECT_TRUE(made(32));
  for (const std::size_t levels : {std::size_t{33}, std::size_t{1} << 20}) {
    const auto request = made(levels);
    ASSERT_FALSE(request);
    EXPECT_EQ(request.error().message, "is nested deeper than 32 levels");
  }
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
