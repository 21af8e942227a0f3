// Every table of named values has exactly one row for each enumerator, with a name and a summary.

#include "core/integrators/registry.h"

#include <algorithm>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/color/tone_map.h"
#include "core/denoise/denoiser_type.h"
#include "core/settings/choices.h"
#include "tests/support/enumerators.h"

namespace {

enum class Planted { kNought, kOne, kTwo };

TEST(Enumerators, EndWithTheLast) {
  EXPECT_EQ(test_support::enumerators<Planted>(),
            (std::vector<Planted>{Planted::kNought, Planted::kOne, Planted::kTwo}));
}

template <typename Enum>
void expect_whole(std::string_view table, std::span<const core::NamedValue<Enum>> rows) {
  std::set<std::string_view> names;
  for (const auto& row : rows) {
    EXPECT_TRUE(names.insert(row.name).second) << table << ": " << row.name << " stands twice";
    EXPECT_FALSE(row.name.empty() || row.summary.empty()) << table << ": " << row.name;
  }
  const auto all = test_support::enumerators<Enum>();
  EXPECT_FALSE(all.empty()) << table;
  for (const Enum value : all) {
    EXPECT_EQ(std::count_if(rows.begin(), rows.end(),
                            [value](const auto& row) { return row.value == value; }),
              1)
        << table << ": enumerator " << static_cast<int>(value);
  }
  EXPECT_EQ(rows.size(), all.size()) << table;
}

TEST(Registries, HaveARowForEveryEnumerator) {
  expect_whole("error validities", core::error_validities());
  expect_whole("samplers", core::samplers());
  expect_whole("light samplers", core::light_samplers());
  expect_whole("strategies", core::strategies());
  expect_whole("mis types", core::mis_types());
  expect_whole("roulette types", core::roulette_types());
  expect_whole("splitting types", core::splitting_types());
  expect_whole("control variates", core::control_variate_types());
  expect_whole("adaptive types", core::adaptive_types());
  expect_whole("granularities", core::granularities());
  expect_whole("filters", core::filters());
  expect_whole("fog types", core::fog_types());
  expect_whole("backgrounds", core::backgrounds());
  expect_whole("grounds", core::grounds());
  expect_whole("shadow colours", core::shadow_colors());
  expect_whole("units", core::units());
  expect_whole("environment presets", core::environment_presets());
  expect_whole("camera types", core::camera_types());
  expect_whole("distortion models", core::distortion_models());
  expect_whole("pose conventions", core::pose_conventions());
  expect_whole("denoisers", core::denoisers());
}

TEST(Candidates, OfAutoAreThoseThatItsSummaryNames) {
  core::RenderSettings settings;
  settings.integrator = core::kAutomaticIntegrator;
  const auto all = core::candidates_of(settings, false);
  const std::string_view summary = core::find_integrator(core::kAutomaticIntegrator)->summary;
  std::string listed;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const char* before = i == 0   ? ""
                         : i == 1 ? ", "
                         : i == 2 ? " or, without an error target, "
                                  : " or ";
    listed += before + std::string(all[i]);
  }
  EXPECT_EQ(summary.substr(0, summary.find(", whichever")), listed);
}

TEST(Candidates, OfAutoWithAnErrorTargetAreUnbiased) {
  core::RenderSettings settings;
  settings.integrator = core::kAutomaticIntegrator;
  for (const auto name : core::candidates_of(settings, true)) {
    EXPECT_EQ(core::find_integrator(name)->bias, "none");
  }
  settings.film.shares.resize(1);
  EXPECT_EQ(core::candidates_of(settings, false), core::candidates_of(settings, true));
}

TEST(Candidates, OfANamedIntegratorAreItself) {
  core::RenderSettings settings;
  settings.integrator = "vcm";
  EXPECT_EQ(core::candidates_of(settings, false), std::vector<std::string_view>{"vcm"});
  settings.integrator = "path";
  settings.caustics = core::CausticsType::kAuto;
  EXPECT_EQ(core::candidates_of(settings, false),
            (std::vector<std::string_view>{"path", core::kCausticsIntegrator}));
  settings.integrator = "none";
  EXPECT_TRUE(core::candidates_of(settings, false).empty());
}

TEST(Registries, HaveAToneMapForEveryEnumerator) {
  for (const core::ToneMap value : test_support::enumerators<core::ToneMap>()) {
    EXPECT_EQ(
        std::count_if(core::tone_maps().begin(), core::tone_maps().end(),
                      [value](const core::ToneMapEntry& row) { return row.tone_map == value; }),
        1)
        << static_cast<int>(value);
  }
}

}  // namespace
