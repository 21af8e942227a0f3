// Renders every asset of the folder into one sheet of images, row by row in the order of the list
// that it prints: contact_sheet OUT.png [--assets DIR] [--samples N] [--size WxH] [--columns N]
// [--only TEXT] [--time SECONDS]. --only selects the files whose name contains the text.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "core/image_io/image_io.h"
#include "tests/support/asset_files.h"
#include "tests/support/scenes.h"

namespace {

struct Options {
  std::string out;
  std::optional<std::filesystem::path> assets = test_support::assets_folder();
  int samples = 64;
  int width = 240;
  int height = 180;
  int columns = 8;
  std::string only;
  double time_seconds = 0;
};

std::optional<Options> parse(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name.rfind("--", 0) != 0 && o.out.empty()) {
      o.out = name;
      continue;
    }
    if (i + 1 >= argc) {
      return std::nullopt;
    }
    const char* value = argv[++i];
    if (name == "--assets") {
      o.assets = value;
    } else if (name == "--samples") {
      o.samples = std::atoi(value);
    } else if (name == "--columns") {
      o.columns = std::atoi(value);
    } else if (name == "--only") {
      o.only = value;
    } else if (name == "--time") {
      o.time_seconds = std::atof(value);
    } else if (name == "--size") {
      if (std::sscanf(value, "%dx%d", &o.width, &o.height) != 2) {
        return std::nullopt;
      }
    } else {
      return std::nullopt;
    }
  }
  const bool usable =
      !o.out.empty() && o.samples > 0 && o.width > 0 && o.height > 0 && o.columns > 0;
  return usable ? std::optional(o) : std::nullopt;
}

/// Returns the linear pixels of one asset, or nothing if it was refused; prints the reason to
/// standard output.
std::vector<core::Rgb> picture_of(const std::filesystem::path& file, const Options& o,
                                  const std::shared_ptr<const core::Environment>& sky) {
  core::GltfOptions gltf;
  gltf.time_seconds = o.time_seconds;
  auto description = test_support::load_asset(file, gltf);
  if (!description) {
    std::printf("  refused at %s: %s\n", description.error().where.c_str(),
                description.error().message.c_str());
    return {};
  }
  for (const core::Warning& warning : description->warnings) {
    std::printf("  %s\n", warning.text().c_str());
  }
  auto scene = core::Scene::build(std::move(*description), 2);
  if (!scene) {
    std::printf("  %s\n", scene.error().message.c_str());
    return {};
  }
  core::View view = test_support::view_of(*scene, o.width, o.height);
  view.settings.film.filter = {core::FilterType::kBlackmanHarris, 1.5F};
  view.environment = sky;
  const test_support::Picture picture = test_support::render(view, o.samples);
  std::vector<core::Rgb> pixels;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    pixels.push_back(core::pixel_value(picture.snapshot, i).mean);
  }
  if (picture.progress.rejected_samples > 0) {
    std::printf("  %llu samples are not numbers\n",
                static_cast<unsigned long long>(picture.progress.rejected_samples));
  }
  return pixels;
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parse(argc, argv);
  if (!options) {
    std::fprintf(stderr,
                 "contact_sheet OUT.png [--assets DIR] [--samples N] [--size WxH] [--columns N] "
                 "[--only TEXT]"
                 " [--time SECONDS]\n");
    return 2;
  }
  if (!options->assets) {
    std::fprintf(stderr,
                 "there is no folder of assets: name one with --assets or TESSERA_ASSETS\n");
    return 1;
  }
  const auto sky = test_support::load_sky(*options->assets / "env" / "venice_sunset_256.hdr");
  std::vector<std::string> names;
  for (const std::string& name : test_support::asset_names(*options->assets)) {
    if (name.find(options->only) != std::string::npos) {
      names.push_back(name);
    }
  }
  constexpr int kGap = 4;
  const int count = static_cast<int>(names.size());
  const int columns = std::max(1, std::min(options->columns, count));
  const int rows = (count + columns - 1) / columns;
  core::FloatImage sheet{columns * (options->width + kGap) + kGap,
                         rows * (options->height + kGap) + kGap,
                         {"R", "G", "B"},
                         {}};
  sheet.values.assign(
      static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) * 3, 0.02F);
  for (int k = 0; k < count; ++k) {
    const int row = k / columns;
    const int column = k % columns;
    const auto start = std::chrono::steady_clock::now();
    std::printf("row %d column %d: %s\n", row + 1, column + 1,
                names[static_cast<std::size_t>(k)].c_str());
    const auto pixels =
        picture_of(*options->assets / names[static_cast<std::size_t>(k)], *options, sky);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    std::printf("  %.2f s\n", seconds.count());
    std::fflush(stdout);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const int x = kGap + column * (options->width + kGap) + static_cast<int>(i) % options->width;
      const int y = kGap + row * (options->height + kGap) + static_cast<int>(i) / options->width;
      for (int c = 0; c < 3; ++c) {
        sheet.values[sheet.index(x, y, c)] = pixels[i][c];
      }
    }
  }
  const auto png = core::encode_image(sheet, core::image_formats()[0], {});
  if (!png) {
    std::fprintf(stderr, "%s\n", png.error().message.c_str());
    return 1;
  }
  std::ofstream file(options->out, std::ios::binary);
  file.write(reinterpret_cast<const char*>(png->data()), static_cast<std::streamsize>(png->size()));
  return file ? 0 : 1;
}
