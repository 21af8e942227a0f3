#include "tests/unit/server/server_test_support.h"

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>

namespace test_support {

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
