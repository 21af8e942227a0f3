// Memory of a render by its parts: memory_bench [SCENE...]. Prints, never asserts.
//
// SCENE: a glTF file, `hall`, or `triangles`, the hall with two million. Without any: the last two,
// and WaterBottle.glb if the folder of assets is present. "Embree" is what Embree reports for its
// structures plus the positions and indices that it reads in place: what a scene costs if nothing
// is ever shaded.
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include <malloc.h>

#include "core/base/check.h"
#include "core/film/film.h"
#include "core/integrators/integrator.h"
#include "core/scene/scene_data.h"
#include "core/wave/wave.h"
#include "tests/bench/hall.h"
#include "tests/support/asset_files.h"

namespace {

constexpr double kMb = 1e6;

/// Resident size of the process without what the allocator keeps; Linux.
double resident_bytes() {
  malloc_trim(0);
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) {
      return std::atof(line.c_str() + 6) * 1024;
    }
  }
  return 0;
}

void report_film() {
  core::RenderSettings settings;
  settings.film.width = 1920;
  settings.film.height = 1080;
  settings.film.albedo = settings.film.normal = settings.film.depth = false;
  const double pixels = 1920.0 * 1080.0;
  const double before = resident_bytes();
  core::Film film(settings, core::PixelErrors::kIndependent, false);
  for (int t = 0; t < film.tile_count(); ++t) {
    core::TileState tile = film.tile(t);
    tile.samples = 1;
    film.commit(t, std::move(tile));
  }
  std::printf(
      "film         %.1f bytes per pixel by its count, %.1f resident (1920x1080, no layers)\n",
      static_cast<double>(film.bytes()) / pixels, (resident_bytes() - before) / pixels);
}

void report_wave() {
  const std::size_t arrays = sizeof(core::Wave);
  const std::size_t samplers = core::kWavePaths * sizeof(core::PathSampler);
  const std::size_t waiting = core::kWavePaths * sizeof(core::ReturnedPath);
  const std::size_t due = core::kWavePaths * sizeof(core::DueSample);
  std::printf(
      "wave         %.1f KB per thread at most: arrays %.1f, samplers %.1f, paths that left their "
      "lanes %.1f, samples due %.1f\n",
      static_cast<double>(arrays + samplers + waiting + due) / 1e3,
      static_cast<double>(arrays) / 1e3, static_cast<double>(samplers) / 1e3,
      static_cast<double>(waiting) / 1e3, static_cast<double>(due) / 1e3);
}

core::SceneDescription description_of(const std::string& name) {
  if (name == "hall" || name == "triangles") {
    return bench::hall(name == "hall" ? 1.0F : 2.34F);
  }
  auto loaded = test_support::load_asset(name);
  CHECK(loaded);
  return *std::move(loaded);
}

void report_scene(const std::string& name) {
  const double before = resident_bytes();
  const auto scene = core::Scene::build(description_of(name), 2);
  CHECK(scene);
  const double resident = resident_bytes() - before;
  const core::SceneData& data = (*scene)->data();
  double read_by_embree = static_cast<double>(data.accel->bytes());
  double meshes = 0;
  double textures = 0;
  for (const core::MeshData& mesh : data.meshes) {
    read_by_embree += static_cast<double>(mesh.positions.size() * sizeof(core::Vec3) +
                                          mesh.indices.size() * sizeof(std::uint32_t));
    meshes += static_cast<double>(mesh.bytes());
  }
  for (const auto& texture : data.textures) {
    textures += static_cast<double>(texture->bytes());
  }
  const auto total = static_cast<double>((*scene)->summary().bytes);
  std::printf(
      "%-12s %zu triangles: %.1f MB by its count, %.1f resident; structures of Embree %.1f, meshes "
      "%.1f, textures %.1f, rest %.1f; geometry / Embree = %.2f, all / Embree = %.2f\n",
      name.substr(name.rfind('/') + 1).c_str(), (*scene)->summary().triangles, total / kMb,
      resident / kMb, static_cast<double>(data.accel->bytes()) / kMb, meshes / kMb, textures / kMb,
      (total - static_cast<double>(data.accel->bytes()) - meshes - textures) / kMb,
      (total - textures) / read_by_embree, total / read_by_embree);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> scenes(argv + 1, argv + argc);
  if (scenes.empty()) {
    scenes = {"hall", "triangles"};
    if (const auto folder = test_support::assets_folder()) {
      scenes.push_back((*folder / "WaterBottle.glb").string());
    }
  }
  report_film();
  report_wave();
  for (const std::string& name : scenes) {
    report_scene(name);
  }
  return 0;
}
