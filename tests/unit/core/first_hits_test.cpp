// Ids at pixel centres, against geometry; Cryptomatte, against alpha.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include <gtest/gtest.h>

#include "core/aovs/object_boxes.h"
#include "core/film/film_format.h"
#include "core/film/film_merge.h"
#include "core/integrators/registry.h"
#include "core/layers/layers.h"
#include "core/scene/matte_names.h"
#include "tests/support/scenes.h"

namespace {

using core::FirstHitPixel;
using core::Rgb;
using core::Vec2;
using core::Vec3;

constexpr int kWidth = 90;
constexpr int kHeight = 70;
constexpr Vec3 kEye = {0.1F, -0.05F, 5};
constexpr float kFov = 50;

/// A rectangle that faces the camera, and its ids.
struct Card {
  float z, x0, x1, y0, y1;
  FirstHitPixel ids;
  bool has_hole = false;  ///< its left half is absent
};

core::PrimitiveDescription card_quad(float x0, float x1, float y0, float y1, int material) {
  return test_support::quad({x0, y0, 0}, {x1 - x0, 0, 0}, {0, y1 - y0, 0}, material);
}

core::MeshDescription mesh_of(std::string name, std::vector<core::PrimitiveDescription> quads) {
  core::MeshDescription mesh;
  mesh.name = std::move(name);
  mesh.primitives = std::move(quads);
  return mesh;
}

/// Left half transparent.
std::shared_ptr<const core::Image> half_image() {
  auto image = std::make_shared<core::Image>();
  image->width = 2;
  image->height = 1;
  image->channels = 4;
  for (const int value : {255, 255, 255, 0, 255, 255, 255, 255}) {
    image->bytes.push_back(static_cast<std::byte>(value));
  }
  return image;
}

/// A wall of two primitives, a pane of glass with two instances, a card with a hole (MASK), one
/// with coverage 0.6 and one with 0.4 (BLEND).
core::SceneDescription cards_scene() {
  core::SceneDescription scene;
  scene.images = {half_image()};
  core::MaterialDescription glass = test_support::lambert({1, 1, 1});
  glass.transmission = 1;
  glass.roughness = 0;
  core::MaterialDescription mask = test_support::lambert({0.5F, 0.5F, 0.5F});
  mask.alpha_mode = core::AlphaMode::kMask;
  mask.base_color_texture = {.image = 0, .nearest = true};
  core::MaterialDescription blend = test_support::lambert({0.5F, 0.5F, 0.5F});
  blend.alpha_mode = core::AlphaMode::kBlend;
  blend.base_alpha = 0.6F;
  core::MaterialDescription faint = blend;
  faint.base_alpha = 0.4F;
  scene.materials = {test_support::lambert({0.8F, 0.2F, 0.2F}),
                     test_support::lambert({0.2F, 0.8F, 0.2F}),
                     glass,
                     mask,
                     blend,
                     faint};
  scene.meshes = {mesh_of("wall", {card_quad(-1.5F, 0, -1, 1, 0), card_quad(0, 1.5F, -1, 1, 1)}),
                  mesh_of("pane", {card_quad(-0.5F, 0.5F, -0.5F, 0.5F, 2)}),
                  mesh_of("mask", {card_quad(-0.6F, 0.6F, -0.3F, 0.3F, 3)}),
                  mesh_of("blend", {card_quad(-0.3F, 0.3F, -0.9F, -0.4F, 4)}),
                  mesh_of("faint", {card_quad(-1.4F, 1.4F, -0.9F, 0.9F, 5)})};
  scene.instances = {{0, {}},
                     {1, core::translation({-0.8F, 0.2F, 0.5F})},
                     {1, core::translation({0.9F, -0.2F, 0.7F})},
                     {2, core::translation({0, 0.3F, 1})},
                     {3, core::translation({0, 0, 1.5F})},
                     {4, core::translation({0, 0, 2})}};
  return scene;
}

/// The same, nearest first.
std::vector<Card> cards() {
  const auto ids = [](std::uint32_t object, std::uint32_t material, std::uint32_t primitive) {
    return FirstHitPixel{object, object, material, primitive, {}, {}, {}};
  };
  return {{1.5F, -0.3F, 0.3F, -0.9F, -0.4F, ids(5, 5, 5)},
          {1, -0.6F, 0.6F, 0, 0.6F, ids(4, 4, 4), true},
          {0.7F, 0.4F, 1.4F, -0.7F, 0.3F, ids(3, 3, 3)},
          {0.5F, -1.3F, -0.3F, -0.3F, 0.7F, ids(2, 3, 3)},
          {0, -1.5F, 0, -1, 1, ids(1, 1, 1)},
          {0, 0, 1.5F, -1, 1, ids(1, 2, 2)}};
}

core::View view_of(core::SceneDescription scene) {
  core::View view = test_support::view_of(std::move(scene), kWidth, kHeight);
  test_support::look_at(view, kEye, {kEye.x, kEye.y, 0}, kFov);
  view.settings.film.object = true;
  view.settings.max_depth = 3;
  return view;
}

/// Intersection of the ray through a pixel's centre with the plane at z.
Vec2 at_plane(int x, int y, float z) {
  const float half = std::tan(kFov * 3.14159265F / 360);
  const float away = kEye.z - z;
  return {kEye.x + ((static_cast<float>(x) + 0.5F) * 2 - kWidth) / kHeight * half * away,
          kEye.y + (1 - (static_cast<float>(y) + 0.5F) * 2 / kHeight) * half * away};
}

/// Computed from geometry; nothing if the ray is closer to an edge than rounding can resolve.
std::optional<FirstHitPixel> expected(int x, int y) {
  constexpr float kEdge = 1e-4F;  // rays have an error of about 1e-6 of 5 m
  for (const Card& card : cards()) {
    const Vec2 p = at_plane(x, y, card.z);
    for (const float edge : {card.x0, card.x1, 0.5F * (card.x0 + card.x1)}) {
      if (std::fabs(p.x - edge) < kEdge) {
        return std::nullopt;
      }
    }
    if (std::fabs(p.y - card.y0) < kEdge || std::fabs(p.y - card.y1) < kEdge) {
      return std::nullopt;
    }
    const bool inside = p.x > card.x0 && p.x < card.x1 && p.y > card.y0 && p.y < card.y1;
    if (inside && (!card.has_hole || p.x > 0.5F * (card.x0 + card.x1))) {
      FirstHitPixel out = card.ids;
      out.position = {p.x, p.y, card.z};
      out.uv = {(p.x - card.x0) / (card.x1 - card.x0), (p.y - card.y0) / (card.y1 - card.y0)};
      return out;
    }
  }
  return FirstHitPixel{};
}

bool are_equal(const FirstHitPixel& a, const FirstHitPixel& b) {
  return a.object == b.object && a.instance == b.instance && a.material == b.material &&
         a.primitive == b.primitive;
}

struct Faults {
  int ids = 0;
  int places = 0;
  int known = 0;  ///< number of compared pixels
};

Faults compare(const core::FilmSnapshot& film) {
  Faults out;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto want = expected(x, y);
      if (!want) {
        continue;
      }
      ++out.known;
      const FirstHitPixel& got = film.first_hits[static_cast<std::size_t>(y * kWidth + x)];
      out.ids += are_equal(got, *want) ? 0 : 1;
      const bool is_near = length(got.position - want->position) < 1e-4F &&
                           std::fabs(got.uv.x - want->uv.x) < 1e-3F &&
                           std::fabs(got.uv.y - want->uv.y) < 1e-3F;
      out.places += is_near ? 0 : 1;
    }
  }
  return out;
}

TEST(FirstHits, AreThoseOfTheHitAtThePixelCenter) {
  const Faults faults = compare(test_support::render(view_of(cards_scene()), 2).snapshot);
  EXPECT_GT(faults.known, 6000);
  EXPECT_EQ(faults.ids, 0);
  EXPECT_EQ(faults.places, 0);
}

/// Depths along the axis of the cards, whose planes face the camera; it looks along -z.
int wrong_depths(const core::FilmSnapshot& film) {
  int wrong = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto want = expected(x, y);
      const float depth = want && want->object != 0 ? kEye.z - want->position.z : 0;
      const float got = film.z_depths[static_cast<std::size_t>(y * kWidth + x)];
      wrong += want && std::fabs(got - depth) > 1e-5F * depth ? 1 : 0;
    }
  }
  return wrong;
}

TEST(ZDepth, OfAPlaneThatFacesTheCameraIsConstant) {
  core::View view = view_of(cards_scene());
  view.settings.film.object = false;
  view.settings.film.z_depth = true;
  const auto film = test_support::render(view, 2).snapshot;
  EXPECT_TRUE(film.first_hits.empty());
  EXPECT_EQ(wrong_depths(film), 0);
  auto nearer = cards_scene();
  nearer.instances[0].to_world.t.z += 0.001F;
  view.scene = test_support::build(std::move(nearer));
  EXPECT_GT(wrong_depths(test_support::render(view, 2).snapshot), 100);
}

/// The third row of OpenCV's extrinsics times the position, which the layer is, for any camera.
TEST(ZDepth, IsThePositionAlongTheAxisForEveryCamera) {
  using core::CameraType;
  std::array<core::CameraSettings, 5> cameras;
  cameras[0].type = CameraType::kPerspective;
  cameras[0].shift = Vec2{0.2F, 0};
  cameras[1].type = cameras[2].type = CameraType::kPinhole;
  cameras[1].fx_px = cameras[2].fx_px = 90;
  cameras[1].cx_px = 50;
  cameras[2].distortion = {core::DistortionModel::kFisheye, {0.01, 0, 0, 0}};
  cameras[3].type = CameraType::kOrthographic;
  cameras[4].type = CameraType::kPanorama;
  for (core::CameraSettings& camera : cameras) {
    camera.position = core::Place{0.4, 0.3, 4};
    camera.target = core::Place{-0.3, 0.1, 0};
    core::View view = view_of(cards_scene());
    view.camera = camera;
    view.settings.film.position = view.settings.film.z_depth = true;
    const auto film = test_support::render(view, 2).snapshot;
    const Vec3 eye = {0.4F, 0.3F, 4};
    const Vec3 ahead = normalize(Vec3{-0.3F, 0.1F, 0} - eye);
    int seen = 0;
    for (std::size_t i = 0; i < film.first_hits.size(); ++i) {
      const bool is_hit = film.first_hits[i].object != 0;
      const float depth = is_hit ? dot(film.first_hits[i].position - eye, ahead) : 0;
      EXPECT_NEAR(film.z_depths[i], depth, 1e-5F) << i;
      seen += is_hit ? 1 : 0;
    }
    EXPECT_GT(seen, 100);
  }
}

TEST(FirstHits, DetectPlantedFaults) {
  core::SceneDescription moved = cards_scene();
  moved.instances[3].to_world.t.x += 0.05F;
  EXPECT_GT(compare(test_support::render(view_of(std::move(moved)), 2).snapshot).ids, 0);
  core::SceneDescription swapped = cards_scene();
  std::swap(swapped.instances[1], swapped.instances[2]);
  EXPECT_GT(compare(test_support::render(view_of(std::move(swapped)), 2).snapshot).ids, 100);
}

TEST(FirstHits, EqualThoseOfTheObjectAloneIfUnoccluded) {
  const auto all = test_support::render(view_of(cards_scene()), 2).snapshot;
  for (std::size_t k = 0; k < 4; ++k) {  // the panes and cards; other objects stay in place, hidden
    core::SceneDescription scene = cards_scene();
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
      scene.instances[i].object = scene.instances[i].instance = static_cast<std::uint32_t>(i) + 1;
      scene.objects.push_back({.id = static_cast<std::uint32_t>(i) + 1,
                               .name = "",
                               .first_instance = static_cast<std::uint32_t>(i) + 1});
    }
    scene.instances = {scene.instances[k + 1]};
    core::View view = view_of(std::move(scene));
    const auto alone = test_support::render(view, 2).snapshot;
    int seen = 0;
    for (std::size_t i = 0; i < all.first_hits.size(); ++i) {
      const std::uint32_t id = static_cast<std::uint32_t>(k) + 2;
      const bool is_nearest = alone.first_hits[i].object == id &&
                              (all.first_hits[i].object == id || all.first_hits[i].object == 0 ||
                               all.first_hits[i].position.z < alone.first_hits[i].position.z);
      EXPECT_EQ(all.first_hits[i].object == id, is_nearest) << "object " << id << ", pixel " << i;
      seen += is_nearest ? 1 : 0;
    }
    EXPECT_GT(seen, 50);
  }
}

TEST(FirstHits, AreIndependentOfViewsThreadsAndTheCrop) {
  core::View view = view_of(cards_scene());
  const auto whole = test_support::render(view, 2, 1);
  EXPECT_EQ(whole.film->digest(), test_support::render(view, 2, 2).film->digest());
  view.settings.film.crop = core::PixelRect{33, 20, 30, 25};
  const auto part = test_support::render(view, 2).snapshot;
  for (int y = 0; y < 25; ++y) {
    for (int x = 0; x < 30; ++x) {
      EXPECT_TRUE(are_equal(
          part.first_hits[static_cast<std::size_t>(y * 30 + x)],
          whole.snapshot.first_hits[static_cast<std::size_t>((y + 20) * kWidth + x + 33)]));
    }
  }
}

TEST(ObjectBoxes, ContainTheVisiblePartOfEachObject) {
  const core::View view = view_of(cards_scene());
  const core::SceneSummary& summary = view.scene->summary();
  const auto camera =
      core::Camera::create(view.camera, summary.cameras, summary.bounds, kWidth, kHeight);
  ASSERT_TRUE(camera);
  const auto boxes = core::object_boxes(*view.scene, *camera, kWidth, kHeight, {2});
  ASSERT_EQ(boxes.objects.size(), 6U);
  EXPECT_EQ(boxes.instances.size(), 1U);
  const core::ObjectBox& pane = boxes.objects.at(2);
  EXPECT_NEAR(pane.bounds.min.x, -1.3F, 1e-6F);
  EXPECT_NEAR(pane.bounds.max.y, 0.7F, 1e-6F);
  EXPECT_EQ(pane.bounds.min.z, 0.5F);
  // Similar triangles: f / distance pixels per metre, from the centre of the film.
  const float scale = 0.5F * kHeight / std::tan(kFov * 3.14159265F / 360) / (kEye.z - 0.5F);
  ASSERT_TRUE(pane.in_view);
  EXPECT_NEAR(pane.in_view->min.x, 0.5F * kWidth + (-1.3F - kEye.x) * scale, 1e-3F);
  EXPECT_NEAR(pane.in_view->max.x, 0.5F * kWidth + (-0.3F - kEye.x) * scale, 1e-3F);
  EXPECT_NEAR(pane.in_view->min.y, 0.5F * kHeight - (0.7F - kEye.y) * scale, 1e-3F);
}

TEST(ObjectBoxes, EndAtTheFilmIfAnObjectReachesBehindTheCamera) {
  core::SceneDescription scene = cards_scene();
  // A floor from far in front of the camera to far behind it.
  scene.meshes[0].primitives = {test_support::quad({-9, -1, 20}, {18, 0, 0}, {0, 0, -40}, 0)};
  core::View view = view_of(std::move(scene));
  const core::SceneSummary& summary = view.scene->summary();
  const auto camera =
      core::Camera::create(view.camera, summary.cameras, summary.bounds, kWidth, kHeight);
  const auto boxes = core::object_boxes(*view.scene, *camera, kWidth, kHeight, {});
  const auto& floor = boxes.objects.at(1).in_view;
  ASSERT_TRUE(floor);
  EXPECT_EQ(floor->min.x, 0);
  EXPECT_EQ(floor->max.x, kWidth);
  EXPECT_EQ(floor->max.y, kHeight);
  // The far edge, 25 m away and 0.95 m below the camera.
  const float scale = 0.5F * kHeight / std::tan(kFov * 3.14159265F / 360) / 25;
  EXPECT_NEAR(floor->min.y, 0.5F * kHeight + 0.95F * scale, 1e-3F);
}

// The test vectors are those published with the reference implementation (SMHasher).
TEST(MatteNames, AreHashedByMurmurHash3) {
  EXPECT_EQ(core::murmur3(""), 0U);
  EXPECT_EQ(core::murmur3("hello"), 0x248bfa47U);
  EXPECT_EQ(core::murmur3("hello, world"), 0x149bbb7fU);
  EXPECT_EQ(core::murmur3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723U);
}

TEST(MatteNames, AreFiniteNormalFloats) {
  EXPECT_NE(core::matte_id(""), 0U);
  for (int i = 0; i < 20'000; ++i) {
    const std::uint32_t id = core::matte_id("object" + std::to_string(i));
    EXPECT_TRUE(std::isnormal(std::bit_cast<float>(id))) << i;
  }
}

TEST(MatteNames, DifferFromEachOther) {
  const std::vector<core::ObjectDescription> objects = {
      {3, "chair", 1, 1}, {5, "", 2, 1}, {6, "chair", 3, 1}, {9, "chair#5", 4, 1}};
  EXPECT_EQ(core::object_names(objects),
            (std::vector<std::string>{"chair", "/nodes/4", "chair#5", "chair#5#8"}));
  const std::vector<std::uint32_t> mattes = core::object_mattes(objects);
  ASSERT_EQ(mattes.size(), 10U);
  EXPECT_EQ(mattes[6], core::matte_id("chair#5"));
  EXPECT_EQ(mattes[4], 0U);
}

struct Mattes {
  float off = 0;     ///< largest difference of the sum of coverage from alpha
  int partial = 0;   ///< number of partially covered pixels
  int unsorted = 0;  ///< number of pixels whose ranks are not sorted
};

Mattes sums(const core::FilmSnapshot& film, const char* layer) {
  const auto image = core::layer_image(film, layer);
  EXPECT_TRUE(image);
  Mattes out;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const float* ranks = &image->values[12 * i];
    float sum = 0;
    for (std::size_t k = 0; k < core::kMatteRanks; ++k) {
      sum += ranks[2 * k + 1];
      out.unsorted += k > 0 && ranks[2 * k + 1] > ranks[2 * k - 1] ? 1 : 0;
    }
    const float alpha = core::pixel_value(film, i).alpha;
    out.off = std::max(out.off, std::fabs(sum - alpha));
    out.partial += alpha > 0.01F && alpha < 0.99F ? 1 : 0;
  }
  return out;
}

core::View matte_view() {
  core::View view = view_of(cards_scene());
  view.environment = test_support::constant_sky(core::Rgb(1));
  view.settings.background.type = core::BackgroundType::kTransparent;
  view.settings.film.object_mattes = true;
  view.settings.film.material_mattes = true;
  view.settings.film.filter = {core::FilterType::kBlackmanHarris, 1.5F};
  return view;
}

// Every sample has the same weight as in alpha: equal up to the rounding of the running means.
TEST(Cryptomatte, CoverageAddsUpToAlpha) {
  for (const char* integrator : {"path", "direct", "bdpt", "sppm"}) {
    for (const int waves : {8, 0}) {
      core::View view = matte_view();
      view.settings = core::default_settings(integrator);
      const core::View plain = matte_view();
      view.settings.film = plain.settings.film;
      view.settings.background = plain.settings.background;
      view.settings.max_depth = 3;
      view.wave_width = waves;
      const auto film = test_support::render(view, 12).snapshot;
      for (const char* layer : {"cryptomatte:object", "cryptomatte:material"}) {
        const Mattes mattes = sums(film, layer);
        EXPECT_LT(mattes.off, 1e-5F) << integrator << " " << layer;
        EXPECT_GT(mattes.partial, 100);
        EXPECT_EQ(mattes.unsorted, 0);
      }
    }
  }
}

TEST(Cryptomatte, DetectsALostSample) {
  auto film = test_support::render(matte_view(), 12).snapshot;
  for (core::MattePixel& pixel : film.mattes) {
    if (pixel[0].hits[0] > 0) {
      --pixel[0].hits[0];
    }
  }
  EXPECT_GT(sums(film, "cryptomatte:object").off, 0.05F);
}

TEST(Cryptomatte, CoverageAddsUpToAlphaForAdaptivePlans) {
  core::View view = matte_view();
  view.settings.adaptive = {.type = core::AdaptiveType::kPilot, .min_samples = 8};
  const auto film = test_support::render(view, 64).snapshot;
  EXPECT_LT(sums(film, "cryptomatte:object").off, 1e-5F);
}

TEST(Cryptomatte, IdsAreHashesOfTheNames) {
  const auto film = test_support::render(matte_view(), 16).snapshot;
  const auto image = core::layer_image(film, "cryptomatte:object");
  ASSERT_TRUE(image);
  EXPECT_EQ(image->channel_names[0], "CryptoObject00.R");
  EXPECT_EQ(image->channel_names[11], "CryptoObject02.A");
  // At (0.3, 0.4, 1): the card of low coverage, and behind it the half card.
  const std::size_t pixel = std::size_t{26} * kWidth + 48;
  EXPECT_EQ(film.first_hits[pixel].object, 4U);
  std::array<std::uint32_t, 2> ids{};
  for (std::size_t k = 0; k < 2; ++k) {
    std::memcpy(&ids[k], &image->values[12 * pixel + 2 * k], sizeof ids[k]);
  }
  std::array<std::uint32_t, 2> names = {core::matte_id("faint"), core::matte_id("mask")};
  std::sort(ids.begin(), ids.end());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(ids, names);
  EXPECT_EQ(image->values[12 * pixel + 5], 0) << "coverage of a third id";
}

TEST(Cryptomatte, PartsMergeToTheFilmOfTheWholeBitForBit) {
  const auto part = [](int first, int replicates, int samples) {
    core::View view = matte_view();
    view.settings.first_replicate = first;
    view.settings.replicates = replicates;
    auto film = test_support::render(view, samples).film;
    auto ledger = core::ledger_of(*film, 0, first);
    return core::FilmPart{std::move(film), std::move(ledger)};
  };
  const auto whole = part(0, 4, 16);
  const auto merged = core::merge_films(std::vector{part(2, 2, 8), part(0, 2, 8)}, 64);
  ASSERT_TRUE(merged);
  EXPECT_EQ(merged->film->digest(), whole.film->digest());
}

TEST(Cryptomatte, IgnoresASeventhId) {
  core::MattePixel pixel{};
  for (std::uint32_t id = 7; id > 0; --id) {
    core::add_matte(pixel, {id, {1, 0}});
    core::add_matte(pixel, {id, {0, 1}});
  }
  for (std::uint32_t k = 0; k < 6; ++k) {
    EXPECT_EQ(pixel[k].id, k + 2);
    EXPECT_EQ(pixel[k].hits[0] + pixel[k].hits[1], 2U);
  }
}

TEST(FilmFormat, StoresFirstHitsAndMattes) {
  auto film = test_support::render(matte_view(), 4).film;
  auto ledger = core::ledger_of(*film, 0, 0);
  const core::FilmPart part = {std::move(film), std::move(ledger)};
  const auto write = [&part] {
    std::vector<std::byte> file;
    core::write_film(part, "", [&file](std::span<const std::byte> piece) {
      file.insert(file.end(), piece.begin(), piece.end());
      return true;
    });
    return file;
  };
  const auto read = core::read_film(write(), {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->part.film->has_first_hits());
  EXPECT_EQ(read->part.film->digest(), part.film->digest());
  auto* spoilt = const_cast<core::Film*>(part.film.get());
  core::TileState tile = spoilt->tile(0);
  tile.mattes[0] = {};
  tile.mattes[0][0] = {1, {99, 99}};
  spoilt->commit(0, std::move(tile));
  EXPECT_FALSE(core::read_film(write(), {})) << "more samples than the pixel has";
}

}  // namespace
