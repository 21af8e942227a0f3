// A dark room next to a bright one. The emitter faces away from the door between them, whose
// keyhole is the only opening: every contributing path is reflected at least twice and passes an
// opening of a few centimetres.
#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

// Both rooms: y from 0 to kY, z from -kZ to kZ; the bright one from kWest to 0, the dark one from
// kDoor to kEast.
constexpr float kY = 2.4F;
constexpr float kZ = 1.5F;
constexpr float kWest = -1.3F;
constexpr float kDoor = 0.06F;
constexpr float kEast = 3.0F;

// The keyhole: a square head above a slot.
constexpr float kHead = 0.06F;  // half its width
constexpr float kSlot = 0.027F;
constexpr float kLow = 0.93F;
constexpr float kNeck = 1.03F;
constexpr float kHigh = 1.15F;

void add_rooms(SceneDescription& scene, int plaster, int boards) {
  add_object(scene, "floor", quad({kWest, 0, kZ}, {kEast, 0, kZ}, {kEast, 0, -kZ}, {kWest, 0, -kZ}),
             boards);
  PrimitiveDescription walls =
      quad({kWest, 0, -kZ}, {kEast, 0, -kZ}, {kEast, kY, -kZ}, {kWest, kY, -kZ});
  append(walls, quad({kEast, 0, kZ}, {kWest, 0, kZ}, {kWest, kY, kZ}, {kEast, kY, kZ}));
  append(walls, quad({kWest, 0, kZ}, {kWest, 0, -kZ}, {kWest, kY, -kZ}, {kWest, kY, kZ}));
  append(walls, quad({kEast, 0, -kZ}, {kEast, 0, kZ}, {kEast, kY, kZ}, {kEast, kY, -kZ}));
  append(walls, quad({kWest, kY, -kZ}, {kEast, kY, -kZ}, {kEast, kY, kZ}, {kWest, kY, kZ}));
  add_object(scene, "walls", walls, plaster);
}

void add_door(SceneDescription& scene, int plaster, int paint) {
  constexpr float kHalf = 0.45F;  // half the door's width
  constexpr float kTop = 2;
  PrimitiveDescription wall = box({0, 0, -kZ}, {kDoor, kY, -kHalf});
  append(wall, box({0, 0, kHalf}, {kDoor, kY, kZ}));
  append(wall, box({0, kTop, -kHalf}, {kDoor, kY, kHalf}));
  add_object(scene, "dividing wall", wall, plaster);
  PrimitiveDescription door = box({0, 0, -kHalf}, {kDoor, kTop, -kHead});
  append(door, box({0, 0, kHead}, {kDoor, kTop, kHalf}));
  append(door, box({0, 0, -kHead}, {kDoor, kLow, kHead}));
  append(door, box({0, kHigh, -kHead}, {kDoor, kTop, kHead}));
  append(door, box({0, kLow, -kHead}, {kDoor, kNeck, -kSlot}));
  append(door, box({0, kLow, kSlot}, {kDoor, kNeck, kHead}));
  add_object(scene, "door", door, paint);
}

void add_table(SceneDescription& scene, int oak) {
  const Transform at = translation({1.25F, 0, 0.02F}) * rotation_y(0.2F);
  PrimitiveDescription table = box({-0.3F, 0.7F, -0.5F}, {0.3F, 0.74F, 0.5F});
  for (const float x : {-0.27F, 0.22F}) {
    for (const float z : {-0.47F, 0.42F}) {
      append(table, box({x, 0, z}, {x + 0.05F, 0.7F, z + 0.05F}));
    }
  }
  add_object(scene, "table", table, oak, at);
}

}  // namespace

Bytes make_keyhole() {
  SceneDescription scene;
  const int plaster = add_material(scene, diffuse_material("plaster", {0.8F, 0.77F, 0.72F}));
  const int boards = add_material(scene, diffuse_material("boards", {0.5F, 0.37F, 0.25F}));
  const int paint = add_material(scene, plastic_material("paint", {0.35F, 0.42F, 0.4F}, 0.4F));
  const int oak = add_material(scene, diffuse_material("oak", {0.45F, 0.28F, 0.14F}));
  const int clay = add_material(scene, diffuse_material("clay", {0.7F, 0.35F, 0.22F}));
  const int brass = add_material(scene, metal_material("brass", {0.91F, 0.74F, 0.41F}, 0.2F));
  const int glass = add_material(scene, glass_material("glass", Rgb(1), 0));
  const int lamp = add_material(scene, emissive_material("lamp", Rgb{3900, 3600, 3000}));
  add_rooms(scene, plaster, boards);
  add_door(scene, plaster, paint);
  add_table(scene, oak);
  add_object(scene, "jar", sphere(0.13F, 96), clay, translation({1.18F, 0.8701F, -0.24F}));
  add_object(scene, "ball", sphere(0.11F, 96), brass, translation({1.3F, 0.8501F, 0.3F}));
  add_object(scene, "glass ball", sphere(0.1F, 96), glass, translation({1.32F, 0.8401F, 0.03F}));
  add_object(
      scene, "lamp",
      quad({-0.5F, 1.5F, -0.3F}, {-0.5F, 1.5F, 0.3F}, {-0.5F, 2.1F, 0.3F}, {-0.5F, 2.1F, -0.3F}),
      lamp);
  add_camera(scene, {2.85F, 1.5F, 1.2F}, {0.75F, 0.85F, -0.2F}, 0.85F);
  return write_glb(scene);
}

}  // namespace core
