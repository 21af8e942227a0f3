// A pool under one small light. All light below the water comes through its waves, and back through
// them to the camera: caustics seen through a refractive surface, which neither camera paths nor
// connections find.
#include <cmath>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

// The basin: x from -kX to kX, z from -kZ to kZ, its floor at -kDepth, still water at 0, the deck
// at kDeck.
constexpr float kX = 1.6F;
constexpr float kZ = 1.2F;
constexpr float kDepth = 0.9F;
constexpr float kDeck = 0.12F;
constexpr float kRim = 0.9F;  // of the deck

/// Four wave trains; slopes below 0.2, so that light passes both ways.
float wave_height(float x, float z) {
  return 0.011F * std::sin(5.1F * x + 2.3F * z) + 0.009F * std::sin(-3.7F * x + 6.2F * z + 1) +
         0.005F * std::sin(9.3F * x - 4.1F * z + 2.2F) +
         0.004F * std::sin(4.4F * x + 11 * z + 0.7F);
}

MaterialDescription water_material() {
  MaterialDescription water = glass_material("water", {0.62F, 0.88F, 0.93F}, 2);
  water.ior = 1.333F;
  return water;
}

void add_basin(SceneDescription& scene, int tiles, int stone) {
  PrimitiveDescription basin =
      quad({-kX, -kDepth, kZ}, {kX, -kDepth, kZ}, {kX, -kDepth, -kZ}, {-kX, -kDepth, -kZ});
  append(basin, quad({-kX, -kDepth, -kZ}, {kX, -kDepth, -kZ}, {kX, kDeck, -kZ}, {-kX, kDeck, -kZ}));
  append(basin, quad({kX, -kDepth, kZ}, {-kX, -kDepth, kZ}, {-kX, kDeck, kZ}, {kX, kDeck, kZ}));
  append(basin, quad({-kX, -kDepth, kZ}, {-kX, -kDepth, -kZ}, {-kX, kDeck, -kZ}, {-kX, kDeck, kZ}));
  append(basin, quad({kX, -kDepth, -kZ}, {kX, -kDepth, kZ}, {kX, kDeck, kZ}, {kX, kDeck, -kZ}));
  add_object(scene, "basin", basin, tiles);
  const auto slab = [](float x0, float z0, float x1, float z1) {
    return quad({x0, kDeck, z1}, {x1, kDeck, z1}, {x1, kDeck, z0}, {x0, kDeck, z0});
  };
  PrimitiveDescription deck = slab(-kX - kRim, -kZ - kRim, kX + kRim, -kZ);
  append(deck, slab(-kX - kRim, kZ, kX + kRim, kZ + kRim));
  append(deck, slab(-kX - kRim, -kZ, -kX, kZ));
  append(deck, slab(kX, -kZ, kX + kRim, kZ));
  add_object(scene, "deck", deck, stone);
}

}  // namespace

Bytes make_caustic_pool() {
  SceneDescription scene;
  const int tiles = add_material(scene, diffuse_material("tiles", {0.66F, 0.78F, 0.8F}));
  const int stone = add_material(scene, diffuse_material("stone", {0.5F, 0.46F, 0.4F}));
  const int red = add_material(scene, diffuse_material("red", {0.75F, 0.13F, 0.08F}));
  const int yellow = add_material(scene, diffuse_material("yellow", {0.8F, 0.6F, 0.1F}));
  const int water = add_material(scene, water_material());
  const int lamp = add_material(scene, emissive_material("lamp", Rgb{11000, 10500, 9400}));
  add_basin(scene, tiles, stone);
  // The surface extends into the walls to leave no gap; the walls bound the rest of the water.
  add_object(scene, "water", height_field(2 * kX + 0.02F, 2 * kZ + 0.02F, 192, &wave_height),
             water);
  add_object(scene, "red ball", sphere(0.2F, 96), red,
             translation({-0.55F, 0.2001F - kDepth, 0.1F}));
  add_object(scene, "yellow ball", sphere(0.13F, 96), yellow,
             translation({0.5F, 0.1301F - kDepth, 0.45F}));
  add_object(scene, "step",
             box({kX - 0.5F, -kDepth + 0.0001F, -kZ + 0.0001F},
                 {kX - 0.0001F, -0.5F * kDepth, kZ - 0.0001F}),
             tiles);
  const Vec3 at = {0.7F, 3, -0.8F};
  constexpr float kHalf = 0.04F;
  add_object(scene, "lamp",
             quad({at.x - kHalf, at.y, at.z - kHalf}, {at.x + kHalf, at.y, at.z - kHalf},
                  {at.x + kHalf, at.y, at.z + kHalf}, {at.x - kHalf, at.y, at.z + kHalf}),
             lamp);
  add_camera(scene, {-0.5F, 1.75F, 2.9F}, {0.05F, -0.5F, -0.05F}, 0.72F);
  return write_glb(scene);
}

}  // namespace core
