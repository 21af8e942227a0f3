// Every integrator with equal CPU time on built-in scenes, on scenes of caustics and on nine glTF
// files of the folder of assets, if there is one; and what `auto` chooses, against the best
// that is not biased. Prints, never asserts: times depend on the machine and its load.
//
// relMSE: mean over pixels and channels of (a - b)^2 / (b^2 + 0.01), where b is the reference with
// sixteen times the time and another seed: sppm for the pool, whose underwater light no connection
// finds, path for open scenes, path-caustics for scenes of caustics, bdpt for the others. `without
// 1 %`: the same without the worst hundredth of the pixels, for images whose error is in a few
// bright points. With several seeds, both are medians over them. Sample counts follow from the cost
// of fewer.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/check.h"
#include "core/base/cpu_time.h"
#include "core/image_io/image_io.h"
#include "core/integrators/registry.h"
#include "core/render/task/choose_integrator.h"
#include "tests/bench/named_view.h"
#include "tests/support/asset_files.h"
#include "tests/support/scenes.h"

namespace {

struct Plan {
  int width = 160;
  int height = 90;
  double seconds = 4;
  int seeds = 1;
  std::string scene;  ///< empty: all
  std::string only;   ///< integrators with this prefix
  std::string sheet;  ///< JPEG file for all images; empty: none
};

struct Case {
  std::string scene;  ///< built-in, or GLTF,HDR
  const char* reference;
};
constexpr double kReferenceTimes = 16;

std::vector<Case> cases() {
  std::vector<Case> all = {{"cornell-box", "path"}, {"veach-mis", "path"}, {"many-lights", "path"},
                           {"glass", "bdpt"},       {"interior", "bdpt"},  {"keyhole", "bdpt"},
                           {"caustic-pool", "sppm"}};
  for (const char* name : {"water", "ring", "diamond", "ribbed"}) {
    all.push_back({name, "path-caustics"});
  }
  if (const auto folder = test_support::assets_folder()) {
    const std::string path = folder->string() + "/";
    const std::string garden = "," + path + "env/chinese_garden_1k.hdr";
    const std::string sun = "," + path + "env/qwantani_afternoon_puresky_1k.hdr";
    const std::string studio = "," + path + "env/studio_small_05_1k.hdr";
    const std::string dusk = "," + path + "env/venice_sunset_256.hdr";
    all.push_back({path + "WaterBottle.glb" + garden, "path"});
    all.push_back({path + "SunglassesKhronos.glb" + garden, "path"});
    all.push_back({path + "2CylinderEngine.glb" + dusk, "path"});
    all.push_back({path + "SunglassesKhronos.glb" + sun, "path-caustics"});
    all.push_back({path + "blenderio_15_transmission.glb" + sun, "path-caustics"});
    all.push_back({path + "blenderio_17_ior.glb" + studio, "path"});
    all.push_back({path + "lamborghini.glb" + studio, "path"});
    all.push_back({path + "AnisotropyDiscTest.glb" + dusk, "path"});
    all.push_back({path + "gen_lights.glb", "path"});
  }
  return all;
}

core::View view_of(const std::string& scene, const Plan& plan) {
  core::View view = bench::named_view(scene, plan.width, plan.height);
  view.settings.film.filter = {core::FilterType::kBox, 0.5F};
  return view;
}

/// The name without folders and map.
std::string short_name(const std::string& scene) {
  const std::string file = scene.substr(0, scene.find(','));
  return file.substr(file.rfind('/') + 1);
}

struct Run {
  std::vector<core::Rgb> pixels;
  double cpu_seconds = 0;
  int samples = 0;
};

Run render(core::View view, std::string_view integrator, double seconds, std::uint64_t seed) {
  core::RenderSettings settings = core::default_settings(integrator);
  settings.film = view.settings.film;
  settings.seed = seed;
  view.settings = settings;
  // Both include the time before the first sample. Passes of photons become faster as their radii
  // shrink, so what falls short is rendered again.
  const double two = test_support::render(view, 2).progress.cpu_seconds;
  const double six = test_support::render(view, 6).progress.cpu_seconds;
  const double left = 2 * (seconds - two) / std::max((six - two) / 2, 1e-4);
  Run run;
  run.samples = std::max(2, 2 + static_cast<int>(left) / 2 * 2);
  test_support::Picture picture = test_support::render(view, run.samples);
  for (int i = 0; i < 3 && picture.progress.cpu_seconds < 0.9 * seconds; ++i) {
    run.samples = static_cast<int>(run.samples * seconds / picture.progress.cpu_seconds) / 2 * 2;
    picture = test_support::render(view, run.samples);
  }
  run.cpu_seconds = picture.progress.cpu_seconds;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    run.pixels.push_back(core::pixel_value(picture.snapshot, i).mean);
  }
  return run;
}

/// Error of each pixel, in increasing order.
std::vector<double> errors(const Run& run, const Run& reference) {
  std::vector<double> all;
  for (std::size_t i = 0; i < run.pixels.size(); ++i) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      const auto a = static_cast<double>(run.pixels[i][c]);
      const auto b = static_cast<double>(reference.pixels[i][c]);
      sum += (a - b) * (a - b) / (b * b + 0.01) / 3;
    }
    all.push_back(sum);
  }
  std::sort(all.begin(), all.end());
  return all;
}

double mean(const std::vector<double>& sorted, double share) {
  const auto count = static_cast<std::size_t>(static_cast<double>(sorted.size()) * share);
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += sorted[i];
  }
  return sum / static_cast<double>(count);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// A row's relMSE, of all pixels and without the worst hundredth.
struct Row {
  std::string name;
  double all = 0;
  double most = 0;
};

/// What `auto` chose: its relMSE over that of the best row, and the CPU time of its pilots over
/// that of an image.
struct Automatic {
  double all = 0;
  double most = 0;
  double pilots = 0;
};

Automatic chosen(core::View view, const std::vector<Row>& rows, const Plan& plan) {
  view.settings.integrator = core::kAutomaticIntegrator;
  const double began = core::thread_cpu_seconds();
  CHECK(core::settle_integrator(view, {}));
  const double pilots = core::thread_cpu_seconds() - began;
  const auto by = [&rows](double Row::*figure) {
    return *std::min_element(rows.begin(), rows.end(), [figure](const Row& a, const Row& b) {
      return a.*figure < b.*figure;
    });
  };
  const auto row = std::find_if(rows.begin(), rows.end(), [&view](const Row& each) {
    return each.name == view.settings.integrator;
  });
  CHECK(row != rows.end());
  const Automatic out = {row->all / by(&Row::all).all, row->most / by(&Row::most).most,
                         pilots / plan.seconds};
  std::printf("auto chose %s: %.2f of the best (%s), without 1 %% %.2f (%s), pilots %.1f CPU s\n",
              row->name.c_str(), out.all, by(&Row::all).name.c_str(), out.most,
              by(&Row::most).name.c_str(), pilots);
  return out;
}

void print_summary(const std::vector<Automatic>& choices, const Plan& plan) {
  constexpr double kGood = 1.25;
  const auto good = [&choices](double Automatic::*figure) {
    return std::count_if(choices.begin(), choices.end(),
                         [figure](const Automatic& each) { return each.*figure <= kGood; });
  };
  std::vector<double> pilots;
  for (const Automatic& each : choices) {
    pilots.push_back(each.pilots);
  }
  std::printf(
      "\nauto: at most %g of the best row's relMSE in %d of %d scenes, without 1 %% in %d; "
      "pilots are %.1f %% (median) of %g CPU s\n",
      kGood, static_cast<int>(good(&Automatic::all)), static_cast<int>(choices.size()),
      static_cast<int>(good(&Automatic::most)), 100 * median(pilots), plan.seconds);
}

/// Prints a scene's table and returns its images, the reference last.
std::vector<std::vector<core::Rgb>> compare(const Case& one, const Plan& plan,
                                            std::vector<Automatic>& choices) {
  const core::View view = view_of(one.scene, plan);
  const Run reference = render(view, one.reference, kReferenceTimes * plan.seconds, 1000);
  std::printf("\n%-22s%10s%10s%12s%14s   reference: %s, %d samples, %.1f s\n",
              short_name(one.scene).c_str(), "samples", "CPU s", "relMSE", "without 1 %",
              one.reference, reference.samples, reference.cpu_seconds);
  std::vector<std::vector<core::Rgb>> images;
  std::vector<Row> rows;
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (row.name == "direct" || row.name == core::kAutomaticIntegrator ||
        row.name.rfind(plan.only, 0) != 0) {
      continue;  // `direct` renders a different image
    }
    Run run;
    std::vector<double> all;
    std::vector<double> most;
    for (int seed = 1; seed <= plan.seeds; ++seed) {
      run = render(view, row.name, plan.seconds, static_cast<std::uint64_t>(seed));
      const std::vector<double> sorted = errors(run, reference);
      all.push_back(mean(sorted, 1));
      most.push_back(mean(sorted, 0.99));
    }
    std::printf("%-22s%10d%10.1f%12.5f%14.5f\n", std::string(row.name).c_str(), run.samples,
                run.cpu_seconds, median(all), median(most));
    std::fflush(stdout);
    images.push_back(run.pixels);
    if (row.bias != "biased") {  // What `auto` chooses tends to the truth.
      rows.push_back({std::string(row.name), median(all), median(most)});
    }
  }
  if (plan.only.empty()) {
    choices.push_back(chosen(view, rows, plan));
  }
  images.push_back(reference.pixels);
  return images;
}

/// Writes one row of images for each scene.
void write_sheet(const std::vector<std::vector<std::vector<core::Rgb>>>& rows, const Plan& plan) {
  constexpr int kGap = 4;
  core::FloatImage sheet{static_cast<int>(rows[0].size()) * (plan.width + kGap) - kGap,
                         static_cast<int>(rows.size()) * (plan.height + kGap) - kGap,
                         {"R", "G", "B"},
                         {}};
  sheet.values.assign(
      static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) * 3, 1.0F);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::size_t column = 0; column < rows[row].size(); ++column) {
      const std::vector<core::Rgb>& pixels = rows[row][column];
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const int x =
            static_cast<int>(column) * (plan.width + kGap) + static_cast<int>(i) % plan.width;
        const int y =
            static_cast<int>(row) * (plan.height + kGap) + static_cast<int>(i) / plan.width;
        for (int c = 0; c < 3; ++c) {
          sheet.values[sheet.index(x, y, c)] = pixels[i][c];
        }
      }
    }
  }
  const auto bytes = core::encode_image(sheet, core::image_formats()[1], {});
  CHECK(bytes);
  std::ofstream file(plan.sheet, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes->data()),
             static_cast<std::streamsize>(bytes->size()));
  CHECK(file.good());
}

}  // namespace

// [--seconds N] [--seeds N] [--scene NAME] [--only NAME] [--size WxH] [--sheet FILE]
int main(int argc, char** argv) {
  Plan plan;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view flag = argv[i];
    if (flag == "--seconds" && i + 1 < argc) {
      plan.seconds = std::stod(argv[i + 1]);
    } else if (flag == "--seeds" && i + 1 < argc) {
      plan.seeds = std::max(1, std::stoi(argv[i + 1]));
    } else if (flag == "--scene" && i + 1 < argc) {
      plan.scene = argv[i + 1];
    } else if (flag == "--only" && i + 1 < argc) {
      plan.only = argv[i + 1];
    } else if (flag == "--sheet" && i + 1 < argc) {
      plan.sheet = argv[i + 1];
    } else if (flag == "--size" && i + 1 < argc &&
               std::sscanf(argv[i + 1], "%dx%d", &plan.width, &plan.height) == 2) {
    } else {
      std::fprintf(stderr,
                   "usage: integrators_bench [--seconds N] [--seeds N] [--scene NAME] "
                   "[--only NAME] [--size WxH] [--sheet FILE]\n");
      return 2;
    }
  }
  std::printf("%dx%d, %g CPU seconds a picture, box filter, max_depth 16\n", plan.width,
              plan.height, plan.seconds);
  std::vector<Automatic> choices;
  std::vector<std::vector<std::vector<core::Rgb>>> rows;
  for (const Case& one : cases()) {
    if (plan.scene.empty() || plan.scene == short_name(one.scene)) {
      rows.push_back(compare(one, plan, choices));
    }
  }
  if (!choices.empty()) {
    print_summary(choices, plan);
  }
  if (!plan.sheet.empty() && !rows.empty()) {
    write_sheet(rows, plan);
  }
  return 0;
}
