// Faults that do not keep a file from being drawn: each is mended with a warning that says so, and
// refused by strict reading at the same place.
#include "core/scene_io/gltf_repairs.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

using Scene = core::SceneDescription;

/// Whether a warning of this kind is about this place.
bool tells(const Scene& scene, const std::string& code, const std::string& pointer) {
  return std::any_of(scene.warnings.begin(), scene.warnings.end(), [&](const core::Warning& w) {
    return w.code == code && w.pointer == pointer && !w.detail.empty();
  });
}

std::string list_of(const Scene& scene) {
  std::string text;
  for (const core::Warning& w : scene.warnings) {
    text += "\n  " + w.code + " " + w.text();
  }
  return text;
}

struct Fault {
  const char* what;
  std::function<void(core::GlbWriter&)> add;  ///< besides a triangle with material 0
  const char* code;
  const char* pointer;
  std::function<bool(const Scene&)> is_mended;
};

std::function<void(core::GlbWriter&)> material(const char* members) {
  return [members](core::GlbWriter& writer) {
    writer.add("materials", std::string("{") + members + "}");
  };
}
std::function<void(core::GlbWriter&)> node(const char* members) {
  return [members](core::GlbWriter& writer) {
    writer.add("materials", "{}");
    writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1,"znear":0.1}})");
    writer.add("nodes", std::string("{") + members + "}");
  };
}
std::function<void(core::GlbWriter&)> part(const char* array, const char* json) {
  return [array, json](core::GlbWriter& writer) {
    writer.add("materials", "{}");
    writer.add(array, json);
  };
}
std::function<void(core::GlbWriter&)> light(const char* json) {
  return [json](core::GlbWriter& writer) {
    writer.add("materials", "{}");
    writer.set("extensions", std::string(R"({"KHR_lights_punctual":{"lights":[)") + json + "]}}");
    writer.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":0}}})");
  };
}
std::function<void(core::GlbWriter&)> camera(const char* json) {
  return [json](core::GlbWriter& writer) {
    writer.add("materials", "{}");
    writer.add("cameras", json);
    writer.add("nodes", R"({"camera":0})");
  };
}

const core::MaterialDescription& first(const Scene& scene) { return scene.materials.at(0); }

const std::vector<Fault>& faults() {
  static const std::vector<Fault> kFaults = {
      {"a base colour a little above 1",
       material(R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,1.00000012,0.5,1]})"), "clamped",
       "/materials/0/pbrMetallicRoughness/baseColorFactor/1",
       [](const Scene& s) { return first(s).base_color.g == 1 && first(s).base_color.r == 0.5F; }},
      {"a colour far above 1",
       material(R"("pbrMetallicRoughness":{"baseColorFactor":[1e39,0,0,1]})"), "clamped",
       "/materials/0/pbrMetallicRoughness/baseColorFactor/0",
       [](const Scene& s) { return first(s).base_color.r == 1; }},
      {"a negative roughness", material(R"("pbrMetallicRoughness":{"roughnessFactor":-0.25})"),
       "clamped", "/materials/0/pbrMetallicRoughness/roughnessFactor",
       [](const Scene& s) { return first(s).roughness == 0; }},
      {"a negative alpha cutoff", material(R"("alphaMode":"MASK","alphaCutoff":-1)"), "clamped",
       "/materials/0/alphaCutoff", [](const Scene& s) { return first(s).alpha_cutoff == 0; }},
      {"an index of refraction below 1",
       material(R"("extensions":{"KHR_materials_ior":{"ior":0.5}})"), "clamped",
       "/materials/0/extensions/KHR_materials_ior/ior",
       [](const Scene& s) { return first(s).ior == 1; }},
      {"a clearcoat above 1",
       material(R"("extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":2}})"), "clamped",
       "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor",
       [](const Scene& s) { return first(s).clearcoat == 1; }},
      {"a colour of three values",
       material(R"("pbrMetallicRoughness":{"baseColorFactor":[0,0,0]})"), "left_out",
       "/materials/0/pbrMetallicRoughness/baseColorFactor",
       [](const Scene& s) { return first(s).base_color.r == 1; }},
      {"a text for a number", material(R"("pbrMetallicRoughness":{"metallicFactor":"0.5"})"),
       "left_out", "/materials/0/pbrMetallicRoughness/metallicFactor",
       [](const Scene& s) { return first(s).metallic == 1; }},
      {"an unknown alpha mode", material(R"("alphaMode":"GLOW")"), "left_out",
       "/materials/0/alphaMode",
       [](const Scene& s) { return first(s).alpha_mode == core::AlphaMode::kOpaque; }},
      {"a number for a boolean", material(R"("doubleSided":1)"), "left_out",
       "/materials/0/doubleSided", [](const Scene& s) { return !first(s).double_sided; }},
      {"a list for extensions", material(R"("extensions":[])"), "left_out",
       "/materials/0/extensions", [](const Scene&) { return true; }},
      {"a number for an extension that is not known",
       [](core::GlbWriter& writer) {
         writer.add("materials", R"({"extensions":{"FOO_bar":5}})");
         writer.set("extensionsUsed", R"(["FOO_bar"])");
       },
       "extension_ignored", "/extensionsUsed/0", [](const Scene&) { return true; }},
      {"a long quaternion", node(R"("rotation":[0,2,0,0],"camera":0)"), "normalized",
       "/nodes/0/rotation",
       [](const Scene& s) {  // half a turn about y
         return std::abs(s.cameras.at(0).to_world.x.x + 1) < 1e-6F;
       }},
      {"a quaternion of zeros", node(R"("rotation":[0,0,0,0],"camera":0)"), "normalized",
       "/nodes/0/rotation",
       [](const Scene& s) {
         return s.cameras.at(0).to_world.x == core::Vec3{1, 0, 0};
       }},
      {"a matrix beside a scale of 1",
       node(R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1],"scale":[1,1,1],"camera":0)"), "left_out",
       "/nodes/0", [](const Scene& s) { return s.cameras.at(0).to_world.t.x == 5; }},
      {"a skin without a mesh",
       [](core::GlbWriter& writer) {
         writer.add("materials", "{}");
         writer.add("skins", R"({"joints":[0]})");
         writer.add("nodes", R"({"skin":0})");
       },
       "left_out", "/nodes/0", [](const Scene&) { return true; }},
      {"a spot without an edge",
       light(R"({"type":"spot","spot":{"innerConeAngle":0.5,"outerConeAngle":0.5}})"), "clamped",
       "/extensions/KHR_lights_punctual/lights/0/spot",
       [](const Scene& s) {
         return s.lights.at(0).outer_cone_rad == 0.5F && s.lights.at(0).inner_cone_rad < 0.5F &&
                s.lights.at(0).inner_cone_rad > 0.499F;
       }},
      {"a spot of more than a half space", light(R"({"type":"spot","spot":{"outerConeAngle":2}})"),
       "clamped", "/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle",
       [](const Scene& s) { return std::abs(s.lights.at(0).outer_cone_rad - 1.5707964F) < 1e-6F; }},
      {"a camera without znear", camera(R"({"type":"perspective","perspective":{"yfov":1}})"),
       "missing", "/cameras/0/perspective",
       [](const Scene& s) { return s.cameras.size() == 1 && s.cameras[0].near_m == 0; }},
      {"a far plane before the near one",
       camera(R"({"type":"perspective","perspective":{"yfov":1,"znear":2,"zfar":1}})"), "left_out",
       "/cameras/0/perspective/zfar",
       [](const Scene& s) { return s.cameras[0].near_m == 2 && s.cameras[0].far_m > 1e30F; }},
      {"a camera without an angle",
       camera(R"({"type":"perspective","perspective":{"yfov":0,"znear":1}})"), "left_out",
       "/cameras/0/perspective/yfov", [](const Scene& s) { return s.cameras.empty(); }},
      {"an unused accessor beyond its view",
       [](core::GlbWriter& writer) {
         writer.add("materials", "{}");
         writer.add_accessor(bytes(triangle_positions()), kF32, "VEC3", 4);
       },
       "left_out", "/accessors/0", [](const Scene&) { return true; }},
      {"an unused accessor of an unknown type",
       part("accessors", R"({"componentType":5130,"count":1,"type":"VEC3"})"), "left_out",
       "/accessors/0/componentType", [](const Scene&) { return true; }},
      {"an unused mesh", part("meshes", R"({"primitives":[{"attributes":{"POSITION":99}}]})"),
       "left_out", "/meshes/0/primitives/0/attributes/POSITION", [](const Scene&) { return true; }},
      {"an unused skin", part("skins", R"({"joints":[]})"), "left_out", "/skins/0/joints",
       [](const Scene&) { return true; }},
      {"an unused image", part("images", R"({"name":"stale"})"), "left_out", "/images/0",
       [](const Scene&) { return true; }},
      {"an unused texture", part("textures", R"({"source":7})"), "left_out", "/textures/0/source",
       [](const Scene&) { return true; }},
      {"an unused material",
       [](core::GlbWriter& writer) {
         writer.add("materials", "{}");
         writer.add("materials", R"({"normalTexture":{"index":3}})");
       },
       "left_out", "/materials/1/normalTexture/index", [](const Scene&) { return true; }},
      {"an animation whose times stand still",
       [](core::GlbWriter& writer) {
         writer.add("materials", "{}");
         const int times = accessor(writer, std::vector<float>{1, 1}, kF32, "SCALAR", 1);
         const int output = accessor(writer, std::vector<float>{9, 9, 9, 9, 9, 9}, kF32, "VEC3", 3);
         writer.add("animations", R"({"samplers":[{"input":)" + number(times) + R"(,"output":)" +
                                      number(output) +
                                      R"(}],"channels":[{"sampler":0,"target":)"
                                      R"({"node":0,"path":"translation"}}]})");
       },
       "animation_ignored", "/animations/0/samplers/0/input",
       [](const Scene& s) { return s.instances.at(0).to_world.t == core::Vec3{}; }},
      {"a channel without a sampler",
       part("animations",
            R"({"samplers":[],"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}]})"),
       "left_out", "/animations/0/channels/0/sampler", [](const Scene&) { return true; }},
  };
  return kFaults;
}

class GltfRepairs : public testing::TestWithParam<int> {};

TEST_P(GltfRepairs, AreMendedOrRefused) {
  const Fault& fault = faults()[static_cast<std::size_t>(GetParam())];
  core::GlbWriter writer;
  fault.add(writer);
  add_triangle(writer, "\"material\":0");
  const core::Bytes file = writer.finish();

  const auto scene = load(file);
  ASSERT_TRUE(scene) << fault.what << ": " << scene.error().where << ": " << scene.error().message;
  EXPECT_TRUE(tells(*scene, fault.code, fault.pointer)) << fault.what << list_of(*scene);
  EXPECT_EQ(scene->warnings.size(), 1U) << fault.what << list_of(*scene);
  EXPECT_TRUE(fault.is_mended(*scene)) << fault.what;
  EXPECT_EQ(scene->instances.size(), 1U) << fault.what;

  EXPECT_FALSE(load(file, strictly())) << fault.what;
}

INSTANTIATE_TEST_SUITE_P(All, GltfRepairs, testing::Range(0, static_cast<int>(faults().size())));

TEST(GltfRepair, DoesNotTouchAFileWithoutFaults) {
  core::GlbWriter writer;
  writer.add("materials", R"({"pbrMetallicRoughness":{"baseColorFactor":[1,0,0.5,1]}})");
  add_triangle(writer, "\"material\":0");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->warnings.empty()) << list_of(*scene);
}

// What is drawn cannot be guessed: these are refused with and without strict reading.
TEST(GltfRepair, RefusesWhatIsDrawnAndBroken) {
  const auto refuses = [](const std::function<void(core::GlbWriter&)>& add, const char* where) {
    core::GlbWriter writer;
    add(writer);
    expect_error_at(load(writer), where);
  };
  refuses(
      [](core::GlbWriter& writer) {
        const int a = writer.add_accessor(bytes(triangle_positions()), kF32, "VEC3", 4);
        add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(a) + "}");
      },
      "/accessors/0");
  refuses([](core::GlbWriter& writer) { add_triangle(writer, "\"material\":7"); },
          "/meshes/0/primitives/0/material");
  refuses(
      [](core::GlbWriter& writer) {
        writer.add("materials", R"({"normalTexture":{"index":3}})");
        add_triangle(writer, "\"material\":0");
      },
      "/materials/0/normalTexture/index");
  refuses([](core::GlbWriter& writer) { add_triangle(writer, "", R"("matrix":[1,0,0])"); },
          "/nodes/0/matrix");
  refuses(
      [](core::GlbWriter& writer) {
        add_triangle(writer, "", R"("scale":[2,2,2],"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1])");
      },
      "/nodes/0");
}

TEST(GltfRepair, AnUnreadAttributeMayBeBroken) {
  core::GlbWriter writer;
  const int broken = writer.add_accessor(bytes(triangle_positions()), kF32, "VEC3", 9);
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"_CUSTOM\":" + number(broken) + "}");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(tells(*scene, "left_out", "/accessors/0")) << list_of(*scene);
}

TEST(GltfRepair, FilesOfUnusedPartsMayBeMissing) {
  const std::string json =
      R"({"asset":{"version":"2.0"},"buffers":[{"uri":"gone.bin","byteLength":4}],)"
      R"("images":[{"uri":"gone.png"}],"textures":[{"source":0}],)"
      R"("materials":[{"normalTexture":{"index":0}}],"nodes":[{}]})";
  EXPECT_TRUE(load_json(json));
  EXPECT_EQ(load_json_strictly(json).error().code, core::ErrorCode::kMissingFiles);
}

// Occlusion is computed by tracing paths, so its texture is not needed.
TEST(GltfRepair, OcclusionTexturesAreNotNeeded) {
  core::GlbWriter writer;
  writer.add("images", R"({"uri":"gone.png"})");
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"occlusionTexture":{"index":0}})");
  add_triangle(writer, "\"material\":0");
  EXPECT_TRUE(load(writer));
}

TEST(GltfRepair, NormalsAndTangentsAreMadeUnitVectors) {
  core::GlbWriter writer;
  const int normals =
      accessor(writer, std::vector<float>{0, 0, 3, 0, 0, 0, 0, 0, 1}, kF32, "VEC3", 3);
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"NORMAL\":" + number(normals) + "}");
  const auto scene = load(writer);
  for (const core::Vec3 n : only_primitive(scene).normals) {
    EXPECT_TRUE(n == (core::Vec3{0, 0, 1}));  // that of the triangle, where it is zero
  }
  EXPECT_TRUE(tells(*scene, "normalized", "/meshes/0/primitives/0/attributes/NORMAL"))
      << list_of(*scene);
}

TEST(GltfRepair, ValuesThatAreNotFiniteCountAsZeroUnlessTheyArePositions) {
  core::GlbWriter writer;
  std::vector<float> coordinates = {0, 0, 1, 0, 0, 1};
  coordinates[3] = std::numeric_limits<float>::quiet_NaN();
  const int uv = accessor(writer, coordinates, kF32, "VEC2", 2);
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"TEXCOORD_0\":" + number(uv) + "}");
  const core::Bytes file = writer.finish();
  const auto scene = load(file);
  EXPECT_EQ(only_primitive(scene).uv[0].at(1).y, 0);
  EXPECT_TRUE(tells(*scene, "not_finite", "/meshes/0/primitives/0/attributes/TEXCOORD_0"))
      << list_of(*scene);
  expect_error_at(load(file, strictly()), "/meshes/0/primitives/0/attributes/TEXCOORD_0");
}

core::Bytes plain_glb() {
  core::GlbWriter writer;
  add_triangle(writer);
  return writer.finish();
}

void put_u32(core::Bytes& file, std::size_t at, std::uint32_t value) {
  std::memcpy(file.data() + at, &value, sizeof value);
}

TEST(GltfRepair, ATotalLengthThatIsWrongDoesNotMatterIfTheChunksAreThere) {
  for (const int off : {-16, 16}) {
    core::Bytes file = plain_glb();
    put_u32(file, 8, static_cast<std::uint32_t>(static_cast<int>(file.size()) + off));
    const auto scene = load(file);
    ASSERT_TRUE(scene) << off << ": " << scene.error().message;
    EXPECT_EQ(scene->instances.size(), 1U);
    EXPECT_TRUE(tells(*scene, "container", "")) << off << list_of(*scene);
    EXPECT_FALSE(load(file, strictly())) << off;
  }
}

TEST(GltfRepair, BytesAfterTheGlbAreIgnored) {
  core::Bytes file = plain_glb();
  file.resize(file.size() + 5, std::byte{0xff});
  const auto scene = load(file);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(tells(*scene, "container", "")) << list_of(*scene);
}

TEST(GltfRepair, MissingPaddingDoesNotMatterButMissingDataDoes) {
  // The buffer has 37 bytes, of which the accessor reads 36.
  core::GlbWriter writer;
  add_triangle(writer);
  core::Bytes file = writer.finish();
  std::string text(reinterpret_cast<const char*>(file.data()), file.size());
  const std::size_t at = text.find("\"byteLength\":36");
  ASSERT_NE(at, std::string::npos);
  const auto with_length = [&](const char* digits) {
    core::Bytes changed = file;
    for (std::size_t i = text.find("\"byteLength\":36"); i != std::string::npos;
         i = text.find("\"byteLength\":36", i + 1)) {
      std::memcpy(changed.data() + i + 13, digits, 2);
    }
    return changed;
  };
  const auto padded = load(with_length("39"));
  ASSERT_TRUE(padded) << padded.error().message;
  EXPECT_TRUE(tells(*padded, "padding", "/buffers/0/byteLength")) << list_of(*padded);
  EXPECT_FALSE(load(with_length("39"), strictly()));
  EXPECT_FALSE(load(with_length("35")));  // one byte of a vertex is missing
}

TEST(GltfRepair, TakesTheMatrixOfAnAnimatedNodeApart) {
  // Half a turn about z, mirrored in x, scaled by 2, 3, 4, moved to (5, 6, 7).
  const std::string matrix = R"("matrix":[2,0,0,0,0,-3,0,0,0,0,4,0,5,6,7,1])";
  const auto animated = [&](const std::string& node, const char* path,
                            const std::vector<float>& value) {
    core::GlbWriter writer;
    add_triangle(writer, "", node);
    const int times = accessor(writer, std::vector<float>{0}, kF32, "SCALAR", 1);
    const int output = accessor(writer, value, kF32, "VEC3", 3);
    writer.add("animations", R"({"samplers":[{"input":)" + number(times) + R"(,"output":)" +
                                 number(output) +
                                 R"(}],"channels":[{"sampler":0,"target":{"node":0,"path":")" +
                                 path + R"("}}]})");
    return writer.finish();
  };
  const auto moved = load(animated(matrix, "translation", {1, 1, 1}));
  ASSERT_TRUE(moved) << moved.error().message;
  const core::Transform m = moved->instances.at(0).to_world;
  EXPECT_NEAR(length(m.x - core::Vec3{2, 0, 0}), 0, 1e-6);
  EXPECT_NEAR(length(m.y - core::Vec3{0, -3, 0}), 0, 1e-6);
  EXPECT_NEAR(length(m.z - core::Vec3{0, 0, 4}), 0, 1e-6);
  EXPECT_TRUE(m.t == (core::Vec3{1, 1, 1}));
  EXPECT_TRUE(tells(*moved, "decomposed", "/nodes/0/matrix")) << list_of(*moved);

  const auto scaled = load(animated(matrix, "scale", {1, 1, 1}));
  ASSERT_TRUE(scaled);
  EXPECT_NEAR(std::abs(scaled->instances.at(0).to_world.determinant()), 1, 1e-6);
  EXPECT_TRUE(scaled->instances.at(0).to_world.t == (core::Vec3{5, 6, 7}));

  const std::string shear = R"("matrix":[1,0,0,0,1,1,0,0,0,0,1,0,0,0,0,1])";
  expect_error_at(load(animated(shear, "translation", {1, 1, 1})), "/nodes/0/matrix");
  expect_error_at(load(animated(matrix, "translation", {1, 1, 1}), strictly()), "/nodes/0/matrix");
}

TEST(GltfRepair, ManyFaultsOfOneKindAreCounted) {
  core::GlbWriter writer;
  for (int i = 0; i < 1000; ++i) {
    writer.add("materials", R"({"pbrMetallicRoughness":{"metallicFactor":2}})");
  }
  writer.add("meshes", R"({"primitives":[{"attributes":{"POSITION":99}}]})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->warnings.size(), 12U) << list_of(*scene);
  EXPECT_EQ(scene->warnings.back().text(), "and 990 more of this kind (clamped)");
  EXPECT_TRUE(tells(*scene, "left_out", "/meshes/0/primitives/0/attributes/POSITION"));
}

}  // namespace
