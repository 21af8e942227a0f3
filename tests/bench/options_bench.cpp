// Efficiency of each option of the estimators relative to the defaults, and scaling of the light
// samplers. Prints, never asserts: times depend on the machine and its load.
//
// Efficiency is 1 / (V T): V the mean over pixels of the image's variance relative to mu^2 + 0.01,
// from the difference of its halves; mu the mean of images of the default with other seeds; T the
// CPU seconds of the pixels. V is of the luminance; the column `colour` has the mean of the three
// channels' variances instead. Options alternate in rounds, so that a slow phase of the machine
// affects all of them.
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/scene/scene_data.h"
#include "tests/bench/named_view.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using core::View;

struct Option {
  std::string name;
  core::RenderSettings settings;
};

struct Plan {
  int width = 96;
  int height = 54;
  int samples = 16;
  int rounds = 4;
  bool is_short = false;
  std::string only;   ///< options with this prefix, and the default
  std::string scene;  ///< of view_of_name(); empty: five built-in ones
};

struct Cost {
  double variance = 0;
  double color_variance = 0;
  double seconds = 0;
  double rays = 0;
  double efficiency() const { return 1 / (variance * seconds); }
};

template <typename Change>
Option option(std::string name, const Change& change) {
  Option o{std::move(name), {}};
  change(o.settings);
  return o;
}

std::vector<Option> options() {
  using core::LightSamplerType;
  using core::RouletteType;
  using core::SplittingType;
  using S = core::RenderSettings;
  std::vector<Option> all = {{"default", {}}};
  for (const int m : {2, 4, 8}) {
    all.push_back(option("light_sampler.ris " + std::to_string(m), [m](S& s) {
      s.light_sampler = LightSamplerType::kRis;
      s.light_candidates = m;
    }));
  }
  // Side of the squares, passes, light samples per path.
  for (const auto& [block, history, m] :
       {std::array{1, 4, 1}, std::array{2, 1, 1}, std::array{2, 2, 1}, std::array{2, 4, 1},
        std::array{3, 1, 1}, std::array{3, 2, 1}, std::array{3, 4, 1}, std::array{4, 1, 1},
        std::array{4, 2, 1}, std::array{4, 4, 1}, std::array{5, 1, 1}, std::array{5, 2, 1},
        std::array{3, 1, 2}}) {
    const std::string name = std::to_string(block) +
                             (history > 1 ? " x " + std::to_string(history) : "") +
                             (m > 1 ? " of " + std::to_string(m) : "");
    all.push_back(
        option("light_sampler.restir " + name, [block = block, history = history, m = m](S& s) {
          s.light_sampler = LightSamplerType::kRestir;
          s.light_block = block;
          s.light_history = history;
          s.block_candidates = m;
        }));
  }
  all.push_back(
      option("light_sampler.power", [](S& s) { s.light_sampler = LightSamplerType::kPower; }));
  all.push_back(
      option("light_sampler.uniform", [](S& s) { s.light_sampler = LightSamplerType::kUniform; }));
  all.push_back(option("roulette.none", [](S& s) { s.estimator.roulette = RouletteType::kNone; }));
  for (const float delta : {0.02F, 0.1F, 0.5F}) {
    char name[40];
    std::snprintf(name, sizeof name, "roulette.threshold %g", static_cast<double>(delta));
    all.push_back(option(name, [delta](S& s) {
      s.estimator.roulette = RouletteType::kThreshold;
      s.estimator.roulette_delta = delta;
    }));
  }
  for (const int n : {2, 4}) {
    all.push_back(option("splitting.fixed " + std::to_string(n), [n](S& s) {
      s.estimator.splitting = SplittingType::kFixed;
      s.estimator.split_count = n;
    }));
  }
  all.push_back(
      option("splitting.measured", [](S& s) { s.estimator.splitting = SplittingType::kMeasured; }));
  all.push_back(option("expected_values.false", [](S& s) { s.estimator.expected_values = false; }));
  all.push_back(option("mis.balance", [](S& s) { s.estimator.mis = core::MisType::kBalance; }));
  all.push_back(option("mis.maximum", [](S& s) { s.estimator.mis = core::MisType::kMaximum; }));
  all.push_back(option("mis.optimal", [](S& s) { s.estimator.mis = core::MisType::kOptimal; }));
  for (const auto& [name, type] :
       {std::pair{"control_variate.analytic", core::ControlVariateType::kAnalytic},
        std::pair{"control_variate.regression", core::ControlVariateType::kRegression}}) {
    all.push_back(option(name, [type = type](S& s) { s.estimator.control_variate = type; }));
  }
  all.push_back(option("spectral", [](S& s) { s.spectral = true; }));
  return all;
}

/// `emitters` small triangles in all orientations over a square floor, which is the only visible
/// surface; constant total power.
View swarm(int emitters, const Plan& plan) {
  test_support::Random random(7);
  const auto number = [&random](float low, float high) {
    return low + (high - low) * random.uniform();
  };
  core::PrimitiveDescription lights;
  lights.material = 1;
  const float side = 0.5F / std::sqrt(static_cast<float>(emitters));
  for (int i = 0; i < emitters; ++i) {
    const core::Vec3 at = {number(-4, 4), number(0.6F, 3), number(-4, 4)};
    const auto corner = [&] {
      return at + core::Vec3{number(-side, side), number(-side, side), number(-side, side)};
    };
    for (int k = 0; k < 3; ++k) {
      lights.indices.push_back(static_cast<std::uint32_t>(lights.positions.size()));
      lights.positions.push_back(corner());
    }
  }
  View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(0.7F)), test_support::emitter(Rgb(30))},
                             {test_support::quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0), lights}),
      plan.width, plan.height);
  test_support::look_at(view, {0, 0.5F, 0.5F}, {0, 0, 0}, 50);
  view.settings.max_depth = 3;
  return view;
}

/// A ball of dense flint glass (n_d 1.7847, V_d 25.76: SF11 of Schott's data sheet) on a floor
/// under a square emitter and a dim sky.
View dispersive_ball(float roughness, const Plan& plan) {
  core::MaterialDescription flint;
  flint.metallic = 0;
  flint.roughness = roughness;
  flint.transmission = 1;
  flint.thickness = 1;
  flint.ior = 1.7847F;
  flint.dispersion = 20 / 25.76F;
  View view = test_support::view_of(
      test_support::scene_of(
          {test_support::lambert(Rgb(0.7F)), flint, test_support::emitter(Rgb(10))},
          {test_support::quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0),
           test_support::sphere({0, 0.6F, 0}, 0.6F, 64, false, 1),
           test_support::quad({1, 3, -0.4F}, {0.8F, 0, 0}, {0, 0, 0.8F}, 2)}),
      plan.width, plan.height);
  test_support::look_at(view, {0, 1.2F, 3}, {0, 0.5F, 0}, 35);
  view.environment = test_support::constant_sky(Rgb(0.2F));
  return view;
}

/// The dispersive balls above, or a name of named_view().
View view_of_name(const std::string& name, const Plan& plan) {
  if (name == "ball") {
    return dispersive_ball(0, plan);
  }
  if (name == "rough-ball") {
    return dispersive_ball(0.3F, plan);
  }
  return bench::named_view(name, plan.width, plan.height);
}

std::vector<double> means(const View& view, int samples) {
  const auto film = test_support::render(view, samples).snapshot;
  std::vector<double> out;
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    out.push_back(static_cast<double>(core::luminance(core::pixel_value(film, p).mean)));
  }
  return out;
}

void add(Cost& cost, const View& view, int samples, const std::vector<double>& mu) {
  const test_support::Picture picture = test_support::render(view, samples);
  const auto& film = picture.snapshot;
  double sum = 0;
  double colors = 0;
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    const Rgb d = core::half_value(film, p, 0).mean - core::half_value(film, p, 1).mean;
    const auto y = static_cast<double>(core::luminance(d));
    const double weight = 1 / (4 * (mu[p] * mu[p] + 0.01));
    sum += y * y * weight;
    colors += static_cast<double>(d.r * d.r + d.g * d.g + d.b * d.b) / 3 * weight;
  }
  cost.variance += sum / static_cast<double>(film.pixel_count());
  cost.color_variance += colors / static_cast<double>(film.pixel_count());
  cost.seconds += picture.progress.cpu_seconds;
  cost.rays += static_cast<double>(picture.progress.rays);
}

std::vector<Cost> compare(View view, const std::vector<Option>& all, const Plan& plan) {
  view.settings.seed = 1000;
  const std::vector<double> mu = means(view, plan.samples * (plan.is_short ? 2 : 8));
  std::vector<Cost> costs(all.size());
  for (int round = 0; round < plan.rounds; ++round) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      View one = view;
      one.settings.estimator = all[i].settings.estimator;
      one.settings.light_sampler = all[i].settings.light_sampler;
      one.settings.light_candidates = all[i].settings.light_candidates;
      one.settings.light_block = all[i].settings.light_block;
      one.settings.light_history = all[i].settings.light_history;
      one.settings.block_candidates = all[i].settings.block_candidates;
      one.settings.spectral = all[i].settings.spectral;
      one.settings.seed = static_cast<std::uint64_t>(round);
      add(costs[i], one, plan.samples, mu);
    }
  }
  return costs;
}

void print_options(const Plan& plan) {
  std::vector<Option> all = options();
  std::erase_if(
      all, [&](const Option& o) { return o.name != "default" && o.name.rfind(plan.only, 0) != 0; });
  std::vector<std::string> scenes = {"cornell-box", "veach-mis", "many-lights", "glass",
                                     "interior"};
  if (!plan.scene.empty()) {
    scenes = {plan.scene};
  }
  for (const std::string& name : scenes) {
    const std::vector<Cost> costs = compare(view_of_name(name, plan), all, plan);
    std::printf("\n%-26s%12s%12s%12s%12s%12s\n", name.c_str(), "efficiency", "variance", "colour",
                "seconds", "rays");
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Cost& c = costs[i];
      std::printf("%-26s%12.3f%12.3f%12.3f%12.3f%12.3f\n", all[i].name.c_str(),
                  c.efficiency() / costs[0].efficiency(), c.variance / costs[0].variance,
                  c.color_variance / costs[0].color_variance, c.seconds / costs[0].seconds,
                  c.rays / costs[0].rays);
    }
    std::fflush(stdout);
  }
}

void print_light_samplers(const Plan& plan) {
  using core::LightSamplerType;
  std::vector<Option> all;
  for (const auto& [name, type] :
       {std::pair{"uniform", LightSamplerType::kUniform},
        std::pair{"power", LightSamplerType::kPower}, std::pair{"tree", LightSamplerType::kTree},
        std::pair{"ris", LightSamplerType::kRis}, std::pair{"restir", LightSamplerType::kRestir}}) {
    all.push_back(option(name, [type = type](core::RenderSettings& s) { s.light_sampler = type; }));
  }
  std::printf(
      "\nlight samplers: V T, in CPU seconds for a relative variance of 1e-4; CPU seconds of scene "
      "and tree\n%-10s%12s%12s",
      "emitters", "build s", "tree s");
  for (const Option& o : all) {
    std::printf("%12s", o.name.c_str());
  }
  std::printf("\n");
  for (const int emitters : {1, 100, 10000, 300000}) {
    const std::clock_t start = std::clock();
    const View view = swarm(emitters, plan);
    const double build = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    std::vector<core::LightBounds> bounds;
    for (const core::TriangleLight& t : view.scene->data().triangle_lights) {
      core::LightBounds b;
      b.box.add(t.p0);
      b.box.add(t.p0 + t.edge1);
      b.box.add(t.p0 + t.edge2);
      b.axis = t.normal;
      b.power = core::luminance(t.radiance) * t.area_m2;
      bounds.push_back(b);
    }
    const std::clock_t tree_start = std::clock();
    const core::LightTree tree(bounds);
    const double tree_seconds = static_cast<double>(std::clock() - tree_start) / CLOCKS_PER_SEC;
    CHECK(tree.bytes() > 0);
    std::printf("%-10d%12.3f%12.3f", emitters, build, tree_seconds);
    for (const Cost& c : compare(view, all, plan)) {
      std::printf("%12.4f", c.variance / plan.rounds * (c.seconds / plan.rounds) / 1e-4);
    }
    std::printf("\n");
  }
}

}  // namespace

// [--short] [--samples N] [--only NAME] [--scene NAME]: estimators fitted to the samples of the
// image need more than the usual 16.
int main(int argc, char** argv) {
  Plan plan;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    if (flag == "--short") {
      plan = {48, 27, 8, 1, true, "", ""};
    } else if (flag == "--samples" && i + 1 < argc) {
      plan.samples = std::stoi(argv[++i]);
    } else if (flag == "--only" && i + 1 < argc) {
      plan.only = argv[++i];
    } else if (flag == "--scene" && i + 1 < argc) {
      plan.scene = argv[++i];
    } else {
      std::fprintf(stderr,
                   "usage: options_bench [--short] [--samples N] [--only NAME] [--scene NAME]\n");
      return 2;
    }
  }
  std::printf(
      "%dx%d, %d samples per pixel, %d rounds, 2 threads, box filter, max_depth 16; all over the "
      "default's\n",
      plan.width, plan.height, plan.samples, plan.rounds);
  print_options(plan);
  if (plan.only.empty() && plan.scene.empty()) {
    print_light_samplers(plan);
  }
  return 0;
}
