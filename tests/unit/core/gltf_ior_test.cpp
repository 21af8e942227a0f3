// Curves of the index of refraction in a material's extras: reading, writing, errors,
// contradictions.
#include <string>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::IorFormula;

const char* const kVolume =
    R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":1},)"
    R"("KHR_materials_volume":{"thicknessFactor":1})";

/// A volume with these extras, and further extensions (", ..." or nothing).
core::Result<core::SceneDescription> with_extras(const std::string& extras,
                                                 const std::string& extensions = "") {
  return load_material(kVolume + extensions + "},\"extras\":" + extras);
}

const char* const kCauchy = R"({"ior_cauchy":[1.504584,0.004217,0]})";
// N-BK7 from Schott's data sheet.
const char* const kSellmeier = R"({"ior_sellmeier":{"b":[1.03961212,0.231792344,1.01046945],)"
                               R"("c_um2":[0.00600069867,0.0200179144,103.560653]}})";

TEST(GltfIor, ReadsCurvesAndSetsTheIndexOfTheDLine) {
  const auto cauchy = with_extras(kCauchy);
  ASSERT_TRUE(cauchy) << cauchy.error().message;
  EXPECT_EQ(cauchy->materials[0].ior_curve.formula, IorFormula::kCauchy);
  EXPECT_EQ(cauchy->materials[0].ior_curve.a[1], 0.004217F);
  EXPECT_NEAR(cauchy->materials[0].ior, 1.5168F, 5e-6F);
  EXPECT_TRUE(cauchy->warnings.empty());

  const auto sellmeier = with_extras(kSellmeier);
  ASSERT_TRUE(sellmeier) << sellmeier.error().message;
  EXPECT_EQ(sellmeier->materials[0].ior_curve.formula, IorFormula::kSellmeier);
  EXPECT_EQ(sellmeier->materials[0].ior_curve.c[2], 103.560653F);
  EXPECT_NEAR(sellmeier->materials[0].ior, 1.5168F, 5e-6F);
  EXPECT_TRUE(sellmeier->warnings.empty());
}

TEST(GltfIor, CurvesSurviveWriting) {
  for (const char* extras : {kCauchy, kSellmeier}) {
    const auto scene = with_extras(extras);
    ASSERT_TRUE(scene);
    const auto again = load(core::write_glb(*scene));
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->materials[0].ior_curve, scene->materials[0].ior_curve);
    EXPECT_TRUE(again->warnings.empty());
  }
}

TEST(GltfIor, IgnoresOtherExtras) {
  for (const char* extras : {"7", "null", "\"ior_cauchy\"", "[1]", R"({"ior":2})"}) {
    const auto scene = with_extras(extras);
    ASSERT_TRUE(scene) << extras;
    EXPECT_FALSE(scene->materials[0].ior_curve.is_known()) << extras;
    EXPECT_EQ(scene->materials[0].ior, 1.5F) << extras;
  }
}

TEST(GltfIor, WarnsAboutContradictions) {
  const auto warnings = [](const std::string& extensions) {
    const auto scene = with_extras(kSellmeier, extensions);
    EXPECT_TRUE(scene);
    return scene ? scene->warnings : std::vector<core::Warning>();
  };
  // n_d = 1.5168 and 20 / V_d = 20 / 64.17 = 0.3117, rounded as exporters do.
  EXPECT_TRUE(warnings(R"(,"KHR_materials_ior":{"ior":1.52},)"
                       R"("KHR_materials_dispersion":{"dispersion":0.31})")
                  .empty());
  const auto ior = warnings(R"(,"KHR_materials_ior":{"ior":1.45})");
  ASSERT_EQ(ior.size(), 1U);
  EXPECT_EQ(ior[0].detail,
            "material '': KHR_materials_ior says 1.45, the curve in extras 1.517, which is used");
  const auto dispersion = warnings(R"(,"KHR_materials_dispersion":{"dispersion":0.4})");
  ASSERT_EQ(dispersion.size(), 1U);
  EXPECT_EQ(dispersion[0].detail,
            "material '': KHR_materials_dispersion says 0.4, the curve in extras 0.3117, which "
            "is used if spectral is true");
}

TEST(GltfIor, WarnsAboutCurvesWithoutEffect) {
  const auto surface = load_material(std::string("\"extras\":") + kCauchy);
  ASSERT_TRUE(surface);
  EXPECT_NEAR(surface->materials[0].ior, 1.5168F, 5e-6F);
  ASSERT_EQ(surface->warnings.size(), 1U);
  EXPECT_NE(surface->warnings[0].detail.find("causes dispersion only in volumes"),
            std::string::npos);

  const auto glossy = with_extras(kCauchy, R"(,"KHR_materials_pbrSpecularGlossiness":{})");
  ASSERT_TRUE(glossy);
  EXPECT_FALSE(glossy->materials[0].ior_curve.is_known());
  ASSERT_EQ(glossy->warnings.size(), 1U);
  EXPECT_NE(glossy->warnings[0].detail.find("has no effect"), std::string::npos);
}

}  // namespace
