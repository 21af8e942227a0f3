// Time and memory for large glTF files: load_bench [--triangles N] [--instances N] [FILE...].
// Without a file, a GLB of N triangles and one of N instances are first made in memory. Prints,
// never asserts.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/scene_io/glb_writer.h"
#include "tests/support/asset_files.h"
#include "tests/support/scenes.h"

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Peak resident size of the process so far, MiB; Linux.
double peak_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) {
      return std::atof(line.c_str() + 6) / 1024;
    }
  }
  return 0;
}

core::Bytes terrain_glb(int triangles) {
  const int side = std::max(1, static_cast<int>(std::sqrt(triangles / 2)));
  core::PrimitiveDescription p;
  for (int j = 0; j <= side; ++j) {
    for (int i = 0; i <= side; ++i) {
      const float x = static_cast<float>(i) / static_cast<float>(side);
      const float z = static_cast<float>(j) / static_cast<float>(side);
      p.positions.push_back({x, 0.05F * std::sin(40 * x) * std::cos(30 * z), z});
      p.normals.push_back({0, 1, 0});
      p.uv[0].push_back({x, z});
    }
  }
  const auto at = [side](int i, int j) { return static_cast<std::uint32_t>(j * (side + 1) + i); };
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      p.indices.insert(p.indices.end(), {at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j),
                                         at(i, j + 1), at(i + 1, j + 1)});
    }
  }
  return core::write_glb(test_support::scene_of({core::MaterialDescription{}}, {std::move(p)}));
}

core::Bytes instances_glb(int count) {
  core::SceneDescription scene = test_support::scene_of(
      {core::MaterialDescription{}}, {test_support::sphere({0, 0, 0}, 0.4F, 12, false, 0)});
  const int side = std::max(1, static_cast<int>(std::sqrt(count)));
  scene.instances.clear();
  for (int i = 0; i < count; ++i) {
    scene.instances.push_back(
        {0, core::translation({static_cast<float>(i % side), 0, static_cast<float>(i / side)})});
  }
  return core::write_glb(scene);
}

void report(const std::string& name, std::size_t file_bytes,
            core::Result<core::SceneDescription> description, double load_seconds) {
  if (!description) {
    std::printf("%s: %s\n", name.c_str(), description.error().message.c_str());
    return;
  }
  const auto start = std::chrono::steady_clock::now();
  const auto scene = core::Scene::build(*std::move(description), 2);
  CHECK(scene);
  const double build_seconds = seconds_since(start);
  const core::SceneSummary& s = (*scene)->summary();
  std::printf(
      "%s: %.1f MB file, %zu triangles as placed, %zu instances: read %.2f s, build %.2f s, "
      "%.1f bytes a triangle, %.1f MB, peak of the process %.0f MiB\n",
      name.c_str(), static_cast<double>(file_bytes) / 1e6, s.triangles, s.instances, load_seconds,
      build_seconds,
      static_cast<double>(s.bytes) / static_cast<double>(std::max<std::size_t>(s.triangles, 1)),
      static_cast<double>(s.bytes) / 1e6, peak_mib());
}

void report_glb(const std::string& name, const core::Bytes& glb) {
  const auto start = std::chrono::steady_clock::now();
  auto scene = core::load_gltf(glb, [](std::string_view) { return core::SharedBytes(); }, {});
  report(name, glb.size(), std::move(scene), seconds_since(start));
}

}  // namespace

int main(int argc, char** argv) {
  int triangles = 10'000'000;
  int instances = 10'000;
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--triangles" && i + 1 < argc) {
      triangles = std::atoi(argv[++i]);
    } else if (name == "--instances" && i + 1 < argc) {
      instances = std::atoi(argv[++i]);
    } else {
      files.push_back(name);
    }
  }
  for (const std::string& file : files) {
    const auto start = std::chrono::steady_clock::now();
    auto scene = test_support::load_asset(file);
    report(file, std::filesystem::file_size(file), std::move(scene), seconds_since(start));
  }
  if (files.empty()) {
    report_glb("instances", instances_glb(instances));
    report_glb("terrain", terrain_glb(triangles));
  }
  return 0;
}
