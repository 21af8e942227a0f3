// A render to count instructions of: instructions_bench SCENE SAMPLES, one thread, 64x64 pixels.
// SCENE: a built-in one, or GLTF,HDR. `tests/bench/run --instructions` runs it under callgrind.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "core/base/check.h"
#include "tests/bench/bench_views.h"
#include "tests/render/asset_files.h"
#include "tests/support/scenes.h"

namespace {

constexpr int kSide = 64;

core::View view_of(const std::string& name) {
  const std::size_t comma = name.find(',');
  if (comma == std::string::npos) {
    return bench::builtin_view(name, kSide, kSide);
  }
  auto description = test_support::load_asset(name.substr(0, comma));
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 1);
  CHECK(scene);
  core::View view = test_support::view_of(*scene, kSide, kSide);
  view.environment = test_support::load_sky(name.substr(comma + 1));
  return view;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("instructions_bench SCENE SAMPLES\n", stderr);
    return 2;
  }
  const test_support::Picture p = test_support::render(view_of(argv[1]), std::atoi(argv[2]), 1);
  std::printf("%d pixels, %.3f rays a sample\n", kSide * kSide,
              static_cast<double>(p.progress.rays) / p.progress.samples_mean / kSide / kSide);
  return 0;
}
