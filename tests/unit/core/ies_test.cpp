// IES light profiles: intensities against values computed by hand, their integral against closed
// forms, and EXT_lights_ies; quotations are from the extension.
#include "core/scene_io/ies.h"

#include <cmath>
#include <numbers>
#include <sstream>

#include "core/lights/light.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::IesProfile;
using core::Vec3;

constexpr double kPi = std::numbers::pi;

/// The lines from TILT on; factors: multiplier, ballast factor, ballast-lamp factor.
std::string file(int type, const std::vector<double>& vertical,
                 const std::vector<double>& horizontal, const std::vector<double>& candela,
                 const std::vector<double>& factors = {1, 1, 1},
                 const std::string& standard = "IESNA:LM-63-2002") {
  std::ostringstream out;
  out << standard << "\n[TEST] none\n[MANUFAC] nobody\nTILT=NONE\n1 -1 " << factors[0] << " "
      << vertical.size() << " " << horizontal.size() << " " << type << " 2 0 0 0\n"
      << factors[1] << " " << factors[2] << " 10\n";
  for (const auto* list : {&vertical, &horizontal, &candela}) {
    for (const double value : *list) {
      out << value << (value > 100 ? "\n" : " ");
    }
    out << "\n";
  }
  return out.str();
}

IesProfile profile(const std::string& text) {
  std::vector<std::string> warnings;
  auto read = core::read_ies(text, warnings);
  EXPECT_TRUE(read) << read.error().message;
  EXPECT_TRUE(warnings.empty());
  return *std::move(read);
}

/// Of type C.
Vec3 towards(double vertical_degrees, double horizontal_degrees) {
  const double v = vertical_degrees * kPi / 180;
  const double h = horizontal_degrees * kPi / 180;
  return {static_cast<float>(std::sin(v) * std::cos(h)),
          static_cast<float>(std::sin(v) * std::sin(h)), static_cast<float>(-std::cos(v))};
}

/// Rounding of angles to floats, at the slopes of these profiles.
constexpr float kNear = 2e-3F;

TEST(IesProfile, CandelaAreBilinearAndScaled) {
  const IesProfile p = profile(file(1, {0, 40, 90}, {0}, {100, 60, 10}, {2, 0.5, 7}));
  EXPECT_NEAR(p.candela(towards(0, 0)), 100, kNear);
  EXPECT_NEAR(p.candela(towards(10, 250)), 90, kNear);
  EXPECT_NEAR(p.candela(towards(65, 33)), 35, kNear);
  EXPECT_NEAR(p.candela(towards(89.99, 33)), 10.01, kNear);
  EXPECT_EQ(p.candela(towards(91, 33)), 0);
  EXPECT_EQ(p.candela(towards(180, 0)), 0);
}

TEST(IesProfile, BallastLampFactorCountsUpToLm63Of1991) {
  for (const char* standard : {"IESNA91", "[TEST] a file of 1986 begins with its labels"}) {
    const IesProfile p = profile(file(1, {0, 180}, {0}, {100, 100}, {2, 0.5, 0.7}, standard));
    EXPECT_NEAR(p.candela({0, 1, 0}), 70, kNear) << standard;
  }
  for (const char* standard : {"IESNA:LM-63-1995", "IES:LM-63-2019"}) {
    const IesProfile p = profile(file(1, {0, 180}, {0}, {100, 100}, {2, 0.5, 0.7}, standard));
    EXPECT_NEAR(p.candela({0, 1, 0}), 100, kNear) << standard;
  }
}

/// The intensities of the planes at 90 degrees; at 0 they are zero.
IesProfile planes(const std::vector<double>& horizontal, const std::vector<double>& candela) {
  std::vector<double> values;
  for (const double c : candela) {
    values.insert(values.end(), {0, c});
  }
  return profile(file(1, {0, 90}, horizontal, values));
}

TEST(IesProfile, UnfoldsSymmetriesOfTypeC) {
  struct Expected {
    double degrees;
    double candela;
  };
  struct Case {
    IesProfile profile;
    std::vector<Expected> expected;
  };
  const std::vector<Case> cases = {
      {planes({0, 45, 90}, {10, 30, 20}),
       {{0, 10}, {22.5, 20}, {90, 20}, {135, 30}, {180, 10}, {225, 30}, {270, 20}, {337.5, 20}}},
      {planes({0, 90, 180}, {10, 30, 50}),
       {{0, 10}, {45, 20}, {135, 40}, {180, 50}, {225, 40}, {270, 30}, {315, 20}}},
      {planes({90, 180, 270}, {10, 30, 50}),
       {{90, 10}, {135, 20}, {180, 30}, {270, 50}, {0, 30}, {315, 40}, {45, 20}}},
      {planes({0, 90, 180, 270, 360}, {10, 30, 50, 70, 10}),
       {{0, 10}, {45, 20}, {180, 50}, {225, 60}, {270, 70}, {315, 40}}},
      {planes({0, 90, 180, 270}, {10, 30, 50, 70}),  // without 360
       {{0, 10}, {45, 20}, {225, 60}, {315, 40}}},
  };
  for (const Case& c : cases) {
    for (const Expected& e : c.expected) {
      EXPECT_NEAR(c.profile.candela(towards(45, e.degrees)), 0.5 * e.candela, 2 * kNear)
          << e.degrees << " degrees, case " << &c - cases.data();
    }
  }
}

/// "the horizontal angles are specified in clockwise order": with +x up and the light aimed along
/// -z, +y is on its left.
TEST(IesProfile, TypesAAndBHaveVerticalAndHorizontalPoles) {
  const std::vector<double> both = {-90, 0, 90};
  // Rows are horizontal angles, columns vertical ones.
  const std::vector<double> candela = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  for (const int type : {2, 3}) {
    const IesProfile p = profile(file(type, both, both, candela));
    EXPECT_NEAR(p.candela({0, 0, -1}), 5, kNear);
    EXPECT_NEAR(p.candela(normalize(Vec3{1e-4F, 0, -1})), 5, kNear);
    EXPECT_NEAR(p.candela(normalize(Vec3{1, 0, -1})), 5.5, kNear) << "up by 45 degrees";
    EXPECT_NEAR(p.candela(normalize(Vec3{0, -1, -1})), 6.5, kNear) << "right by 45 degrees";
    EXPECT_NEAR(p.candela(normalize(Vec3{0, 1, -1})), 3.5, kNear);
    EXPECT_EQ(p.candela(normalize(Vec3{0, 0.1F, 1})), 0);
  }
  // 45 degrees up and 45 degrees right, in either order.
  const float h = std::sqrt(0.5F);
  EXPECT_NEAR(profile(file(3, both, both, candela)).candela({h, -0.5F, -0.5F}), 7, kNear);
  EXPECT_NEAR(profile(file(2, both, both, candela)).candela({0.5F, -h, -0.5F}), 7, kNear);
}

TEST(IesProfile, TypesAAndBMayStoreOnlyTheRightHalf) {
  for (const int type : {2, 3}) {
    const IesProfile p = profile(file(type, {-90, 90}, {0, 90}, {10, 10, 30, 30}));
    EXPECT_NEAR(p.candela(normalize(Vec3{0, 1, -1})), 20, kNear);
    EXPECT_NEAR(p.candela(normalize(Vec3{0, -1, -1})), 20, kNear);
    EXPECT_NEAR(p.candela({0, 0, -1}), 10, kNear);
  }
}

TEST(IesProfile, LumensAreTheIntegralOfTheIntensity) {
  EXPECT_NEAR(profile(file(1, {0, 180}, {0}, {100, 100})).lumens(), 400 * kPi, 1e-3);
  // 1 - 2 v / pi times the sine of v, from 0 to pi / 2: 1 - 2 / pi.
  EXPECT_NEAR(profile(file(1, {0, 90}, {0}, {100, 0})).lumens(), 200 * kPi * (1 - 2 / kPi), 1e-3);
  EXPECT_EQ(planes({0, 90, 180, 270}, {0, 0, 0, 0}).lumens(), 0);
  for (const int type : {2, 3}) {
    const auto p = profile(file(type, {-90, 90}, {-90, 90}, {8, 8, 8, 8}));
    EXPECT_NEAR(p.lumens(), 8 * 2 * kPi, 1e-4);
  }
  // A cosine in steps of a degree; its chords are lower by 1 / 12 of the squared step.
  std::vector<double> angles;
  std::vector<double> cosines;
  for (int i = 0; i <= 90; ++i) {
    angles.push_back(i);
    cosines.push_back(1000 * std::cos(i * kPi / 180));
  }
  const double step = kPi / 180;
  EXPECT_NEAR(profile(file(1, angles, {0}, cosines)).lumens(), 1000 * kPi * (1 - step * step / 12),
              2e-2);
}

TEST(IesProfile, LumensOfIrregularPlanesEqualASumOverDirections) {
  for (const int type : {1, 2, 3}) {
    const IesProfile p =
        type == 1 ? profile(file(1, {20, 60, 110}, {0, 30, 180}, {1, 5, 0, 7, 2, 9, 3, 3, 8}))
                  : profile(file(type, {-40, 0, 50}, {-90, 10, 90}, {1, 5, 0, 7, 2, 9, 3, 3, 8}));
    double sum = 0;
    constexpr int kSide = 1000;
    for (int i = 0; i < kSide * kSide; ++i) {
      const double z = 2 * (i / kSide + 0.5) / kSide - 1;
      const double phi = 2 * kPi * (i % kSide + 0.5) / kSide;
      const double r = std::sqrt(1 - z * z);
      sum += static_cast<double>(
          p.candela({static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                     static_cast<float>(z)}));
    }
    // The edge of the light crosses cells of side 1 / 1000.
    EXPECT_NEAR(p.lumens(), sum * 4 * kPi / (kSide * kSide), 2e-3 * p.lumens()) << type;
  }
}

TEST(IesProfile, ReportsTheExtentOfItsLight) {
  EXPECT_NEAR(profile(file(1, {0, 20, 40, 90}, {0}, {9, 9, 0, 0})).cos_reach(),
              std::cos(40 * kPi / 180), 1e-6);
  EXPECT_NEAR(profile(file(1, {0, 180}, {0}, {1, 1})).cos_reach(), -1, 1e-6);
  EXPECT_NEAR(profile(file(2, {-30, 30}, {-90, 0, 90}, {0, 0, 1, 1, 0, 0})).cos_reach(), 0, 1e-6);
}

TEST(IesFile, SkipsTiltWithAWarning) {
  std::string text = file(1, {0, 180}, {0}, {100, 100});
  text.replace(text.find("TILT=NONE"), 9, "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8");
  std::vector<std::string> warnings;
  const auto read = core::read_ies(text, warnings);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_NEAR(read->candela({1, 0, 0}), 100, kNear);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("TILT"), std::string::npos);
}

TEST(IesFile, TiltAndTheStandardAreReadInAnyCaseAndWithBlanks) {
  const std::string before = file(1, {0, 180}, {0}, {100, 100});
  for (const char* line : {"tilt=none", "Tilt=None", " TILT = NONE ", "\tTILT=\tnone\r"}) {
    std::string text = before;
    text.replace(text.find("TILT=NONE"), 9, line);
    std::vector<std::string> warnings;
    EXPECT_TRUE(core::read_ies(text, warnings)) << line;
    EXPECT_TRUE(warnings.empty()) << line;
  }
  std::string text = before;
  text.replace(text.find("[TEST]"), 6, "Tilting lamp\n[TEST]");
  EXPECT_NEAR(profile(text).candela({1, 0, 0}), 100, kNear);
  // Newer files have no third factor; it is 7 here.
  const std::string rest = "\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 7 10 0 180 0 50 50\n";
  for (const char* standard :
       {"IESNA:LM-63-2002", "iesna:lm-63-2002", "\xEF\xBB\xBFIESNA:LM-63-1995"}) {
    EXPECT_NEAR(profile(standard + rest).candela({1, 0, 0}), 50, kNear) << standard;
  }
}

TEST(IesFile, AcceptsCommasAndDosLineEndings) {
  const IesProfile p = profile(
      "IES:LM-63-2019\r\nTILT=NONE\r\n1,-1,+1,2,1,1,2,0,0,0\r\n1,1,10\r\n0,180\r\n0\r\n5e1,50\r\n");
  EXPECT_NEAR(p.candela({1, 0, 0}), 50, kNear);
}

TEST(IesFile, ReportsErrorsWithTheirPosition) {
  const auto message = [](const std::string& text) {
    std::vector<std::string> warnings;
    const auto read = core::read_ies(text, warnings);
    return read ? "" : read.error().message;
  };
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = file(1, {0, 45, 90}, {0, 90}, {1, 2, 3, 4, 5, 6});
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  EXPECT_EQ(message(""), "no line starts with TILT: not an IES LM-63 file");
  EXPECT_EQ(message("solid cube\nfacet"), "no line starts with TILT: not an IES LM-63 file");
  EXPECT_EQ(message("TILT=NONE"), "the file ends before the number of lamps");
  EXPECT_EQ(message(changed("3 2 1 2", "3 2 4 2")),
            "line 5: the photometric type is 4, outside of [1, 3]");
  EXPECT_EQ(message(changed("3 2 1 2", "3 2 1.5 2")),
            "the photometric type is 1.5; 1, 2 and 3 are C, B and A");
  EXPECT_EQ(message(changed("3 2 1 2", "1 2 1 2")).substr(0, 42),
            "line 5: the number of vertical angles is 1");
  EXPECT_EQ(message(changed("3 2 1 2", "-3 2 1 2")).substr(0, 43),
            "line 5: the number of vertical angles is -3");
  EXPECT_EQ(message(changed("3 2 1 2", "3 1e300 1 2")).substr(0, 34),
            "line 5: the number of horizontal a");
  const std::string crowded = changed("3 2 1 2", "90 90 1 2");
  EXPECT_EQ(message(crowded), "90 by 90 candela values do not fit in a file of " +
                                  std::to_string(crowded.size()) + " bytes");
  EXPECT_EQ(message(changed("0 45 90", "0 90 45")),
            "vertical angles do not increase: 45 follows 90");
  EXPECT_EQ(message(changed("0 45 90", "0 45 190")),
            "line 7: a vertical angle is 190, outside of [0, 180]");
  EXPECT_EQ(message(changed("0 90 \n", "0 80 \n")),
            "horizontal angles from 0 to 80 degrees; those of type C go from 0 to 0, 90, 180 or "
            "360, or from 90 to 270");
  EXPECT_EQ(message(changed("4 5 6", "4 5")), "the file ends before a candela value");
  EXPECT_EQ(message(changed("4 5 6", "4 5 -6")),
            "line 9: a candela value is -6, outside of [0, 1e+09]");
  for (const char* word : {"x", "nan", "inf", "1e999", "0x10", "6;", "--6"}) {
    EXPECT_EQ(message(changed("4 5 6", std::string("4 5 ") + word)),
              "line 9: a candela value is not a number")
        << word;
  }
}

/// Adds a light profile and a node that uses it to a scene.
void add_lit(core::GlbWriter& writer, const std::string& profile_json, const std::string& use,
             const std::string& node = "") {
  add_triangle(writer);
  writer.use_extension("EXT_lights_ies");
  writer.set("extensions", R"({"EXT_lights_ies":{"lights":[)" + profile_json + "]}}");
  writer.add("nodes",
             R"({"name":"lamp",)" + node + R"("extensions":{"EXT_lights_ies":{)" + use + "}}}");
  writer.add("scenes", R"({"nodes":[0,1]})");
}

const std::string kText = file(1, {0, 180}, {0, 90, 180, 270}, {1, 1, 3, 3, 5, 5, 7, 7});

void add_lit_by_view(core::GlbWriter& writer, const std::string& use,
                     const std::string& node = "") {
  const int view = writer.add_view(std::as_bytes(std::span(kText)));
  add_triangle(writer);
  writer.use_extension("EXT_lights_ies");
  writer.set("extensions", R"({"EXT_lights_ies":{"lights":[{"bufferView":)" + number(view) +
                               R"(,"mimeType":"application/x-ies-lm-63"}]}})");
  writer.add("nodes",
             R"({"name":"lamp",)" + node + R"("extensions":{"EXT_lights_ies":{)" + use + "}}}");
  writer.add("scenes", R"({"nodes":[0,1]})");
}

TEST(GltfLightProfiles, AreScaledAndTinted) {
  core::GlbWriter writer;
  add_lit_by_view(writer, R"("light":0,"multiplier":4,"color":[1,0.5,0.25])");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().where << ": " << scene.error().message;
  EXPECT_TRUE(scene->warnings.empty());
  ASSERT_EQ(scene->lights.size(), 1U);
  ASSERT_EQ(scene->profiles.size(), 1U);
  const auto light = core::punctual_light(scene->lights[0], scene->profiles[0].get());
  Vec3 wi;
  float distance = 0;
  // 2 m away in the plane of 90 degrees: 3 cd, "inversely proportional to the square".
  const core::Rgb arriving = light.arriving({0, 2, 0}, wi, distance);
  EXPECT_NEAR(arriving.r, 4 * 3 / 4.0, kNear);
  EXPECT_NEAR(arriving.g, 2 * 3 / 4.0, kNear);
  EXPECT_NEAR(arriving.b, 1 * 3 / 4.0, kNear);
  EXPECT_EQ(scene->lights[0].name, "lamp");
}

/// "The light will inherit the transform of the node ... The light's intensity is unaffected by the
/// node's global scale."
TEST(GltfLightProfiles, RotateWithTheNodeButAreNotScaledByIt) {
  // Rotated by 90 degrees about y: -z becomes -x, and x becomes -z.
  core::GlbWriter writer;
  add_lit_by_view(writer, R"("light":0)",
                  R"("rotation":[0,0.70710678,0,0.70710678],"scale":[3,3,3],)");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  const auto light = core::punctual_light(scene->lights[0], scene->profiles[0].get());
  Vec3 wi;
  float distance = 0;
  EXPECT_NEAR(light.arriving({0, 0, -1}, wi, distance).g, 1, kNear) << "the plane of 0 degrees";
  EXPECT_NEAR(light.arriving({0, 1, 0}, wi, distance).g, 3, kNear);
  EXPECT_NEAR(light.arriving({0, 0, 1}, wi, distance).g, 5, kNear);
  core::GlbWriter mirrored;
  add_lit_by_view(mirrored, R"("light":0)", R"("scale":[1,-1,1],)");
  const auto other = load(mirrored);
  ASSERT_TRUE(other);
  EXPECT_NEAR(core::punctual_light(other->lights[0], other->profiles[0].get())
                  .arriving({0, 1, 0}, wi, distance)
                  .g,
              7, kNear);
}

TEST(GltfLightProfiles, LoadFromExternalFiles) {
  core::GlbWriter writer;
  add_lit(writer, R"({"uri":"a%20lamp.ies"})", R"("light":0)");
  const auto separate = writer.finish_separate("a.bin");
  const auto uris = core::gltf_files(std::as_bytes(std::span(separate.json)),
                                     [](std::string_view) { return false; });
  ASSERT_TRUE(uris);
  EXPECT_EQ(*uris, (std::vector<std::string>{"a.bin", "a lamp.ies"}));
  const auto resolve = [&](bool has_profile) {
    return [&separate, has_profile](std::string_view uri) {
      const auto text = std::as_bytes(std::span(kText));
      return uri == "a.bin" ? std::make_shared<const core::Bytes>(separate.bin)
             : has_profile  ? std::make_shared<const core::Bytes>(text.begin(), text.end())
                            : core::SharedBytes();
    };
  };
  EXPECT_TRUE(load_json(separate.json, resolve(true)));
  const auto missing = load_json(separate.json, resolve(false));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, core::ErrorCode::kMissingFiles);
  EXPECT_NE(missing.error().message.find("a lamp.ies"), std::string::npos);
}

TEST(GltfLightProfiles, RefusesBrokenOnesWithTheirPath) {
  const std::string data = R"("uri":"data:application/x-ies-lm-63,TILT=NONE")";
  const auto error_at = [](const std::string& profile_json, const std::string& use,
                           const std::string& where) {
    core::GlbWriter writer;
    add_lit(writer, profile_json, use);
    expect_error_at(load(writer), where);
  };
  const std::string lights = "/extensions/EXT_lights_ies/lights/0";
  error_at("{" + data + "}", R"("light":0)", lights);
  error_at("{}", R"("light":0)", lights);
  error_at("{" + data + R"(,"bufferView":0})", R"("light":0)", lights);
  error_at(R"({"bufferView":9})", R"("light":0)", lights + "/bufferView");
  error_at("{" + data + "}", R"("light":1)", "/nodes/1/extensions/EXT_lights_ies/light");
  error_at("{" + data + "}", R"("multiplier":1)", "/nodes/1/extensions/EXT_lights_ies");
}

TEST(GltfLightProfiles, StrictReadingRefusesWrongTypesAndMultipliers) {
  const std::string data = R"("uri":"data:application/x-ies-lm-63,TILT=NONE")";
  const auto error_at = [](const std::string& profile_json, const std::string& use,
                           const std::string& where) {
    core::GlbWriter writer;
    add_lit(writer, profile_json, use);
    expect_error_at(load_strictly(writer), where);
  };
  error_at("{" + data + R"(,"mimeType":"text/plain"})", R"("light":0)",
           "/extensions/EXT_lights_ies/lights/0/mimeType");
  error_at("{" + data + "}", R"("light":0,"multiplier":-1)",
           "/nodes/1/extensions/EXT_lights_ies/multiplier");
}

}  // namespace
