#include <array>

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::Vec3;

struct Compressed {
  std::vector<unsigned char> data;
  std::size_t count = 0;
  std::size_t stride = 0;
};

// Adds the compressed data, which must be the first bytes of the file's buffer, and a view of their
// content, which has no bytes: buffer 1 is a fallback.
int add_meshopt_view(core::GlbWriter& writer, const Compressed& c, const std::string& mode,
                     const std::string& filter) {
  writer.add_view(bytes(c.data));
  const std::string stride =
      mode == "ATTRIBUTES" ? ",\"byteStride\":" + std::to_string(c.stride) : "";
  return writer.add(
      "bufferViews",
      "{\"buffer\":1,\"byteLength\":" + std::to_string(c.count * c.stride) + stride +
          ",\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteLength\":" +
          std::to_string(c.data.size()) + ",\"byteStride\":" + std::to_string(c.stride) +
          ",\"count\":" + std::to_string(c.count) + ",\"mode\":\"" + mode + "\",\"filter\":\"" +
          filter + "\"}}}");
}

// A scene of one triangle whose positions are compressed.
core::Bytes compressed_positions(const Compressed& c, const std::string& filter, int type,
                                 const char* more) {
  core::GlbWriter writer;
  writer.set("extensionsRequired", R"(["EXT_meshopt_compression","KHR_mesh_quantization"])");
  const int view = add_meshopt_view(writer, c, "ATTRIBUTES", filter);
  const int positions =
      writer.add("accessors", "{\"componentType\":" + number(type) +
                                  ",\"type\":\"VEC3\",\"count\":3,\"bufferView\":" + number(view) +
                                  more + "}");
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) + "}");
  writer.set("buffers", "[{\"byteLength\":" + std::to_string(c.data.size()) +
                            "},{\"byteLength\":" + std::to_string(c.count * c.stride) +
                            ",\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}]");
  return writer.finish();
}

template <typename T>
Compressed encode_vertices(const std::vector<T>& values, std::size_t stride) {
  Compressed c;
  c.stride = stride;
  c.count = values.size() * sizeof(T) / stride;
  c.data.resize(meshopt_encodeVertexBufferBound(c.count, stride));
  c.data.resize(
      meshopt_encodeVertexBuffer(c.data.data(), c.data.size(), values.data(), c.count, stride));
  return c;
}

TEST(GltfMeshopt, DecodesAttributes) {
  const Compressed c = encode_vertices(triangle_positions(), 12);
  const auto p = only_primitive(load(compressed_positions(c, "NONE", kF32, "")));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[1], (Vec3{1, 0, 0}));
}

TEST(GltfMeshopt, UndoesTheExponentialFilter) {
  // 2^E * M with E in the upper 8 bits: 3 * 2^-1 = 1.5.
  const auto exponential = [](int exponent, int mantissa) {
    return static_cast<std::uint32_t>(exponent) << 24U |
           (static_cast<std::uint32_t>(mantissa) & 0xFFFFFFU);
  };
  const std::vector<std::uint32_t> values = {
      exponential(-1, 3), 0, 0, 0, exponential(2, -1), 0, 0, 0, exponential(0, 7)};
  const auto p = only_primitive(
      load(compressed_positions(encode_vertices(values, 12), "EXPONENTIAL", kF32, "")));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[0], (Vec3{1.5F, 0, 0}));
  EXPECT_EQ(p.positions[1], (Vec3{0, -4, 0}));
  EXPECT_EQ(p.positions[2], (Vec3{0, 0, 7}));
}

TEST(GltfMeshopt, UndoesTheOctahedralFilter) {
  // x, y of the octahedron and its size in z: (127, 0, 127) is +x, (0, 127, 127) +y, (0, 0, 127)
  // +z.
  const std::vector<std::int8_t> values = {127, 0, 127, 0, 0, 127, 127, 0, 0, 0, 127, 0};
  const auto p = only_primitive(load(
      compressed_positions(encode_vertices(values, 4), "OCTAHEDRAL", kI8, ",\"normalized\":true")));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[0], (Vec3{1, 0, 0}));
  EXPECT_EQ(p.positions[1], (Vec3{0, 1, 0}));
  EXPECT_EQ(p.positions[2], (Vec3{0, 0, 1}));
}

TEST(GltfMeshopt, RefusesMalformedData) {
  Compressed c = encode_vertices(triangle_positions(), 12);
  c.data[0] = 0x11;
  expect_error_at(load(compressed_positions(c, "NONE", kF32, "")),
                  "/bufferViews/1/extensions/EXT_meshopt_compression");
}

TEST(GltfMeshopt, DecodesIndices) {
  const std::vector<unsigned int> indices = {2, 0, 1};
  Compressed c;
  c.count = 3;
  c.stride = 2;
  c.data.resize(meshopt_encodeIndexBufferBound(3, 3));
  c.data.resize(meshopt_encodeIndexBuffer(c.data.data(), c.data.size(), indices.data(), 3));
  core::GlbWriter writer;
  const int view = add_meshopt_view(writer, c, "TRIANGLES", "NONE");
  const int accessor_index = writer.add(
      "accessors", "{\"componentType\":5123,\"type\":\"SCALAR\",\"count\":3,\"bufferView\":" +
                       number(view) + "}");
  add_triangle(writer, "\"indices\":" + number(accessor_index));
  // The whole binary chunk is buffer 0.
  const std::size_t bin_bytes = (c.data.size() + 3) / 4 * 4 + 36;
  writer.set(
      "buffers",
      "[{\"byteLength\":" + std::to_string(bin_bytes) +
          "},{\"byteLength\":6,\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}]");
  const auto p = only_primitive(load(writer));
  // The codec may rotate the vertices of a triangle, but not reverse them.
  ASSERT_EQ(p.indices.size(), 3U);
  const bool rotated = p.indices == std::vector<std::uint32_t>{2, 0, 1} ||
                       p.indices == std::vector<std::uint32_t>{0, 1, 2} ||
                       p.indices == std::vector<std::uint32_t>{1, 2, 0};
  EXPECT_TRUE(rotated);
}

std::vector<char> encode_draco(int* position_id, int* uv_id) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int positions =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int uv = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  const std::array<std::array<float, 3>, 4> p = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
  const std::array<std::array<float, 2>, 4> t = {{{0, 1}, {1, 1}, {1, 0}, {0, 0}}};
  const std::array<std::array<std::size_t, 3>, 2> faces = {{{0, 1, 2}, {0, 2, 3}}};
  for (std::uint32_t f = 0; f < 2; ++f) {
    const auto& c = faces[f];
    builder.SetAttributeValuesForFace(positions, draco::FaceIndex(f), p[c[0]].data(),
                                      p[c[1]].data(), p[c[2]].data());
    builder.SetAttributeValuesForFace(uv, draco::FaceIndex(f), t[c[0]].data(), t[c[1]].data(),
                                      t[c[2]].data());
  }
  const auto mesh = builder.Finalize();
  *position_id = static_cast<int>(mesh->attribute(positions)->unique_id());
  *uv_id = static_cast<int>(mesh->attribute(uv)->unique_id());
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {buffer.data(), buffer.data() + buffer.size()};
}

core::Bytes draco_square(bool break_it) {
  int position_id = 0;
  int uv_id = 0;
  std::vector<char> data = encode_draco(&position_id, &uv_id);
  if (break_it) {
    data.resize(data.size() / 2);
  }
  core::GlbWriter writer;
  writer.set("extensionsRequired", R"(["KHR_draco_mesh_compression"])");
  const int view = writer.add_view(bytes(data));
  const int positions =
      writer.add("accessors", R"({"componentType":5126,"type":"VEC3","count":4})");
  const int uv = writer.add("accessors", R"({"componentType":5126,"type":"VEC2","count":4})");
  const int indices =
      writer.add("accessors", R"({"componentType":5123,"type":"SCALAR","count":6})");
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"TEXCOORD_0\":" + number(uv) + "},\"indices\":" + number(indices) +
                            ",\"extensions\":{\"KHR_draco_mesh_compression\":{\"bufferView\":" +
                            number(view) + ",\"attributes\":{\"POSITION\":" + number(position_id) +
                            ",\"TEXCOORD_0\":" + number(uv_id) + "}}}");
  return writer.finish();
}

TEST(GltfDraco, DecodesPositionsAndTextureCoordinates) {
  const auto p = only_primitive(load(draco_square(false)));
  ASSERT_EQ(p.indices.size(), 6U);
  ASSERT_EQ(p.uv[0].size(), p.positions.size());
  float area = 0;
  for (std::size_t t = 0; t < 6; t += 3) {
    const Vec3 a = p.positions[p.indices[t]];
    area += core::cross(p.positions[p.indices[t + 1]] - a, p.positions[p.indices[t + 2]] - a).z / 2;
  }
  EXPECT_NEAR(area, 1, 1e-3);
  for (std::size_t v = 0; v < p.positions.size(); ++v) {
    EXPECT_NEAR(p.uv[0][v].x, p.positions[v].x, 2e-3);
    EXPECT_NEAR(p.uv[0][v].y, 1 - p.positions[v].y, 2e-3);
  }
}

TEST(GltfDraco, RefusesTruncatedData) {
  expect_error_at(load(draco_square(true)),
                  "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression");
}

}  // namespace
