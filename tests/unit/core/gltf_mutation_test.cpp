// One document that uses most of the loader's features, with every JSON value changed in many ways,
// and its bytes truncated and corrupted: each case is refused with its path, or gives a scene that
// renders to finite values.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include <nlohmann/json.hpp>

#include "core/image_io/image_io.h"
#include "core/scene/scene.h"
#include "tests/support/scenes.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using Json = nlohmann::ordered_json;

struct Document {
  std::string json;
  core::Bytes bin;
};

/// Two joints, a morph target, animation of all paths, a sparse accessor, 16-bit indices, an
/// interleaved view, instances, a texture with a transform, lights, cameras, variants and materials
/// with every extension.
Document everything() {
  core::GlbWriter writer;
  const int positions =
      accessor(writer, std::vector<float>{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, kF32, "VEC3", 3);
  const int normals =
      accessor(writer, std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, kF32, "VEC3", 3);
  const int uv = accessor(writer, std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0}, kF32, "VEC2", 2);
  const int colors = accessor(writer, std::vector<std::uint8_t>(16, 200), kU8, "VEC4", 4,
                              R"({"normalized": true})");
  const int indices =
      accessor(writer, std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}, kU16, "SCALAR", 1);
  const int joints =
      accessor(writer, std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0},
               kU8, "VEC4", 4);
  const int weights =
      accessor(writer, std::vector<float>{1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0},
               kF32, "VEC4", 4);
  std::vector<float> identities;
  for (int i = 0; i < 2; ++i) {
    identities.insert(identities.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  }
  const int bind = accessor(writer, identities, kF32, "MAT4", 16);
  const int moved = accessor(writer, std::vector<float>(12, 0.1F), kF32, "VEC3", 3);
  const int sparse_places = writer.add_view(bytes(std::vector<std::uint16_t>{1, 3}));
  const int sparse_values = writer.add_view(bytes(std::vector<float>{0, 0, 1, 0, 1, 0}));
  const int sparse = writer.add(
      "accessors", R"({"componentType": 5126, "type": "VEC3", "count": 4, "sparse": {"count": 2,)"
                   R"( "indices": {"bufferView": )" +
                       number(sparse_places) +
                       R"(, "componentType": 5123}, "values": {"bufferView": )" +
                       number(sparse_values) + "}}}");
  const int times = accessor(writer, std::vector<float>{0, 1, 2}, kF32, "SCALAR", 1);
  const int ways = accessor(writer, std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}, kF32, "VEC3", 3);
  const int turns =
      accessor(writer, std::vector<float>{0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0}, kF32, "VEC4", 4);
  const int cubic = accessor(writer, std::vector<float>(27, 0.5F), kF32, "VEC3", 3);
  const int amounts = accessor(writer, std::vector<float>(6, 0.3F), kF32, "SCALAR", 1);
  const core::Bytes png = *core::encode_image({2, 2, {"R", "G", "B"}, std::vector<float>(12, 0.5F)},
                                              core::image_formats()[0], {});
  writer.add("images",
             R"({"mimeType": "image/png", "bufferView": )" + number(writer.add_view(png)) + "}");
  writer.add("samplers",
             R"({"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33648})");
  writer.add("textures", R"({"source": 0, "sampler": 0})");
  writer.add("textures", R"({"source": 0})");
  const std::string t = R"({"index": 1})";
  writer.add("materials",
             R"({"name": "all", "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true,)"
             R"( "emissiveFactor": [0.1, 0.2, 0.3],
  "emissiveTexture": {"index": 0, "texCoord": 0}, "normalTexture": {"index": 0, "scale": 0.5},
  "occlusionTexture": {"index": 0, "strength": 0.5},
  "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.5, 0.9], "metallicFactor": 0.5,
  "roughnessFactor": 0.4,
    "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.1,
    0.2], "rotation": 0.3, "scale": [2, 2], "texCoord": 0}}},
    "metallicRoughnessTexture": {"index": 1}},
  "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2},
  "KHR_materials_ior": {"ior": 1.4},
    "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": )" +
                 t + R"(, "specularColorFactor": [1, 0.5, 1], "specularColorTexture": )" + t + R"(},
    "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 1,
    "anisotropyTexture": )" +
                 t + R"(},
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatTexture": )" +
                 t + R"(, "clearcoatRoughnessFactor": 0.2, "clearcoatNormalTexture": )" + t + R"(},
    "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.4, 0.3], "sheenColorTexture": )" +
                 t + R"(, "sheenRoughnessFactor": 0.3},
    "KHR_materials_iridescence": {"iridescenceFactor": 0.8, "iridescenceIor": 1.3,
    "iridescenceThicknessMinimum": 100, "iridescenceThicknessMaximum": 500,
    "iridescenceThicknessTexture": )" +
                 t + R"(},
    "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture": )" +
                 t + R"(},
    "KHR_materials_volume": {"thicknessFactor": 0.5, "attenuationDistance": 0.3,
    "attenuationColor": [0.5, 0.7, 0.9]},
    "KHR_materials_dispersion": {"dispersion": 0.3},
    "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.2,
    "diffuseTransmissionColorFactor": [1, 1, 0]}},
    "extras": {"ior_sellmeier": {"b": [1.04, 0.232, 1.01], "c_um2": [0.006, 0.02, 103.6]}}})");
  writer.add("materials", R"({"extensions": {"KHR_materials_unlit": {}},)"
                          R"( "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
  writer.add(
      "materials",
      R"({"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0.5,)"
      R"( 0.5, 1], "diffuseTexture": )" +
          t +
          R"(, "specularFactor": [0.2, 0.3, 0.4], "glossinessFactor": 0.6,)"
          R"( "specularGlossinessTexture": )" +
          t + "}}}");
  const std::string common = R"("attributes": {"POSITION": )" + number(positions) +
                             R"(, "NORMAL": )" + number(normals) + R"(, "TEXCOORD_0": )" +
                             number(uv);
  writer.add("meshes",
             R"({"weights": [0.2, 0.1], "primitives": [{)" + common + R"(, "COLOR_0": )" +
                 number(colors) + R"(, "JOINTS_0": )" + number(joints) + R"(, "WEIGHTS_0": )" +
                 number(weights) + R"(}, "indices": )" + number(indices) +
                 R"(, "material": 0, "targets": [{"POSITION": )" + number(moved) +
                 R"(}, {"POSITION": )" + number(sparse) +
                 R"(}], "extensions": {"KHR_materials_variants": {"mappings": [{"material": 1,)"
                 R"( "variants": [0]}]}}}]})");
  writer.add("meshes", R"({"primitives": [{)" + common + R"(}, "mode": 5, "material": 1}, {)" +
                           common + R"(}, "material": 2, "mode": 6}]})");
  writer.add("nodes", R"({"mesh": 0, "skin": 0})");
  writer.add(
      "nodes",
      R"({"children": [2], "translation": [0.1, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1,)"
      R"( 1, 1]})");
  writer.add("nodes", R"({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]})");
  writer.add("nodes", R"({"mesh": 1, "extensions": {"KHR_node_visibility": {"visible": true},)"
                      R"( "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": )" +
                          number(ways) + R"(, "ROTATION": )" + number(turns) + "}}}}");
  writer.add("nodes", R"({"camera": 0, "translation": [0, 0, 5]})");
  writer.add("nodes", R"({"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 0}}})");
  writer.add("nodes",
             R"({"extensions": {"KHR_lights_punctual": {"light": 1}}, "translation": [0, 2, 2]})");
  writer.add("cameras",
             R"({"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 100,)"
             R"( "aspectRatio": 1.5}})");
  writer.add("cameras",
             R"({"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 2, "znear": 0.1,)"
             R"( "zfar": 100}})");
  writer.add("skins",
             R"({"joints": [1, 2], "skeleton": 1, "inverseBindMatrices": )" + number(bind) + "}");
  const auto sampler = [times](int output, const char* how) {
    return R"({"input": )" + number(times) + R"(, "output": )" + number(output) +
           R"(, "interpolation": ")" + how + R"("})";
  };
  writer.add("animations",
             R"({"samplers": [)" + sampler(ways, "LINEAR") + ", " + sampler(turns, "STEP") + ", " +
                 sampler(cubic, "CUBICSPLINE") + ", " + sampler(amounts, "LINEAR") + ", " +
                 sampler(times, "LINEAR") +
                 R"(], "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}},
  {"sampler": 1, "target": {"node": 1, "path": "rotation"}}, {"sampler": 2, "target": {"node": 1,
  "path": "scale"}},
  {"sampler": 3, "target": {"node": 0, "path": "weights"}},
  {"sampler": 4, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer":
  {"pointer": "/materials/0/pbrMetallicRoughness/roughnessFactor"}}}}]})");
  writer.set("extensions",
             R"({"KHR_lights_punctual": {"lights": [{"type": "spot", "color": [1, 1, 0.5],)"
             R"( "intensity": 5, "range": 20,
  "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}, {"type": "point", "intensity": 3}]},
  "EXT_lights_image_based": {"lights": [{"intensity": 0.5, "rotation": [0, 0, 0, 1],
  "irradianceCoefficients": [[1, 1, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0],
  [0, 0, 0], [0, 0, 0], [0, 0, 0]], "specularImageSize": 2,
  "specularImages": [[0, 0, 0, 0, 0, 0]]}]},
  "KHR_materials_variants": {"variants": [{"name": "v"}]}})");
  writer.add("scenes", R"({"nodes": [0, 1, 3, 4, 5, 6],)"
                       R"( "extensions": {"EXT_lights_image_based": {"light": 0}}})");
  writer.set("extensionsRequired", R"(["KHR_texture_transform"])");
  auto separate = writer.finish_separate("a.bin");
  return {std::move(separate.json), std::move(separate.bin)};
}

class GltfMutation : public testing::Test {
 protected:
  /// Expects a refusal with its path, or a scene that renders to finite values.
  void expect_answer(const std::string& json, const core::Bytes& bin, const std::string& what) {
    ++cases_;
    core::GltfOptions options;
    options.time_seconds = 0.4;
    options.limits.triangles_max = 10'000;
    options.limits.instances_max = 1'000;
    options.limits.decoded_bytes_max = std::size_t{16} << 20U;
    options.limits.image_side_max = 256;
    const auto buffer = std::make_shared<const core::Bytes>(bin);
    const auto resolve = [&buffer](std::string_view uri) {
      return uri == "a.bin" ? buffer : core::SharedBytes();
    };
    auto description = core::load_gltf(std::as_bytes(std::span(json)), resolve, options);
    if (!description) {
      ++refused_;
      EXPECT_FALSE(description.error().message.empty()) << what;
      const core::ErrorCode code = description.error().code;
      EXPECT_TRUE(code == core::ErrorCode::kInvalidArgument || code == core::ErrorCode::kTooLarge ||
                  code == core::ErrorCode::kMissingFiles)
          << what << ": " << description.error().message;
      const std::string& where = description.error().where;
      EXPECT_TRUE(where.empty() || where.front() == '/') << what << ": " << where;
      named_ += where.empty() ? 0 : 1;
      return;
    }
    auto scene = core::Scene::build(*std::move(description), 1);
    if (!scene) {
      ++refused_;
      EXPECT_FALSE(scene.error().message.empty()) << what;
      return;
    }
    if (cases_ % 4 != 0) {
      return;  // one image in four suffices for every kind
    }
    core::View view = test_support::view_of(*scene, 4, 4);
    view.environment = test_support::constant_sky({1, 1, 1});
    const test_support::Picture picture = test_support::render(view, 2, 1);
    EXPECT_TRUE(std::isfinite(picture.mean().r + picture.mean().g + picture.mean().b)) << what;
    EXPECT_EQ(picture.progress.rejected_samples, 0U) << what;
  }

  int cases_ = 0;
  int refused_ = 0;
  int named_ = 0;
};

TEST_F(GltfMutation, ReadsAndRendersTheUnchangedDocument) {
  const Document d = everything();
  for (int i = 0; i < 4; ++i) {
    expect_answer(d.json, d.bin, "whole");
  }
  EXPECT_EQ(refused_, 0);
}

TEST_F(GltfMutation, EveryChangedValueIsRefusedOrValid) {
  const Document d = everything();
  const Json root = Json::parse(d.json);
  const std::vector<Json> values = {nullptr,
                                    true,
                                    -1,
                                    0,
                                    1,
                                    7,
                                    0.5,
                                    1e30,
                                    -1e300,
                                    4294967296.0,
                                    9007199254740993.0,
                                    "",
                                    "../../etc/passwd",
                                    "data:,",
                                    Json::array(),
                                    Json::array({1, "x"}),
                                    Json::object()};
  std::vector<Json::json_pointer> places;
  const std::function<void(const Json&, const Json::json_pointer&)> walk =
      [&](const Json& value, const Json::json_pointer& at) {
        if (!at.empty()) {
          places.push_back(at);
        }
        if (value.is_object()) {
          for (const auto& [name, member] : value.items()) {
            walk(member, at / name);
          }
        } else if (value.is_array()) {
          for (std::size_t i = 0; i < std::min<std::size_t>(value.size(), 3); ++i) {
            walk(value[i], at / i);
          }
        }
      };
  walk(root, Json::json_pointer());
  ASSERT_GT(places.size(), 300U);
  std::size_t n = 0;
  for (const auto& at : places) {
    for (std::size_t k = 0; k < 4;
         ++k) {  // round-robin, so that each path gets four and each value many paths
      Json changed = root;
      const Json& value = values[n++ % values.size()];
      changed[at] = value;
      expect_answer(changed.dump(), d.bin, at.to_string() + " = " + value.dump());
    }
    Json without = root;
    Json& parent = without[at.parent_pointer()];
    if (parent.is_object()) {
      parent.erase(at.back());
    } else {
      parent.erase(static_cast<std::size_t>(std::stoul(at.back())));
    }
    expect_answer(without.dump(), d.bin, "no " + at.to_string());
    if (root.at(at).is_number()) {
      for (const double factor : {-1.0, 1.0, 1e6}) {
        Json moved = root;
        moved[at] =
            factor == 1.0 ? root.at(at).get<double>() + 1 : root.at(at).get<double>() * factor;
        expect_answer(moved.dump(), d.bin, at.to_string() + " moved");
      }
    }
  }
  EXPECT_GT(cases_, 2000);
  EXPECT_GT(refused_, cases_ / 4);
  EXPECT_GT(named_, refused_ * 9 / 10);  // with their path
}

TEST_F(GltfMutation, RefusesCyclesOfNodes) {
  const Document d = everything();
  const Json root = Json::parse(d.json);
  const std::size_t nodes = root["nodes"].size();
  for (std::size_t from = 0; from < nodes; ++from) {
    for (std::size_t to = 0; to < nodes; ++to) {
      Json changed = root;
      changed["nodes"][from]["children"] = Json::array({to});
      changed["nodes"][to]["children"] = Json::array({from});
      const int before = refused_;
      expect_answer(changed.dump(), d.bin, "loop");
      EXPECT_EQ(refused_, before + 1) << from << " " << to;
    }
  }
}

TEST_F(GltfMutation, CorruptedBytesAreRefusedOrValid) {
  const Document d = everything();
  std::mt19937 random(1);
  std::size_t bytes = 0;  // in use; behind them is padding
  const Json document = Json::parse(d.json);
  for (const Json& view : document["bufferViews"]) {
    bytes = std::max(
        bytes, view.value("byteOffset", std::size_t{0}) + view["byteLength"].get<std::size_t>());
  }
  for (std::size_t cut = 0; cut < bytes; cut += std::max<std::size_t>(bytes / 60, 1)) {
    const int before = refused_;
    expect_answer(d.json,
                  core::Bytes(d.bin.begin(), d.bin.begin() + static_cast<std::ptrdiff_t>(cut)),
                  "cut");
    EXPECT_EQ(refused_, before + 1) << cut;
  }
  for (int i = 0; i < 300; ++i) {
    core::Bytes spoilt = d.bin;
    for (int k = 0; k < 4; ++k) {
      const std::size_t at =
          std::uniform_int_distribution<std::size_t>(0, spoilt.size() - 5)(random);
      const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                           std::numeric_limits<float>::infinity(), 3e38F, 1e-40F};
      if (i % 2 == 0) {
        std::memcpy(&spoilt[at / 4 * 4], &bad[static_cast<std::size_t>(k)], 4);
      } else {
        spoilt[at] ^= static_cast<std::byte>(1U << (random() % 8U));
      }
    }
    expect_answer(d.json, spoilt, "spoilt " + std::to_string(i));
  }
}

}  // namespace
