// After E. Veach, Robust Monte Carlo Methods for Light Transport Simulation, 1997, figure 9.2:
// plates of growing roughness below emitters of growing size and equal power.
#include <array>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

struct Plate {
  Vec2 front;  // y, z of the lower edge
  Vec2 back;   // y, z of the upper edge
  float roughness;
};
// Each plate's normal bisects the directions to the camera and to the lights. Roughness is the
// square root of the widths 0.005, 0.02, 0.05 and 0.1.
constexpr std::array kPlates = {
    Plate{{-2.70651F, 0.25609F}, {-2.08375F, -0.526323F}, 0.0707F},
    Plate{{-3.28825F, 1.36972F}, {-2.83856F, 0.476536F}, 0.1414F},
    Plate{{-3.73096F, 2.70046F}, {-3.43378F, 1.74564F}, 0.2236F},
    Plate{{-3.99615F, 4.0667F}, {-3.82069F, 3.08221F}, 0.3162F},
};

struct Lamp {
  float x;
  float radius;
  Rgb tint;  // luminance 1
};
constexpr std::array kLamps = {
    Lamp{-3.75F, 0.0333F, {0.72F, 1.03F, 1.53F}},
    Lamp{-1.25F, 0.1F, {0.85F, 1.03F, 1.14F}},
    Lamp{1.25F, 0.3F, {1.25F, 0.97F, 0.56F}},
    Lamp{3.75F, 0.9F, {1.7F, 0.85F, 0.4F}},
};

}  // namespace

Bytes make_veach_mis() {
  SceneDescription scene;
  const int matte = add_material(scene, diffuse_material("matte", Rgb(0.4F)));
  add_object(
      scene, "floor",
      quad({-14, -4.14615F, 12}, {14, -4.14615F, 12}, {14, -4.14615F, -2}, {-14, -4.14615F, -2}),
      matte);
  add_object(scene, "wall",
             quad({-14, -4.14615F, -2}, {14, -4.14615F, -2}, {14, 12, -2}, {-14, 12, -2}), matte);
  for (const Plate& plate : kPlates) {
    const int steel =
        add_material(scene, metal_material("steel", {0.56F, 0.57F, 0.58F}, plate.roughness));
    const Vec3 a = {-4, plate.front.x, plate.front.y};
    const Vec3 b = {4, plate.front.x, plate.front.y};
    const Vec3 c = {4, plate.back.x, plate.back.y};
    const Vec3 d = {-4, plate.back.x, plate.back.y};
    PrimitiveDescription slab = quad(a, b, c, d);
    const Vec3 down = slab.normals[0] * -0.06F;
    append(slab, quad(a + down, b + down, b, a));
    append(slab, quad(d, c, c + down, d + down));
    append(slab, quad(b, b + down, c + down, c));
    append(slab, quad(a + down, a, d, d + down));
    append(slab, quad(d + down, c + down, b + down, a + down));
    add_object(scene, "plate", slab, steel);
  }
  for (const Lamp& lamp : kLamps) {
    // Radiance times radius squared is equal for all.
    const int glow = add_material(
        scene, emissive_material("lamp", lamp.tint * (1 / (lamp.radius * lamp.radius))));
    add_object(scene, "lamp", sphere(lamp.radius, 48), glow, translation({lamp.x, 0, 0}));
  }
  const int far_lamp = add_material(scene, emissive_material("far lamp", Rgb(300)));
  add_object(scene, "far lamp", sphere(0.5F, 48), far_lamp, translation({10, 10, 4}));
  add_camera(scene, {0, 2, 15}, {0, -1.85F, 2.5F}, 0.42F);
  return write_glb(scene);
}

}  // namespace core
