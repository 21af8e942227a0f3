// Every integrator accepts an error target or refuses it with the reason.
#include <string>

#include <gtest/gtest.h>

#include "api/job/job_spec.h"
#include "core/integrators/registry.h"

namespace {

TEST(ErrorTargets, OfDenoisedImagesAreRefusedWithTheReasonWhereHalvesShowOnlyNoise) {
  int refused = 0;
  for (const core::IntegratorEntry& row : core::integrators()) {
    const std::string name(row.name);
    const auto parsed =
        api::parse_job(R"({"scene":"cornell-box","integrator":{"type":")" + name +
                       R"("},"denoise":{"type":"statistical"},"stop":{"denoised_error":0.1}})");
    ASSERT_EQ(static_cast<bool>(parsed), row.error != core::ErrorValidity::kByComparison) << name;
    if (parsed) {
      continue;
    }
    ++refused;
    ASSERT_EQ(parsed.problem().errors.size(), 1U) << parsed.problem().detail;
    EXPECT_EQ(parsed.problem().errors[0].pointer, "/stop/denoised_error");
    const std::string& detail = parsed.problem().errors[0].detail;
    EXPECT_NE(detail.find("integrator '" + name + "'"), std::string::npos) << detail;
    EXPECT_NE(detail.find("biased"), std::string::npos) << detail;
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
