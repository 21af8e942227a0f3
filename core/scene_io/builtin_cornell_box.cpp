// The Cornell box as measured at Cornell University
// (www.graphics.cornell.edu/online/box/data.html), millimetres to metres. Colours are Mitsuba's
// conversion of the measured spectra to linear Rec.709.
#include <array>
#include <cmath>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

using Corners = std::array<Vec3, 4>;

constexpr float kCeiling = 548.8F;
constexpr std::array<float, 4> kCeilingX = {0, 213, 343, 556};
constexpr std::array<float, 4> kCeilingZ = {0, 227, 332, 559.2F};

constexpr Corners kFloor = {{{552.8F, 0, 0}, {0, 0, 0}, {0, 0, 559.2F}, {549.6F, 0, 559.2F}}};
constexpr Corners kBackWall = {
    {{549.6F, 0, 559.2F}, {0, 0, 559.2F}, {0, kCeiling, 559.2F}, {556, kCeiling, 559.2F}}};
constexpr Corners kGreenWall = {
    {{0, 0, 559.2F}, {0, 0, 0}, {0, kCeiling, 0}, {0, kCeiling, 559.2F}}};
constexpr Corners kRedWall = {
    {{552.8F, 0, 0}, {549.6F, 0, 559.2F}, {556, kCeiling, 559.2F}, {556, kCeiling, 0}}};
constexpr Corners kLight = {
    {{343, kCeiling, 227}, {343, kCeiling, 332}, {213, kCeiling, 332}, {213, kCeiling, 227}}};

constexpr std::array<Corners, 5> kShortBlock = {{
    {{{130, 165, 65}, {82, 165, 225}, {240, 165, 272}, {290, 165, 114}}},
    {{{290, 0, 114}, {290, 165, 114}, {240, 165, 272}, {240, 0, 272}}},
    {{{130, 0, 65}, {130, 165, 65}, {290, 165, 114}, {290, 0, 114}}},
    {{{82, 0, 225}, {82, 165, 225}, {130, 165, 65}, {130, 0, 65}}},
    {{{240, 0, 272}, {240, 165, 272}, {82, 165, 225}, {82, 0, 225}}},
}};
constexpr std::array<Corners, 5> kTallBlock = {{
    {{{423, 330, 247}, {265, 330, 296}, {314, 330, 456}, {472, 330, 406}}},
    {{{423, 0, 247}, {423, 330, 247}, {472, 330, 406}, {472, 0, 406}}},
    {{{472, 0, 406}, {472, 330, 406}, {314, 330, 456}, {314, 0, 456}}},
    {{{314, 0, 456}, {314, 330, 456}, {265, 330, 296}, {265, 0, 296}}},
    {{{265, 0, 296}, {265, 330, 296}, {423, 330, 247}, {423, 0, 247}}},
}};

PrimitiveDescription metres(const Corners& mm) {
  return quad(mm[0] / 1000.0F, mm[1] / 1000.0F, mm[2] / 1000.0F, mm[3] / 1000.0F);
}

PrimitiveDescription block(const std::array<Corners, 5>& faces) {
  PrimitiveDescription out;
  for (const Corners& face : faces) {
    append(out, metres(face));
  }
  return out;
}

// The light fills a hole in the ceiling, so that the two do not share a plane.
PrimitiveDescription ceiling_with_hole() {
  PrimitiveDescription out;
  for (std::size_t ix = 0; ix < 3; ++ix) {
    for (std::size_t iz = 0; iz < 3; ++iz) {
      if (ix == 1 && iz == 1) {
        continue;
      }
      append(out, metres({{{kCeilingX[ix + 1], kCeiling, kCeilingZ[iz]},
                           {kCeilingX[ix + 1], kCeiling, kCeilingZ[iz + 1]},
                           {kCeilingX[ix], kCeiling, kCeilingZ[iz + 1]},
                           {kCeilingX[ix], kCeiling, kCeilingZ[iz]}}}));
    }
  }
  return out;
}

}  // namespace

Bytes make_cornell_box() {
  SceneDescription scene;
  const int white =
      add_material(scene, diffuse_material("white", {0.885809F, 0.698859F, 0.666422F}));
  const int red = add_material(scene, diffuse_material("red", {0.570068F, 0.0430135F, 0.0443706F}));
  const int green =
      add_material(scene, diffuse_material("green", {0.105421F, 0.37798F, 0.076425F}));
  // The measured light reflects 0.78 of the incident light, negligible beside its emission of 18.
  const int lamp = add_material(scene, emissive_material("lamp", {18.387F, 13.9873F, 6.75357F}));
  add_object(scene, "floor", metres(kFloor), white);
  add_object(scene, "ceiling", ceiling_with_hole(), white);
  add_object(scene, "back wall", metres(kBackWall), white);
  add_object(scene, "green wall", metres(kGreenWall), green);
  add_object(scene, "red wall", metres(kRedWall), red);
  add_object(scene, "short block", block(kShortBlock), white);
  add_object(scene, "tall block", block(kTallBlock), white);
  add_object(scene, "lamp", metres(kLight), lamp);
  // Focal length 35 mm, film 25 mm.
  add_camera(scene, {0.278F, 0.273F, -0.8F}, {0.278F, 0.273F, 0}, 2 * std::atan(0.0125F / 0.035F));
  return write_glb(scene);
}

}  // namespace core
