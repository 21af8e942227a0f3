// Partial images of the light: layers bounce:N and light:NAME.
#include "core/settings/light_shares.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "core/film/film_format.h"
#include "core/integrators/registry.h"
#include "core/layers/layers.h"
#include "core/render/task/settle.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;

void record(core::View& view, const std::vector<std::string>& layers) {
  view.settings.film.shares.clear();
  for (const std::string& layer : layers) {
    view.settings.film.shares.push_back(*core::light_share(layer));
  }
}

core::View box(int max_depth = 6) {
  core::View view = test_support::view_of(test_support::cornell(), 24, 20);
  test_support::look_at(view, {0.5F, 0.5F, 2}, {0.5F, 0.5F, 0}, 40);
  view.settings.max_depth = max_depth;
  return view;
}

/// Two named emitters, one of them a punctual light, under a sky.
core::View lamps() {
  core::SceneDescription scene = test_support::cornell();
  scene.meshes[0].primitives.pop_back();  // all but the top of the second box
  scene.instances[0].group = "ceiling";
  scene.meshes.emplace_back();
  scene.meshes.back().name = "panel";
  scene.meshes.back().primitives = {
      test_support::quad({0.02F, 0.2F, 0.3F}, {0, 0.2F, 0}, {0, 0, 0.2F}, 3)};
  scene.instances.push_back({1, {}, {}});
  core::PunctualLightDescription point;
  point.intensity = {0, 0.3F, 0};
  point.to_world.t = {0.8F, 0.8F, 0.8F};
  scene.lights.push_back(point);
  core::View view = test_support::view_of(std::move(scene), 24, 20);
  test_support::look_at(view, {0.5F, 0.5F, 2}, {0.5F, 0.5F, 0}, 40);
  view.environment = test_support::constant_sky({0.2F, 0.2F, 0.4F});
  view.settings.max_depth = 4;
  return view;
}

std::vector<float> layer(const test_support::Picture& picture, const std::string& name) {
  auto image = core::layer_image(picture.snapshot, name);
  EXPECT_TRUE(image) << name;
  const std::size_t channels = image->channel_names.size();
  std::vector<float> out;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    out.insert(out.end(), {image->values[i * channels], image->values[i * channels + 1],
                           image->values[i * channels + 2]});
  }
  return out;
}

std::vector<float> sum_of(const test_support::Picture& picture,
                          const std::vector<std::string>& names) {
  std::vector<float> sum(3 * picture.snapshot.pixel_count());
  for (const std::string& name : names) {
    const std::vector<float> part = layer(picture, name);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += part[i];
    }
  }
  return sum;
}

/// Largest difference, relative to the larger of the value and 1.
float difference(const std::vector<float>& a, const std::vector<float>& b) {
  float most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::fabs(a[i] - b[i]) / std::max(std::fabs(b[i]), 1.0F));
  }
  return most;
}

constexpr float kExact = 1e-5F;

TEST(LightShares, ReadsNames) {
  const auto two = core::light_share("bounce:2");
  ASSERT_TRUE(two);
  EXPECT_EQ(two->first_bounce, 2);
  EXPECT_EQ(two->last_bounce, 2);
  EXPECT_FALSE(two->group);
  EXPECT_GT(core::light_share("bounce:2-")->last_bounce, 1000000);
  EXPECT_EQ(core::light_share("light:left lamp")->group, "left lamp");
  for (const char* name : {"bounce:", "bounce:-", "bounce:-1", "bounce:02", "bounce:1.5",
                           "light:", "bounce:1 ", "beauty", "bounce:99999999999"}) {
    EXPECT_FALSE(core::light_share(name)) << name;
  }
}

TEST(LightShares, BouncesAddUpToTheImage) {
  core::View view = box();
  const std::vector<std::string> all = {"bounce:0", "bounce:1", "bounce:2", "bounce:3",
                                        "bounce:4-"};
  record(view, all);
  for (const int splits : {1, 3}) {
    view.settings.estimator.split_count = splits;
    view.settings.estimator.splitting =
        splits > 1 ? core::SplittingType::kFixed : core::SplittingType::kNone;
    const auto picture = test_support::render(view, 32);
    EXPECT_LT(difference(sum_of(picture, all), layer(picture, "beauty")), kExact) << splits;
    const std::vector<std::string> lacking = {"bounce:0", "bounce:1", "bounce:2", "bounce:4-"};
    EXPECT_GT(difference(sum_of(picture, lacking), layer(picture, "beauty")), 100 * kExact)
        << "a sum without one bounce is detected";
  }
}

TEST(LightShares, EachBounceIsTheImageOfThatDepth) {
  core::View view = box();
  view.settings.estimator.roulette = core::RouletteType::kNone;
  record(view, {"bounce:0", "bounce:1", "bounce:2"});
  const auto picture = test_support::render(view, 8);
  std::vector<std::string> so_far;
  for (const int depth : {0, 1, 2}) {
    so_far.push_back("bounce:" + std::to_string(depth));
    core::View shallow = box(depth);
    shallow.settings.estimator.roulette = core::RouletteType::kNone;
    const auto other = test_support::render(shallow, 8);
    EXPECT_LT(difference(sum_of(picture, so_far), layer(other, "beauty")), kExact) << depth;
    so_far.back() = "bounce:" + std::to_string((depth + 1) % 3);
    EXPECT_GT(difference(sum_of(picture, so_far), layer(other, "beauty")), 100 * kExact)
        << "another bounce is detected";
    so_far.back() = "bounce:" + std::to_string(depth);
  }
}

TEST(LightShares, LightGroupsAddUpToTheImage) {
  core::View view = lamps();
  EXPECT_EQ(view.scene->summary().light_groups,
            (std::vector<std::string>{"environment", "ceiling", "panel", "unnamed"}));
  const std::vector<std::string> all = {"light:environment", "light:ceiling", "light:panel",
                                        "light:unnamed"};
  record(view, all);
  for (const auto lights : {core::LightSamplerType::kTree, core::LightSamplerType::kRis}) {
    view.settings.light_sampler = lights;
    const auto picture = test_support::render(view, 32);
    EXPECT_LT(difference(sum_of(picture, all), layer(picture, "beauty")), kExact);
    for (const std::string& name : all) {
      const auto part = core::share_of(picture.snapshot, name);
      double light = 0;
      for (std::size_t i = 0; i < part->pixel_count(); ++i) {
        light += static_cast<double>(core::pixel_value(*part, i).mean.g);
      }
      EXPECT_GT(light, 0) << name;
    }
  }
}

TEST(LightShares, LightsCalledEnvironmentAreApartFromTheEnvironment) {
  core::SceneDescription scene;
  scene.lights.resize(2);
  scene.lights[0].name = "environment";
  scene.lights[1].group = "environment";
  const auto built = core::Scene::build(std::move(scene), 1);
  ASSERT_TRUE(built);
  EXPECT_EQ((*built)->summary().light_groups,
            (std::vector<std::string>{"environment", "environment lights"}));
}

TEST(LightShares, LightGroupEqualsTheImageWithoutTheOtherLights) {
  core::View view = lamps();
  record(view, {"light:environment"});
  const auto both = test_support::render(view, 256);
  core::SceneDescription dark = test_support::cornell();
  dark.meshes[0].primitives.pop_back();
  dark.meshes.emplace_back();
  dark.meshes.back().primitives = {
      test_support::quad({0.02F, 0.2F, 0.3F}, {0, 0.2F, 0}, {0, 0, 0.2F}, 3)};
  dark.instances.push_back({1, {}, {}});
  dark.materials[3].emissive = {};
  core::View alone = view;
  alone.scene = test_support::build(std::move(dark));
  record(alone, {});
  const auto only = test_support::render(alone, 256);
  test_support::Picture share = both;
  share.snapshot = *core::share_of(both.snapshot, "light:environment");
  const auto z = [](const test_support::Picture& a, const test_support::Picture& b) {
    return (a.mean().b - b.mean().b) / std::hypot(a.standard_error().b, b.standard_error().b);
  };
  EXPECT_LT(std::fabs(z(share, only)), 4);
  EXPECT_GT(std::fabs(z(both, only)), 4) << "the other lights are detected";
}

TEST(LightShares, AreIndependentOfThreadsAndStoredInFilms) {
  core::View view = lamps();
  record(view, {"bounce:1", "light:panel"});
  const auto one = test_support::render(view, 6, 1);
  const auto two = test_support::render(view, 6, 2);
  EXPECT_EQ(one.film->digest(), two.film->digest());
  const auto ledger = core::ledger_of(*one.film, view.settings.seed, 0);
  std::vector<std::byte> file;
  ASSERT_TRUE(core::write_film({one.film, ledger}, "{}", [&](std::span<const std::byte> piece) {
    file.insert(file.end(), piece.begin(), piece.end());
    return true;
  }));
  EXPECT_EQ(file.size(), core::film_file_bytes(*one.film, ledger, 2));
  const auto again = core::read_film(file, {});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->part.film->digest(), one.film->digest());
  EXPECT_FALSE(core::read_film(file, {.shares_max = 1})) << "more shares than allowed";
  core::TileState changed = one.film->tile(0);
  changed.shares[0].r += 1;
  one.film->commit(0, std::move(changed));
  EXPECT_NE(one.film->digest(), two.film->digest()) << "the digest covers shares";
}

TEST(LightShares, PartsOfAJobMergeToItsShares) {
  core::View view = box(3);
  view.settings.replicates = 4;
  record(view, {"bounce:1", "bounce:2-"});
  const auto whole = test_support::render(view, 8);
  std::vector<core::FilmPart> parts;
  for (const int first : {0, 2}) {
    view.settings.replicates = 2;
    view.settings.first_replicate = first;
    auto part = test_support::render(view, 4).film;
    auto ledger = core::ledger_of(*part, view.settings.seed, first);
    parts.push_back({std::move(part), std::move(ledger)});
  }
  const auto merged = core::merge_films(parts, 64);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_EQ(merged->film->digest(), whole.film->digest());
}

TEST(LightShares, RefusesOptionsThatMixPaths) {
  const auto error_of = [](const core::View& view) {
    const auto renderer = core::settled_renderer(view);
    return renderer ? std::string() : renderer.error().where;
  };
  core::View view = box();
  record(view, {"bounce:1"});
  EXPECT_EQ(error_of(view), "");
  view.settings.light_sampler = core::LightSamplerType::kRestir;
  EXPECT_EQ(error_of(view), "/light_sampler/type");
  view = box();
  record(view, {"bounce:1"});
  view.settings.estimator.mis = core::MisType::kOptimal;
  EXPECT_EQ(error_of(view), "/estimator/mis/type");
  view = box();
  record(view, {"light:no such lamp"});
  EXPECT_EQ(error_of(view), "/film/layers");
  record(view, {"bounce:1"});
  view.settings.integrator = "mlt";
  EXPECT_EQ(error_of(view), "/film/layers");
}

/// Layers of all strategies of bdpt for paths of at most max_depth scattering events.
std::vector<std::string> strategies(int max_depth) {
  std::vector<std::string> all;
  for (int vertices = 2; vertices <= max_depth + 2; ++vertices) {
    for (int light = 0; light < vertices; ++light) {
      all.push_back("st:" + std::to_string(light) + "," + std::to_string(vertices - light));
    }
  }
  return all;
}

TEST(StrategyShares, AddUpToTheImage) {
  for (core::View view : {lamps(), box()}) {
    view.settings.integrator = "bdpt";
    view.settings.max_depth = 3;
    const std::vector<std::string> all = strategies(3);
    record(view, all);
    const auto picture = test_support::render(view, 16);
    EXPECT_LT(difference(sum_of(picture, all), layer(picture, "beauty")), kExact);
    for (const char* lost : {"st:1,2", "st:2,1", "st:2,2"}) {
      std::vector<std::string> lacking = all;
      lacking.erase(std::find(lacking.begin(), lacking.end(), lost));
      EXPECT_GT(difference(sum_of(picture, lacking), layer(picture, "beauty")), 100 * kExact)
          << "a sum that lacks " << lost << " is detected";
    }
  }
}

TEST(StrategyShares, BouncesAndGroupsOfBdptAddUpToTheImage) {
  core::View view = lamps();
  view.settings.integrator = "bdpt";
  for (const std::vector<std::string>& all :
       {std::vector<std::string>{"bounce:0", "bounce:1", "bounce:2-"},
        std::vector<std::string>{"light:environment", "light:ceiling", "light:panel",
                                 "light:unnamed"}}) {
    record(view, all);
    const auto picture = test_support::render(view, 16);
    EXPECT_LT(difference(sum_of(picture, all), layer(picture, "beauty")), kExact);
  }
}

/// Mean of a layer and its standard error, green.
std::pair<double, double> mean_of(const test_support::Picture& picture, const std::string& name) {
  test_support::Picture share = picture;
  share.snapshot = *core::share_of(picture.snapshot, name);
  return {static_cast<double>(share.mean().g), static_cast<double>(share.standard_error().g)};
}

double z_of(std::pair<double, double> a, std::pair<double, double> b) {
  return std::fabs(a.first - b.first) / std::hypot(a.second, b.second);
}

// Splats of a light path reach several pixels around one hit; a box filter limits them to one, so
// errors of pixels are independent except for later vertices of the paths. Each comparison is a
// false alarm in 1 of 16,000.
TEST(StrategyShares, EachBounceOfBdptEqualsThatOfPath) {
  const std::vector<std::string> bounces = {"bounce:0", "bounce:1", "bounce:2", "bounce:3"};
  core::View view = lamps();
  record(view, bounces);
  const auto path = test_support::render(view, 256);
  view.settings.integrator = "bdpt";
  const auto bdpt = test_support::render(view, 128);
  for (std::size_t i = 0; i < bounces.size(); ++i) {
    const auto of_path = mean_of(path, bounces[i]);
    EXPECT_LT(z_of(of_path, mean_of(bdpt, bounces[i])), 4) << bounces[i];
    EXPECT_GT(z_of(of_path, mean_of(bdpt, bounces[(i + 1) % 4])), 4)
        << "another bounce is detected";
  }
}

// A single strategy finds all light of its path length, because every surface here is diffuse.
TEST(StrategyShares, EachStrategyAloneEqualsTheBounce) {
  core::View view = box(2);
  view.settings.integrator = "bdpt";
  record(view, {"bounce:2", "st:0,4:unweighted", "st:1,3:unweighted", "st:2,2:unweighted",
                "st:3,1:unweighted", "st:1,3", "st:2,2"});
  const auto picture = test_support::render(view, 256);
  const auto bounce = mean_of(picture, "bounce:2");
  for (const char* name :
       {"st:0,4:unweighted", "st:1,3:unweighted", "st:2,2:unweighted", "st:3,1:unweighted"}) {
    EXPECT_LT(z_of(mean_of(picture, name), bounce), 4) << name;
  }
  for (const char* name : {"st:1,3", "st:2,2"}) {
    EXPECT_GT(z_of(mean_of(picture, name), bounce), 4) << name << " has a weight";
  }
}

TEST(StrategyShares, AreNamedByTheirVertices) {
  const auto share = core::light_share("st:2,3");
  ASSERT_TRUE(share);
  EXPECT_EQ(share->strategy, (core::SubpathLengths{2, 3}));
  EXPECT_TRUE(share->is_part());
  EXPECT_FALSE(core::light_share("st:0,12:unweighted")->is_part());
  for (const char* name :
       {"st:", "st:2", "st:2,0", "st:0,1", "st:02,1", "st:1,2:weighted", "st:-1,3", "st:1,2,3"}) {
    EXPECT_FALSE(core::light_share(name)) << name;
  }
  for (const core::IntegratorEntry& row : core::integrators()) {
    EXPECT_EQ(core::keeps_share(row, *share), row.name == "bdpt") << row.name;
  }
}

TEST(StrategyShares, AreStoredInFilmsAndMerge) {
  core::View view = lamps();
  view.settings.integrator = "bdpt";
  view.settings.replicates = 4;
  record(view, {"st:2,1", "bounce:1"});
  const auto whole = test_support::render(view, 8, 1);
  EXPECT_EQ(whole.film->digest(), test_support::render(view, 8, 3).film->digest());
  std::vector<core::FilmPart> parts;
  for (const int first : {0, 2}) {
    view.settings.replicates = 2;
    view.settings.first_replicate = first;
    auto part = test_support::render(view, 4).film;
    const auto ledger = core::ledger_of(*part, view.settings.seed, first);
    std::vector<std::byte> file;
    ASSERT_TRUE(core::write_film({part, ledger}, "{}", [&](std::span<const std::byte> piece) {
      file.insert(file.end(), piece.begin(), piece.end());
      return true;
    }));
    auto again = core::read_film(file, {});
    ASSERT_TRUE(again) << again.error().message;
    parts.push_back(std::move(again->part));
  }
  const auto merged = core::merge_films(parts, 64);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_EQ(merged->film->digest(), whole.film->digest());
}

/// Fog dense enough that half of the paths scatter in it.
core::View foggy_box() {
  core::View view = box(2);
  view.settings.integrator = "bdpt";
  view.settings.fog = core::FogSettings{
      .scattering = {0.3F, 0.8F, 2}, .absorption = Rgb(0.1F), .g = 0.3F, .height_falloff = 0.5F};
  return view;
}

std::vector<std::string> strategies_of(int bounce) {
  std::vector<std::string> all;
  for (int light = 0; light <= bounce + 1; ++light) {
    all.push_back("st:" + std::to_string(light) + "," + std::to_string(bounce + 2 - light));
  }
  return all;
}

TEST(StrategyShares, InFogAddUpToTheBounceAndBouncesToTheImage) {
  const std::vector<std::string> bounces = {"bounce:0", "bounce:1", "bounce:2", "bounce:3",
                                            "bounce:4-"};
  std::vector<std::string> all = bounces;
  for (const int bounce : {1, 2, 3}) {
    const std::vector<std::string> more = strategies_of(bounce);
    all.insert(all.end(), more.begin(), more.end());
  }
  core::View view = foggy_box();
  record(view, all);
  const auto picture = test_support::render(view, 16);
  EXPECT_LT(difference(sum_of(picture, bounces), layer(picture, "beauty")), kExact);
  for (const int bounce : {1, 2, 3}) {
    const auto of_bounce = layer(picture, "bounce:" + std::to_string(bounce));
    std::vector<std::string> parts = strategies_of(bounce);
    EXPECT_LT(difference(sum_of(picture, parts), of_bounce), kExact) << bounce;
    parts.pop_back();
    EXPECT_GT(difference(sum_of(picture, parts), of_bounce), 100 * kExact)
        << "a sum without splats is told apart";
  }
}

// Camera paths that find the lamp by chance need no weights.
TEST(StrategyShares, InFogWeightedStrategiesAreTheLightThatCameraPathsFind) {
  core::View view = foggy_box();
  record(view, {"bounce:1", "bounce:2", "bounce:3", "st:0,3:unweighted", "st:0,4:unweighted",
                "st:0,5:unweighted", "st:0,3"});
  const auto picture = test_support::render(view, 256);
  for (const int bounce : {1, 2, 3}) {
    EXPECT_LT(z_of(mean_of(picture, "bounce:" + std::to_string(bounce)),
                   mean_of(picture, "st:0," + std::to_string(bounce + 2) + ":unweighted")),
              4)
        << bounce;
  }
  EXPECT_GT(z_of(mean_of(picture, "bounce:1"), mean_of(picture, "st:0,3")), 4)
      << "a share of the light is told apart";
}

}  // namespace
