// Warnings about settings that have no effect.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "api/job/job_spec.h"

namespace {

TEST(JobWarnings, WarnsOfLightSharesThatNoPathReaches) {
  const auto warnings = [](const std::string& layers, int max_depth) {
    const auto job = api::parse_job(R"({"scene":"s","film":{"layers":)" + layers +
                                    R"(},"integrator":{"type":"bdpt","max_depth":)" +
                                    std::to_string(max_depth) + "}}");
    return job ? job->warnings : std::vector<std::string>{"refused"};
  };
  // A path of S + T vertices scatters S + T - 2 times.
  const std::string kept = R"(["bounce:5","bounce:5-","st:3,4","light:lamp","irradiance"])";
  EXPECT_TRUE(warnings(kept, 5).empty());
  EXPECT_EQ(warnings(kept, 4),
            (std::vector<std::string>{
                "film.layers: 'bounce:5' is black: paths have at most 4 scattering events "
                "(integrator.max_depth).",
                "film.layers: 'bounce:5-' is black: paths have at most 4 scattering events "
                "(integrator.max_depth).",
                "film.layers: 'st:3,4' is black: paths have at most 4 scattering events "
                "(integrator.max_depth)."}));
}

}  // namespace
