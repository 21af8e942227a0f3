// EXT_lights_image_based; quotations are from the extension.
#include <algorithm>
#include <array>
#include <limits>

#include "core/image_io/image_io.h"
#include "core/lights/environment.h"
#include "core/scene/scene.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::Rgb;
using core::Vec3;

/// One image of the file, from floats in linear light.
int add_face(core::GlbWriter& writer, const core::FloatImage& face, int format = 0) {
  const auto file =
      core::encode_image(face, core::image_formats()[static_cast<std::size_t>(format)], {});
  return writer.add(
      "images", R"({"mimeType":"image/png","bufferView":)" + number(writer.add_view(*file)) + "}");
}

/// Eight texels wide: all texels of the resulting map lie on one face, except at its edges.
core::FloatImage flat(const std::vector<std::string>& channels, const std::vector<float>& color) {
  core::FloatImage face = {8, 8, channels, {}};
  for (int i = 0; i < 8 * 8; ++i) {
    face.values.insert(face.values.end(), color.begin(), color.end());
  }
  return face;
}
core::FloatImage flat(Rgb color) { return flat({"R", "G", "B"}, {color.r, color.g, color.b}); }

std::string coefficients() {
  std::string text = "[";
  for (int i = 0; i < 9; ++i) {
    text += i == 0 ? "[1,1,1]" : ",[0,0,0]";
  }
  return text + "]";
}

/// A scene with this light; `more` are additional members of it.
void add_light(core::GlbWriter& writer, const std::string& images, const std::string& more = "") {
  add_triangle(writer);
  writer.set("extensions", "{\"EXT_lights_image_based\":{\"lights\":[{" + more +
                               "\"irradianceCoefficients\":" + coefficients() +
                               ",\"specularImageSize\":8,\"specularImages\":[" + images + "]}]}}");
  writer.add("scenes", R"({"nodes":[0],"extensions":{"EXT_lights_image_based":{"light":0}}})");
}

void add_six(core::GlbWriter& writer, const std::array<core::FloatImage, 6>& faces,
             const std::string& more = "") {
  std::string images;
  for (const core::FloatImage& face : faces) {
    images += (images.empty() ? "[" : ",") + number(add_face(writer, face));
  }
  add_light(writer, images + "]", more);
}

/// "Positive X, Negative X, Positive Y, Negative Y, Positive Z, Negative Z"
constexpr std::array kColors = {Rgb{1, 0, 0}, Rgb{0, 1, 1}, Rgb{0, 1, 0},
                                Rgb{1, 0, 1}, Rgb{0, 0, 1}, Rgb{1, 1, 0}};

std::array<core::FloatImage, 6> colored() {
  std::array<core::FloatImage, 6> faces;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    faces[i] = flat(kColors[i]);
  }
  return faces;
}

std::shared_ptr<const core::Environment> environment_of(core::GlbWriter& writer,
                                                        const core::GltfOptions& options = {}) {
  auto description = load(writer, options);
  if (!description) {
    ADD_FAILURE() << description.error().where << ": " << description.error().message;
    return nullptr;
  }
  const auto scene = core::Scene::build(*std::move(description), 1);
  if (!scene) {
    ADD_FAILURE() << scene.error().where << ": " << scene.error().message;
    return nullptr;
  }
  return (*scene)->environment();
}

void expect_color(const core::Environment& environment, Vec3 direction, Rgb expected) {
  const Rgb seen = environment.radiance(core::normalize(direction));
  EXPECT_NEAR(seen.r, expected.r, 1e-5F);
  EXPECT_NEAR(seen.g, expected.g, 1e-5F);
  EXPECT_NEAR(seen.b, expected.b, 1e-5F);
}

TEST(GltfEnvironment, FacesAreInTheOrderOfTheSpecification) {
  core::GlbWriter writer;
  add_six(writer, colored());
  const auto environment = environment_of(writer);
  ASSERT_NE(environment, nullptr);
  expect_color(*environment, {1, 0.1F, 0.2F}, kColors[0]);
  expect_color(*environment, {-1, 0.1F, 0.2F}, kColors[1]);
  expect_color(*environment, {0.1F, 1, 0.1F}, kColors[2]);
  expect_color(*environment, {0.1F, -1, 0.1F}, kColors[3]);
  expect_color(*environment, {0.1F, 0.2F, 1}, kColors[4]);
  expect_color(*environment, {0.1F, 0.2F, -1}, kColors[5]);
}

// "each saved image must be flipped about its vertical axis": as seen from the centre of the cube.
// A viewer who looks along +x with y up has +z on the right; one who looks up with -z above has +x
// on the left.
TEST(GltfEnvironment, FacesAreSeenFromTheCenter) {
  auto faces = colored();
  // Top left 1, top right 2, bottom left 3, bottom right 4; in eighths, which neither format
  // represents exactly: compared.
  const std::vector<float> corners = {0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 1, 0};
  for (core::FloatImage& face : faces) {
    face = {2, 2, {"R", "G", "B"}, corners};
  }
  core::GlbWriter writer;
  add_six(writer, faces);
  const auto environment = environment_of(writer);
  ASSERT_NE(environment, nullptr);
  const Rgb black = {0, 0, 0};
  const Rgb white = {1, 1, 1};
  const Rgb red = {1, 0, 0};
  const Rgb green = {0, 1, 0};
  expect_color(*environment, {1, 0.5F, -0.5F}, black);
  expect_color(*environment, {1, 0.5F, 0.5F}, white);
  expect_color(*environment, {1, -0.5F, -0.5F}, red);
  expect_color(*environment, {1, -0.5F, 0.5F}, green);
  expect_color(*environment, {0.5F, 0.5F, -1}, white);  // along -z, +x is on the right
  expect_color(*environment, {-0.5F, 0.5F, -1}, black);
  expect_color(*environment, {0.4F, 1, -0.4F}, black);
  expect_color(*environment, {-0.4F, 1, -0.4F}, white);
  expect_color(*environment, {0.4F, -1, 0.4F}, black);
  expect_color(*environment, {-0.4F, -1, -0.4F}, green);
}

TEST(GltfEnvironment, CountsTexelsThatAreNoLight) {
  auto faces = colored();
  faces[0].values[0] = -1;
  faces[0].values[3] = std::numeric_limits<float>::quiet_NaN();
  core::GlbWriter writer;
  std::string images;
  const auto exr = static_cast<int>(
      std::find_if(core::image_formats().begin(), core::image_formats().end(),
                   [](const core::ImageFormat& format) { return format.extension == "exr"; }) -
      core::image_formats().begin());
  for (const core::FloatImage& face : faces) {
    images += (images.empty() ? "[" : ",") + number(add_face(writer, face, exr));
  }
  add_light(writer, images + "]");
  const auto scene = load(writer, {});
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->warnings.size(), 1U);
  EXPECT_EQ(scene->warnings[0].detail.find("2 texels of image 0 have negative"), 0U);
}

TEST(GltfEnvironment, IsMultipliedByItsIntensity) {
  core::GlbWriter writer;
  add_six(writer, colored(), "\"intensity\":2.5,");
  const auto environment = environment_of(writer);
  ASSERT_NE(environment, nullptr);
  expect_color(*environment, {1, 0, 0}, {2.5F, 0, 0});
}

// A quarter turn about y maps +z to +x.
TEST(GltfEnvironment, IsRotated) {
  core::GlbWriter writer;
  add_six(writer, colored(), "\"rotation\":[0,0.70710678,0,0.70710678],");
  const auto environment = environment_of(writer);
  ASSERT_NE(environment, nullptr);
  expect_color(*environment, {1, 0.1F, 0.1F}, kColors[4]);
  expect_color(*environment, {0.1F, 1, 0.1F}, kColors[2]);
  expect_color(*environment, {0.1F, 0.1F, 1}, kColors[1]);
}

// "when the RGB channels are divided by it, can produce values greater than 1"
TEST(GltfEnvironment, AlphaDividesColor) {
  auto faces = colored();
  // 51 of 255 is a fifth. Images here hold colour times alpha; the file holds it undivided.
  faces[0] = flat({"R", "G", "B", "A"}, {0.2F, 0.2F, 0, 0.2F});
  core::GlbWriter writer;
  add_six(writer, faces);
  const auto environment = environment_of(writer);
  ASSERT_NE(environment, nullptr);
  expect_color(*environment, {1, 0.1F, 0.1F}, {5, 5, 0});
}

TEST(GltfEnvironment, IntensityCanBeAnimated) {
  core::GlbWriter writer;
  const int times = accessor(writer, std::vector<float>{0, 2}, kF32, "SCALAR", 1);
  const int values = accessor(writer, std::vector<float>{1, 3}, kF32, "SCALAR", 1);
  add_six(writer, colored());
  writer.add("animations",
             "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" + number(values) +
                 R"(}],"channels":[{"sampler":0,"target":{"path":"pointer","extensions":)"
                 R"({"KHR_animation_pointer":{"pointer":)"
                 R"("/extensions/EXT_lights_image_based/lights/0/intensity"}}}}]})");
  core::GltfOptions options;
  options.time_seconds = 1;
  const auto environment = environment_of(writer, options);
  ASSERT_NE(environment, nullptr);
  expect_color(*environment, {1, 0, 0}, {2, 0, 0});
}

TEST(GltfEnvironment, SceneWithoutOneHasNone) {
  core::GlbWriter writer;
  add_triangle(writer);
  EXPECT_EQ(environment_of(writer), nullptr);
}

TEST(GltfEnvironment, RefusesAFaceThatIsNotSquare) {
  auto faces = colored();
  faces[3] = {2, 1, {"R", "G", "B"}, std::vector<float>(6, 0.0F)};
  core::GlbWriter writer;
  add_six(writer, faces);
  expect_error_at(load(writer), "/images/3");
}

TEST(GltfEnvironment, RequestsMemoryFirst) {
  core::GlbWriter writer;
  auto faces = colored();
  faces[0] = {64, 64, {"R", "G", "B"}, std::vector<float>(std::size_t{64} * 64 * 3, 0.5F)};
  add_six(writer, faces);
  core::GltfOptions options;
  options.limits.decoded_bytes_max = std::size_t{1} << 20;  // the map takes 256 x 128 x 40
  const auto scene = load(writer, options);
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, core::ErrorCode::kTooLarge);
}

}  // namespace
