/// A renderer without a scene: a function of random numbers gives each sample, so the expected
/// value is known. Everything else (tasks, slices, plans, films) is the product's own.
#pragma once

#include <functional>

#include "core/render/task/render_task.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace test_support {

struct Synthetic {
  int width = 64;
  int height = 64;
  int replicates = 2;
  core::AdaptiveSettings adaptive;
  /// A sample of a pixel; the same in all channels.
  std::function<float(Random& random, int x, int y)> sample;
};

/// Renders `samples` per pixel to the end; all random numbers depend on seed.
Picture render(const Synthetic& synthetic, int samples, std::uint64_t seed, int threads = 1);

/// Rare light: `value` with probability 1 / value, else 0; expected value 1, variance value - 1.
float rare_event(Random& random, float value);

}  // namespace test_support
