#include "clients/cli/command.h"

#include <string>

#include <gtest/gtest.h>

namespace {

struct Outcome {
  int code;
  std::string told;
};

/// Runs a verb with several options, as `tessera draw` would.
Outcome run(const cli::Args& args) {
  CLI::App app("Draws.", "tessera draw");
  std::string output;
  std::string scene;
  int samples = 0;
  double error = 0;
  app.add_option("scene", scene);
  app.add_option("-o,--output", output)->required();
  app.add_option("--spp", samples);
  app.add_option("--relative-error", error);
  testing::internal::CaptureStderr();
  const int code = cli::parse_and_run(app, args, [] { return cli::kDone; });
  return {code, testing::internal::GetCapturedStderr()};
}

constexpr const char* kRest = " `tessera draw --help` lists the options.\n";

TEST(WrongUsage, ReportsTheCommandAndTheMissingArgument) {
  const Outcome missing = run({"sphere"});
  EXPECT_EQ(missing.code, cli::kWrongUsage);
  EXPECT_EQ(missing.told, std::string("tessera draw: --output is required.") + kRest);
}

TEST(WrongUsage, SuggestsTheMostSimilarOption) {
  const auto told = [](const std::string& option) {
    return run({"-o", "a.png", option, "1"}).told;
  };
  EXPECT_EQ(
      told("--relative-eror"),
      std::string(
          "tessera draw: there is no option --relative-eror; did you mean --relative-error?") +
          kRest);
  // Names used by other renderers.
  EXPECT_EQ(told("--samples"),
            std::string("tessera draw: there is no option --samples; did you mean --spp?") + kRest);
  EXPECT_EQ(told("--marmalade"),
            std::string("tessera draw: there is no option --marmalade.") + kRest);
}

TEST(WrongUsage, ReportsAnExtraWord) {
  EXPECT_EQ(run({"sphere", "cube", "-o", "a.png"}).told,
            std::string("tessera draw: \"cube\" is an unexpected argument.") + kRest);
}

TEST(WrongUsage, ReportsAValueThatIsNotANumber) {
  const Outcome wrong = run({"sphere", "-o", "a.png", "--spp", "many"});
  EXPECT_EQ(wrong.code, cli::kWrongUsage);
  EXPECT_NE(wrong.told.find("--spp"), std::string::npos);
  EXPECT_NE(wrong.told.find("many"), std::string::npos);
}

TEST(RightUsage, PrintsNothing) {
  const Outcome fine = run({"sphere", "-o", "a.png", "--spp", "4"});
  EXPECT_EQ(fine.code, cli::kDone);
  EXPECT_EQ(fine.told, "");
}

}  // namespace
