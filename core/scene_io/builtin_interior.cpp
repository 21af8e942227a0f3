// A living room in the evening. All light comes from the corridor through a half-open door; most of
// the visible light is indirect.
#include <array>
#include <utility>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/builtin_textures.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

// The room: x from -2.6 to 2.6, y from 0 to 2.6, z from -2.2 to 2.2; the door is in the wall x
// = 2.6.
constexpr float kX = 2.6F;
constexpr float kY = 2.6F;
constexpr float kZ = 2.2F;
constexpr float kDoorFrom = -1.5F;  // z
constexpr float kDoorTo = -0.6F;
constexpr float kDoorTop = 2.05F;
constexpr float kWall = 0.16F;  // thickness at the door

struct Materials {
  int plaster, ceiling, wood_floor, oak, dark_wood, cloth, cushion, rug, canvas, brass, ceramic,
      leaf, white_paint;
};

int textured(SceneDescription& scene, MaterialDescription material, Image image) {
  material.base_color_texture = add_texture(scene, std::move(image));
  return add_material(scene, std::move(material));
}

Materials make_materials(SceneDescription& scene) {
  Materials m{};
  m.plaster = add_material(scene, diffuse_material("plaster", {0.74F, 0.7F, 0.64F}));
  m.ceiling = add_material(scene, diffuse_material("ceiling", {0.82F, 0.81F, 0.79F}));
  m.wood_floor = textured(scene, plastic_material("floor boards", Rgb(1), 0.38F), wood_planks(512));
  m.oak = add_material(scene, plastic_material("oak", {0.5F, 0.33F, 0.18F}, 0.35F));
  m.dark_wood = add_material(scene, plastic_material("dark wood", {0.13F, 0.075F, 0.045F}, 0.3F));
  m.cloth = textured(scene, diffuse_material("cloth", Rgb(1)),
                     woven_check(256, {0.55F, 0.62F, 0.6F}, {0.3F, 0.4F, 0.42F}));
  MaterialDescription velvet = plastic_material("cushion", {0.55F, 0.2F, 0.08F}, 0.9F);
  velvet.sheen_color = {0.5F, 0.3F, 0.2F};
  velvet.sheen_roughness = 0.4F;
  m.cushion = add_material(scene, velvet);
  m.rug = textured(scene, diffuse_material("rug", Rgb(1)), rug(384, 256));
  m.canvas = textured(scene, diffuse_material("canvas", Rgb(1)), painting(320, 240));
  m.brass = add_material(scene, metal_material("brass", {0.91F, 0.74F, 0.41F}, 0.25F));
  MaterialDescription glaze = plastic_material("glaze", {0.07F, 0.22F, 0.3F}, 0.6F);
  glaze.clearcoat = 1;
  glaze.clearcoat_roughness = 0.05F;
  m.ceramic = add_material(scene, glaze);
  m.leaf = add_material(scene, plastic_material("leaf", {0.1F, 0.25F, 0.07F}, 0.5F));
  m.white_paint = add_material(scene, plastic_material("white paint", {0.8F, 0.79F, 0.76F}, 0.3F));
  return m;
}

void add_shell(SceneDescription& scene, const Materials& m) {
  PrimitiveDescription floor =
      quad({-kX, 0, kZ}, {kX + 1.6F, 0, kZ}, {kX + 1.6F, 0, -kZ}, {-kX, 0, -kZ});
  floor.uv[0] = {{0, 3.4F}, {4.3F, 3.4F}, {4.3F, 0}, {0, 0}};
  add_object(scene, "floor", floor, m.wood_floor);
  add_object(scene, "ceiling", quad({-kX, kY, -kZ}, {kX, kY, -kZ}, {kX, kY, kZ}, {-kX, kY, kZ}),
             m.ceiling);
  PrimitiveDescription walls = quad({-kX, 0, -kZ}, {kX, 0, -kZ}, {kX, kY, -kZ}, {-kX, kY, -kZ});
  append(walls, quad({-kX, 0, kZ}, {-kX, 0, -kZ}, {-kX, kY, -kZ}, {-kX, kY, kZ}));
  append(walls, quad({kX, 0, kZ}, {-kX, 0, kZ}, {-kX, kY, kZ}, {kX, kY, kZ}));
  // The wall with the door is solid, so that its reveal catches the light.
  append(walls, box({kX, 0, -kZ - 0.2F}, {kX + kWall, kY, kDoorFrom}));
  append(walls, box({kX, 0, kDoorTo}, {kX + kWall, kY, kZ + 0.2F}));
  append(walls, box({kX, kDoorTop, kDoorFrom}, {kX + kWall, kY, kDoorTo}));
  add_object(scene, "walls", walls, m.plaster);
  constexpr float kSkirting = 0.09F;
  constexpr float kThin = 0.015F;
  PrimitiveDescription skirting = box({-kX, 0, -kZ}, {kX, kSkirting, -kZ + kThin});
  append(skirting, box({-kX, 0, -kZ + kThin}, {-kX + kThin, kSkirting, kZ}));
  append(skirting, box({kX - kThin, 0, -kZ + kThin}, {kX, kSkirting, kDoorFrom - 0.08F}));
  append(skirting, box({kX - kThin, 0, kDoorTo + 0.08F}, {kX, kSkirting, kZ}));
  // The door's frame.
  append(skirting, box({kX - 0.02F, 0, kDoorFrom - 0.08F}, {kX, kDoorTop + 0.08F, kDoorFrom}));
  append(skirting, box({kX - 0.02F, 0, kDoorTo}, {kX, kDoorTop + 0.08F, kDoorTo + 0.08F}));
  append(skirting, box({kX - 0.02F, kDoorTop, kDoorFrom}, {kX, kDoorTop + 0.08F, kDoorTo}));
  add_object(scene, "skirting and door frame", skirting, m.white_paint);
}

void add_door_and_light(SceneDescription& scene, const Materials& m) {
  // Hinged at kDoorFrom and opened into the room; closed it would extend along +z.
  constexpr float kWidth = kDoorTo - kDoorFrom - 0.01F;
  const Transform hinge = translation({kX - 0.03F, 0, kDoorFrom + 0.005F}) * rotation_y(-0.85F);
  PrimitiveDescription leaf = box({-0.02F, 0.01F, 0}, {0.02F, kDoorTop - 0.01F, kWidth});
  for (const float low : {0.2F, 1.15F}) {
    append(leaf, box({-0.03F, low, 0.14F}, {0.03F, low + 0.7F, kWidth - 0.14F}));
  }
  add_object(scene, "door", leaf, m.white_paint, hinge);
  PrimitiveDescription handle =
      box({-0.055F, 1.02F, kWidth - 0.08F}, {0.055F, 1.035F, kWidth - 0.06F});
  append(handle, box({-0.07F, 1.02F, kWidth - 0.18F}, {-0.055F, 1.04F, kWidth - 0.06F}));
  append(handle, box({0.055F, 1.02F, kWidth - 0.18F}, {0.07F, 1.04F, kWidth - 0.06F}));
  add_object(scene, "handle", handle, m.brass, hinge);
  const int glow = add_material(scene, emissive_material("corridor", Rgb{36, 32, 26}));
  constexpr float kFar = kX + 1.5F;
  constexpr float kNear = kX + kWall;
  constexpr float kFrom = kDoorFrom - 0.7F;
  constexpr float kTo = kDoorTo + 0.5F;
  add_object(scene, "corridor light",
             quad({kFar, 0.05F, kFrom}, {kFar, 0.05F, kTo}, {kFar, 2.4F, kTo}, {kFar, 2.4F, kFrom}),
             glow);
  // Ends and ceiling of the corridor reflect some of the light.
  PrimitiveDescription corridor =
      quad({kNear, 0, -kZ}, {kFar, 0, -kZ}, {kFar, kY, -kZ}, {kNear, kY, -kZ});
  append(corridor, quad({kFar, 0, kZ}, {kNear, 0, kZ}, {kNear, kY, kZ}, {kFar, kY, kZ}));
  append(corridor, quad({kNear, kY, kZ}, {kNear, kY, -kZ}, {kFar, kY, -kZ}, {kFar, kY, kZ}));
  add_object(scene, "corridor", corridor, m.plaster);
}

PrimitiveDescription table_shape(Vec3 half, float top, float leg) {
  PrimitiveDescription p = box({-half.x, half.y - top, -half.z}, {half.x, half.y, half.z}, 1);
  for (const float x : {-half.x + 0.03F, half.x - 0.03F - leg}) {
    for (const float z : {-half.z + 0.03F, half.z - 0.03F - leg}) {
      append(p, box({x, 0, z}, {x + leg, half.y - top, z + leg}));
    }
  }
  return p;
}

void add_furniture(SceneDescription& scene, const Materials& m) {
  // Sofa along the back wall.
  PrimitiveDescription sofa = box({-0.95F, 0.1F, -0.42F}, {0.95F, 0.42F, 0.42F}, 3);
  append(sofa, box({-0.95F, 0.42F, -0.42F}, {0.95F, 0.85F, -0.2F}, 3));
  append(sofa, box({-1.12F, 0.1F, -0.42F}, {-0.95F, 0.62F, 0.42F}, 3));
  append(sofa, box({0.95F, 0.1F, -0.42F}, {1.12F, 0.62F, 0.42F}, 3));
  const Transform sofa_at = translation({-0.75F, 0, -1.72F});
  add_object(scene, "sofa", sofa, m.cloth, sofa_at);
  PrimitiveDescription feet;
  for (const float x : {-1.05F, 0.99F}) {
    for (const float z : {-0.38F, 0.32F}) {
      append(feet, box({x, 0, z}, {x + 0.06F, 0.1F, z + 0.06F}));
    }
  }
  add_object(scene, "sofa feet", feet, m.dark_wood, sofa_at);
  const int cushion = add_mesh(scene, "cushion", sphere(1, 64), m.cushion);
  for (const float x : {-1.45F, -0.1F}) {
    add_instance(
        scene, cushion,
        translation({x, 0.62F, -1.68F}) * rotation_y(0.3F * x) * scaling({0.22F, 0.2F, 0.09F}));
  }
  // Low table on a rug, two stools.
  PrimitiveDescription carpet = box({-1.05F, 0.0005F, -0.7F}, {1.05F, 0.012F, 0.7F});
  PrimitiveDescription pile = quad({-1.05F, 0.0125F, 0.7F}, {1.05F, 0.0125F, 0.7F},
                                   {1.05F, 0.0125F, -0.7F}, {-1.05F, 0.0125F, -0.7F});
  append(carpet, pile);
  add_object(scene, "rug", carpet, m.rug, translation({-0.5F, 0, -0.45F}) * rotation_y(0.06F));
  add_object(scene, "table", table_shape({0.5F, 0.4F, 0.3F}, 0.035F, 0.045F), m.oak,
             translation({-0.55F, 0.013F, -0.5F}));
  const int stool =
      add_mesh(scene, "stool", table_shape({0.19F, 0.42F, 0.19F}, 0.04F, 0.035F), m.dark_wood);
  add_instance(scene, stool, translation({0.95F, 0, -0.15F}) * rotation_y(0.4F));
  add_instance(scene, stool, translation({1.0F, 0, 0.75F}) * rotation_y(-0.2F));
}

void add_shelf(SceneDescription& scene, const Materials& m) {
  PrimitiveDescription shelf = box({0, 0, 0}, {0.03F, 2, 0.3F});
  append(shelf, box({1.07F, 0, 0}, {1.1F, 2, 0.3F}));
  append(shelf, box({0.03F, 0, 0}, {1.07F, 2, 0.012F}));
  for (int i = 0; i <= 5; ++i) {
    const float y = 0.06F + 0.38F * static_cast<float>(i);
    append(shelf, box({0.03F, y, 0.012F}, {1.07F, y + 0.025F, 0.3F}));
  }
  // Against the wall x = -kX, its front to +x.
  const Transform at = translation({-kX + 0.001F, 0, 0.6F}) * rotation_y(1.5707963F);
  add_object(scene, "shelf", shelf, m.oak, at);
  constexpr std::array<Rgb, 6> kSpines = {{{0.4F, 0.08F, 0.06F},
                                           {0.08F, 0.16F, 0.3F},
                                           {0.5F, 0.42F, 0.25F},
                                           {0.1F, 0.22F, 0.14F},
                                           {0.32F, 0.3F, 0.28F},
                                           {0.55F, 0.3F, 0.08F}}};
  std::array<PrimitiveDescription, kSpines.size()> books;
  PlacementNumbers numbers(3);
  for (int row = 0; row < 5; ++row) {
    const float y = 0.085F + 0.38F * static_cast<float>(row);
    float x = 0.04F;
    while (x < numbers.between(0.75F, 1.0F)) {
      const float width = numbers.between(0.02F, 0.05F);
      const auto color =
          static_cast<std::size_t>(numbers.next() * static_cast<float>(kSpines.size()));
      append(books[color], box({x, y, 0.05F}, {x + width, y + numbers.between(0.2F, 0.31F),
                                               numbers.between(0.22F, 0.27F)}));
      x += width + 0.002F;
    }
  }
  for (std::size_t i = 0; i < books.size(); ++i) {
    const int spine = add_material(scene, plastic_material("book", kSpines[i], 0.55F));
    add_object(scene, "books", books[i], spine, at);
  }
}

void add_decoration(SceneDescription& scene, const Materials& m) {
  constexpr std::array<Vec2, 16> kVase = {{{0, 0},
                                           {0.06F, 0},
                                           {0.075F, 0.01F},
                                           {0.11F, 0.08F},
                                           {0.12F, 0.15F},
                                           {0.1F, 0.22F},
                                           {0.06F, 0.27F},
                                           {0.045F, 0.31F},
                                           {0.055F, 0.335F},
                                           {0.05F, 0.338F},
                                           {0.04F, 0.31F},
                                           {0.055F, 0.27F},
                                           {0.093F, 0.22F},
                                           {0.112F, 0.15F},
                                           {0.06F, 0.03F},
                                           {0, 0.02F}}};
  add_object(scene, "vase", lathe(kVase, 72), m.ceramic, translation({-0.72F, 0.413F, -0.55F}));
  constexpr std::array<Vec2, 11> kBowl = {{{0, 0},
                                           {0.05F, 0},
                                           {0.055F, 0.012F},
                                           {0.11F, 0.035F},
                                           {0.15F, 0.075F},
                                           {0.153F, 0.078F},
                                           {0.15F, 0.079F},
                                           {0.107F, 0.041F},
                                           {0.05F, 0.02F},
                                           {0.02F, 0.018F},
                                           {0, 0.018F}}};
  add_object(scene, "bowl", lathe(kBowl, 72), m.brass, translation({-0.32F, 0.413F, -0.42F}));
  // Painting on the back wall.
  PrimitiveDescription frame = box({-0.56F, -0.43F, 0}, {0.56F, -0.4F, 0.035F});
  append(frame, box({-0.56F, 0.4F, 0}, {0.56F, 0.43F, 0.035F}));
  append(frame, box({-0.56F, -0.4F, 0}, {-0.53F, 0.4F, 0.035F}));
  append(frame, box({0.53F, -0.4F, 0}, {0.56F, 0.4F, 0.035F}));
  const Transform wall = translation({-0.75F, 1.55F, -kZ + 0.001F});
  add_object(scene, "frame", frame, m.dark_wood, wall);
  add_object(scene, "painting",
             quad({-0.53F, -0.4F, 0.012F}, {0.53F, -0.4F, 0.012F}, {0.53F, 0.4F, 0.012F},
                  {-0.53F, 0.4F, 0.012F}),
             m.canvas, wall);
  // A plant in the corner: a pot and leaves of stretched spheres.
  constexpr std::array<Vec2, 8> kPot = {{{0, 0},
                                         {0.13F, 0},
                                         {0.14F, 0.01F},
                                         {0.19F, 0.32F},
                                         {0.195F, 0.33F},
                                         {0.175F, 0.33F},
                                         {0.165F, 0.29F},
                                         {0, 0.28F}}};
  const Vec3 corner = {1.55F, 0, -1.75F};
  add_object(scene, "pot", lathe(kPot, 64), m.white_paint, translation(corner));
  const int leaf = add_mesh(scene, "leaf", sphere(1, 24), m.leaf);
  PlacementNumbers numbers(5);
  for (int i = 0; i < 46; ++i) {
    const Transform turn = rotation_y(numbers.between(0, 6.2831853F));
    const float lean = numbers.between(0.15F, 1.1F);
    const Transform tilt = rotation({0, 0, std::sin(-lean / 2), std::cos(-lean / 2)});
    const float size = numbers.between(0.18F, 0.34F);
    add_instance(scene, leaf,
                 translation(corner + Vec3{0, 0.3F, 0}) * turn * tilt *
                     translation({0, size * 1.3F, 0}) *
                     scaling({size * 0.05F, size, size * 0.22F}));
  }
}

}  // namespace

Bytes make_interior() {
  SceneDescription scene;
  const Materials m = make_materials(scene);
  add_shell(scene, m);
  add_door_and_light(scene, m);
  add_furniture(scene, m);
  add_shelf(scene, m);
  add_decoration(scene, m);
  add_camera(scene, {0.9F, 1.42F, 2.1F}, {-0.05F, 0.95F, -1.3F}, 1.0F);
  return write_glb(scene);
}

}  // namespace core
