#include "tests/bench/asset_groups.h"

#include <cstdio>
#include <fstream>
#include <vector>

#include "core/base/check.h"
#include "core/integrators/registry.h"
#include "tests/bench/named_view.h"
#include "tests/support/asset_files.h"
#include "tests/support/scenes.h"

namespace bench {
namespace {

constexpr int kReferenceSamples = 4096;
constexpr int kShortReferenceSamples = 1024;

template <typename T>
void transfer(std::fstream& file, std::vector<T>& values, bool write) {
  const auto bytes = static_cast<std::streamsize>(values.size() * sizeof(T));
  auto* data = reinterpret_cast<char*>(values.data());
  if (write) {
    file.write(data, bytes);
  } else {
    file.read(data, bytes);
  }
}

}  // namespace

std::string folder_of(const char* program) {
  const std::string path = program;
  return path.substr(0, path.rfind('/') + 1);
}

core::View view_by(core::View view, std::string_view integrator) {
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(integrator);
  view.settings.film = film;
  return view;
}

test_support::Truth kept_truth(const std::string& folder, const std::string& name,
                               const core::View& view, int samples, int threads) {
  constexpr std::uint64_t kSeed = 1'000'000;
  const core::FilmSettings& film = view.settings.film;
  test_support::Truth out = {film.width, film.height, {}, {}};
  const std::string path =
      folder + name + "-" + std::to_string(film.width) + "-" + std::to_string(samples) + ".truth";
  std::fstream file(path, std::ios::in | std::ios::binary);
  const bool is_kept = file.is_open();
  if (!is_kept) {
    core::View long_view = view;
    long_view.settings.seed = kSeed;
    out = test_support::truth_of(test_support::render(long_view, samples, threads).snapshot);
    file.open(path, std::ios::out | std::ios::binary);
  }
  const auto count = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  out.mu.resize(count);
  out.is_opaque.resize(count);
  transfer(file, out.mu, !is_kept);
  transfer(file, out.is_opaque, !is_kept);
  CHECK(file.good());
  return out;
}

bool for_asset_groups(const AssetPlan& plan, const std::string& folder,
                      const std::function<void(const AssetGroup&)>& visit) {
  const auto assets = test_support::assets_folder();
  if (!assets) {
    std::printf("no folder of assets (TESSERA_ASSETS names it)\n");
    return false;
  }
  int number = 0;
  for (const char* name :
       {"WaterBottle", "SunglassesKhronos", "2CylinderEngine", "blenderio_15_transmission",
        "gen_material_matrix", "Fox", "AnisotropyDiscTest", "lamborghini", "blenderio_19_sheen",
        "blenderio_14_emission_strength"}) {
    for (const char* map : {"chinese_garden_1k", "studio_small_05_1k"}) {
      if (plan.is_short && ++number % 4 > 1) {  // alternates between the maps
        continue;
      }
      if (!std::string_view(name).starts_with(plan.only)) {
        continue;
      }
      const std::string path = assets->string() + "/";
      AssetGroup group;
      group.name = std::string(name) + " under " + map;
      group.view = view_by(named_view(path + name + ".glb," + path + "env/" + map + ".hdr",
                                      plan.width, plan.width * 9 / 16),
                           "path");
      group.truth =
          kept_truth(folder, std::string(name) + "-" + map, group.view,
                     plan.is_short ? kShortReferenceSamples : kReferenceSamples, plan.threads);
      visit(group);
    }
  }
  return true;
}

}  // namespace bench
