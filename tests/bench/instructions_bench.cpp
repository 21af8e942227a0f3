// A render whose instructions are counted: instructions_bench SCENE SAMPLES [CONTINUATIONS], one
// thread, 64x64 pixels. SCENE: see named_view.h. CONTINUATIONS: of each path, as with fixed
// splitting. `tests/bench/run --instructions` runs it under callgrind.
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "tests/bench/named_view.h"
#include "tests/support/scenes.h"

namespace {

constexpr int kSide = 64;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fputs("instructions_bench SCENE SAMPLES [CONTINUATIONS]\n", stderr);
    return 2;
  }
  core::View view = bench::named_view(argv[1], kSide, kSide);
  if (argc == 4) {
    view.settings.estimator.splitting = core::SplittingType::kFixed;
    view.settings.estimator.split_count = std::atoi(argv[3]);
  }
  const test_support::Picture p = test_support::render(std::move(view), std::atoi(argv[2]), 1);
  std::printf("%d pixels, %.3f rays a sample\n", kSide * kSide,
              static_cast<double>(p.progress.rays) / p.progress.samples_mean / kSide / kSide);
  return 0;
}
