// A render to count instructions of: instructions_bench SCENE SAMPLES, one thread, 64x64 pixels.
// SCENE: a built-in one, or GLTF,HDR. `tests/bench/run --instructions` runs it under callgrind.
#include <cstdio>
#include <cstdlib>

#include "tests/bench/named_view.h"
#include "tests/support/scenes.h"

namespace {

constexpr int kSide = 64;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("instructions_bench SCENE SAMPLES\n", stderr);
    return 2;
  }
  const test_support::Picture p =
      test_support::render(bench::named_view(argv[1], kSide, kSide), std::atoi(argv[2]), 1);
  std::printf("%d pixels, %.3f rays a sample\n", kSide * kSide,
              static_cast<double>(p.progress.rays) / p.progress.samples_mean / kSide / kSide);
  return 0;
}
