// Measures the flicker of denoised frames, each alone and with light of the frames before and
// after, for two turntables and an animated character: the flicker, the error, and seconds of CPU a
// frame. Frames alone also get the time that the others take, as samples. The arguments are
// samples, width, frames, and a folder for the images; without it none are written. Prints, never
// asserts.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/base/check.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/flicker.h"
#include "core/denoise/statistical.h"
#include "core/render/picture/feature_pass.h"
#include "core/render/picture/match_pass.h"
#include "tests/support/asset_files.h"
#include "tests/support/scenes.h"

namespace {

struct Plan {
  int samples = 16;
  int width = 320;
  int frames = 6;
  std::string folder;
};

double cpu_seconds() {
  rusage used{};
  CHECK(getrusage(RUSAGE_SELF, &used) == 0);
  double out = 0;
  for (const timeval& time : {used.ru_utime, used.ru_stime}) {
    out += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return out;
}

/// Frames of one film.
struct Take {
  std::string name;
  std::vector<core::View> views;
  /// The file at the time of a frame; null: nothing moves.
  std::function<std::shared_ptr<const core::MotionTarget>(int frame, core::Place origin)> at;
};

void set_film(core::View& view, const Plan& plan) {
  view.settings.film.width = plan.width;
  view.settings.film.height = plan.width * 9 / 16;
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = false;
}

/// 120 views make a whole turn.
void orbit(core::View& view, int frame) {
  const core::Bounds& bounds = view.scene->summary().bounds;
  const core::Vec3 centre = (bounds.min + bounds.max) * 0.5F;
  const float radius = 0.5F * length(bounds.max - bounds.min);
  const float angle = static_cast<float>(frame) * 3 * 3.14159265F / 180;
  const float away = 1.7F * radius;
  test_support::look_at(
      view, centre + core::Vec3{away * std::sin(angle), 0.35F * away, away * std::cos(angle)},
      centre, 50);
}

Take turntable(const std::string& name, const Plan& plan) {
  const auto folder = *test_support::assets_folder();
  auto description = test_support::load_asset(folder / (name + ".glb"));
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view;
  view.scene = *scene;
  view.environment = test_support::load_sky(folder / "env" / "studio_small_05_1k.hdr");
  set_film(view, plan);
  Take out = {name, {}, {}};
  for (int k = 0; k < plan.frames; ++k) {
    orbit(view, k);
    out.views.push_back(view);
  }
  return out;
}

Take walk(const Plan& plan) {
  const auto folder = *test_support::assets_folder();
  const auto file = folder / "Fox.glb";
  const auto seconds = [](int frame) { return 0.1 + frame / 24.0; };
  Take out = {"Fox", {}, {}};
  for (int k = 0; k < plan.frames; ++k) {
    core::GltfOptions options;
    options.time_seconds = seconds(k);
    auto description = test_support::load_asset(file, options);
    CHECK(description);
    auto scene = core::Scene::build(std::move(*description), 2);
    CHECK(scene);
    core::View view;
    view.scene = *scene;
    view.environment = test_support::load_sky(folder / "env" / "venice_sunset_256.hdr");
    set_film(view, plan);
    // From the side, at the first frame's place.
    test_support::look_at(view, {180, 60, 0}, {0, 40, 0}, 40);
    out.views.push_back(view);
  }
  out.at = [file, seconds](int frame, core::Place origin) {
    core::GltfOptions options;
    options.time_seconds = seconds(frame);
    options.geometry_only = true;
    options.origin = origin;
    auto description = test_support::load_asset(file, options);
    CHECK(description);
    return std::make_shared<const core::MotionTarget>(std::move(*description));
  };
  return out;
}

struct Frame {
  core::FilmSnapshot film;
  core::FeaturePicture features;
};
struct Films {
  std::vector<Frame> frames;
  double seconds = 0;  ///< of rendering and features, a frame
};

Films render(const Take& take, int samples, bool own_seeds) {
  Films out;
  const double begin = cpu_seconds();
  for (core::View view : take.views) {
    view.settings.seed = own_seeds ? out.frames.size() + 1 : 0;
    auto features = core::feature_pass(view, core::parallel_for(2));
    CHECK(features && *features);
    out.frames.push_back({test_support::render(view, samples).snapshot, std::move(**features)});
  }
  out.seconds = (cpu_seconds() - begin) / static_cast<double>(take.views.size());
  return out;
}

core::FrameMatch match(const Take& take, int from, int to) {
  const core::View& here = take.views[static_cast<std::size_t>(from)];
  const auto target = take.at ? take.at(to, here.scene->data().origin) : nullptr;
  auto out = core::match_pass(here, {&take.views[static_cast<std::size_t>(to)], target.get()},
                              core::parallel_for(2));
  CHECK(out);
  return *std::move(out);
}

struct Shown {
  std::vector<core::DenoisedPicture> pictures;
  double seconds = 0;  ///< a frame
  double error = 0;    ///< mean estimate
};

Shown denoise(const Take& take, const Films& films, bool in_series) {
  Shown out;
  const auto count = static_cast<int>(films.frames.size());
  const double begin = cpu_seconds();
  std::vector<core::CleanFilm> clean;
  for (const Frame& frame : films.frames) {
    auto made = core::clean_film(frame.film, &frame.features, core::StatisticalDenoiser(),
                                 core::parallel_for(2));
    CHECK(made);
    clean.push_back(*std::move(made));
  }
  for (int k = 0; k < count; ++k) {
    const Frame& own = films.frames[static_cast<std::size_t>(k)];
    std::vector<core::FrameMatch> matches;
    std::vector<core::CleanNeighbour> neighbours;
    for (const int other : {k - 1, k + 1}) {
      if (in_series && other >= 0 && other < count) {
        const auto at = static_cast<std::size_t>(other);
        matches.push_back(match(take, k, other));
        neighbours.push_back({&clean[at], &films.frames[at].features, nullptr});
      }
    }
    for (std::size_t m = 0; m < matches.size(); ++m) {
      neighbours[m].match = &matches[m];
    }
    core::CleanFilm mean =
        core::mean_in_series(clean[static_cast<std::size_t>(k)], &own.features, neighbours);
    core::MadeDenoised made = core::denoised(own.film, &own.features, std::move(mean));
    out.error += made.picture.interval(core::DenoiseMode::kFull, 0.95).relative / count;
    out.pictures.push_back(std::move(made.picture));
  }
  out.seconds = (cpu_seconds() - begin) / count;
  return out;
}

core::Flicker flicker(const Films& films, const Shown& shown,
                      const std::vector<core::FrameMatch>& back) {
  core::Flicker out;
  for (std::size_t k = 1; k < shown.pictures.size(); ++k) {
    out += core::flicker({&films.frames[k].film, &shown.pictures[k]},
                         {&films.frames[k - 1].film, &shown.pictures[k - 1]}, back[k]);
  }
  return out;
}

void write(const std::string& file, const core::DenoisedPicture& picture) {
  std::ofstream out(file, std::ios::binary);
  out << "P6\n" << picture.rect.width << " " << picture.rect.height << "\n255\n";
  for (std::size_t i = 0; i < picture.full[0].size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float v = std::clamp(picture.full[c][i], 0.0F, 1.0F);
      out.put(static_cast<char>(std::lround(255 * std::pow(v, 1 / 2.2F))));
    }
  }
}

void print(const char* how, const Films& films, const Shown& shown, const core::Flicker& of) {
  const auto e = core::interval(of, 0.95).value();
  std::printf("  %-22s %6.2f s + %5.2f s  error %5.2f %%  flicker %5.2f %% (%.2f to %.2f)\n", how,
              films.seconds, shown.seconds, 100 * shown.error, 100 * e.relative, 100 * e.low,
              100 * e.high);
  std::fflush(stdout);
}

void measure(const Take& take, const Plan& plan, bool own_seeds) {
  std::vector<core::FrameMatch> back(1);
  for (int k = 1; k < plan.frames; ++k) {
    back.push_back(match(take, k, k - 1));
  }
  const auto seen = std::count_if(back[1].source.begin(), back[1].source.end(),
                                  [](std::int32_t source) { return source >= 0; });
  std::printf("%s, %d samples, %s, %.0f %% of the pixels found in the frame before\n",
              take.name.c_str(), plan.samples, own_seeds ? "a seed for each frame" : "one seed",
              100.0 * static_cast<double>(seen) / static_cast<double>(back[1].source.size()));
  const Films films = render(take, plan.samples, own_seeds);
  const Shown alone = denoise(take, films, false);
  const Shown series = denoise(take, films, true);
  const core::Flicker of_alone = flicker(films, alone, back);
  const core::Flicker of_series = flicker(films, series, back);
  print("alone", films, alone, of_alone);
  print("in series", films, series, of_series);
  const double more = 1 + (series.seconds - alone.seconds) / films.seconds;
  const Films longer = render(take, static_cast<int>(std::lround(plan.samples * more)), own_seeds);
  const Shown equal = denoise(take, longer, false);
  const core::Flicker of_equal = flicker(longer, equal, back);
  print("alone, equal time", longer, equal, of_equal);
  std::printf("  squares: %.1f times less at equal samples, %.1f at equal time\n",
              of_alone.sum / of_series.sum, of_equal.sum / of_series.sum);
  for (std::size_t k = 0; !plan.folder.empty() && k < series.pictures.size(); ++k) {
    const std::string place = plan.folder + "/" + take.name + "-" + std::to_string(k);
    write(place + "-alone.ppm", alone.pictures[k]);
    write(place + "-series.ppm", series.pictures[k]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Plan plan;
  plan.samples = argc > 1 ? std::atoi(argv[1]) : plan.samples;
  plan.width = argc > 2 ? std::atoi(argv[2]) : plan.width;
  plan.frames = argc > 3 ? std::atoi(argv[3]) : plan.frames;
  plan.folder = argc > 4 ? argv[4] : "";
  const std::string only = argc > 5 ? argv[5] : "";
  if (!test_support::assets_folder()) {
    std::fprintf(stderr, "the folder of assets is missing\n");
    return 1;
  }
  for (const std::string name : {"WaterBottle", "CornellBox", "Fox"}) {
    if (only.empty() || only == name) {
      const Take take = name == "Fox" ? walk(plan) : turntable(name, plan);
      for (const bool own_seeds : {false, true}) {
        measure(take, plan, own_seeds);
      }
    }
  }
  return 0;
}
