#include "tests/unit/server/server_test_support.h"

#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include <zlib.h>

#include "core/base/check.h"

namespace test_support {
namespace {

void put16(std::string& out, std::uint32_t value) {
  out += static_cast<char>(value & 0xffU);
  out += static_cast<char>((value >> 8U) & 0xffU);
}

void put32(std::string& out, std::uint32_t value) {
  put16(out, value & 0xffffU);
  put16(out, value >> 16U);
}

std::string deflated(const std::string& content) {
  z_stream stream = {};
  CHECK(deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string plain = content;
  std::string packed(compressBound(static_cast<uLong>(plain.size())) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  CHECK(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "tessera-test-XXXXXX").string();
  CHECK(::mkdtemp(name.data()) != nullptr);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code code;
  std::filesystem::remove_all(path_, code);
}

core::Bytes bytes_of(std::string_view text) {
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return core::Bytes(first, first + text.size());
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

void write_file(const std::string& path, std::string_view content) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
}

void damage_file(const std::string& path, std::uint64_t offset) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekg(static_cast<std::streamoff>(offset));
  const int byte = file.get();
  file.seekp(static_cast<std::streamoff>(offset));
  file.put(static_cast<char>(byte ^ 1));
}

core::FilmSettings small_film() {
  core::FilmSettings settings;
  settings.width = 70;
  settings.height = 40;
  return settings;
}

core::TileState made_tile(const core::Film& film, int tile, int samples) {
  core::TileState state = film.tile(tile);
  state.samples = samples;
  for (std::size_t i = 0; i < state.pixels.size(); ++i) {
    const float value = static_cast<float>(samples * 1000 + tile) + 0.001F * static_cast<float>(i);
    state.pixels[i] = {value, value + 1,     value + 2,
                       0.5F,  value * 0.25F, static_cast<std::uint32_t>(samples)};
  }
  for (std::size_t i = 0; i < state.aux.size(); ++i) {
    state.aux[i].depth_m = static_cast<float>(i);
    state.aux[i].hits = static_cast<std::uint32_t>(samples);
  }
  state.rays = static_cast<std::uint64_t>(samples) * 10;
  state.cpu_seconds = 0.25 * samples;
  state.rejected_samples = static_cast<std::uint64_t>(tile);
  return state;
}

std::string make_zip(const std::vector<ZipFile>& files) {
  std::string archive;
  std::string directory;
  for (const ZipFile& file : files) {
    const std::string packed = file.deflate ? deflated(file.content) : file.content;
    const auto crc = static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(file.content.data()), file.content.size()));
    const auto offset = static_cast<std::uint32_t>(archive.size());
    std::string common;
    put16(common, 20);
    put16(common, 0);
    put16(common, file.deflate ? 8 : 0);
    put32(common, 0);
    put32(common, crc);
    put32(common, static_cast<std::uint32_t>(packed.size()));
    put32(common, static_cast<std::uint32_t>(file.content.size()));
    put16(common, static_cast<std::uint32_t>(file.name.size()));
    put16(common, 0);
    put32(archive, 0x04034b50);
    archive += common + file.name + packed;
    put32(directory, 0x02014b50);
    put16(directory, 20);
    directory += common;
    put16(directory, 0);
    put16(directory, 0);
    put16(directory, 0);
    put32(directory, 0);
    put32(directory, offset);
    directory += file.name;
  }
  const auto start = static_cast<std::uint32_t>(archive.size());
  archive += directory;
  put32(archive, 0x06054b50);
  put16(archive, 0);
  put16(archive, 0);
  put16(archive, static_cast<std::uint32_t>(files.size()));
  put16(archive, static_cast<std::uint32_t>(files.size()));
  put32(archive, static_cast<std::uint32_t>(directory.size()));
  put32(archive, start);
  put16(archive, 0);
  return archive;
}

std::string triangle_gltf(std::string_view uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
         R"("min":[0,0,0],"max":[1,1,0]}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
         R"("buffers":[{"uri":")" +
         std::string(uri) + R"(","byteLength":36}]})";
}

std::string triangle_buffer() {
  constexpr std::array<float, 9> kCorners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::string buffer(sizeof kCorners, '\0');
  std::memcpy(buffer.data(), kCorners.data(), sizeof kCorners);
  return buffer;
}

}  // namespace test_support
