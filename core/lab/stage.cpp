#include "core/lab/stage.h"

#include <cmath>

#include "core/math/numbers.h"

namespace core::lab {
namespace {

/// The two triangles of the light, facing down: x + y <= 0 and above.
SceneData make_scene(double half) {
  const auto h = static_cast<float>(half);
  SceneData scene;
  std::vector<LightBounds> bounds;
  for (const float sign : {-1.0F, 1.0F}) {
    TriangleLight t;
    t.p0 = {sign * h, sign * h, 1};
    t.edge1 = {-2 * sign * h, 0, 0};
    t.edge2 = {0, -2 * sign * h, 0};
    t.normal = {0, 0, -1};
    t.area_m2 = 2 * h * h;
    t.radiance = Rgb(1);
    LightBounds b;
    b.box.add(t.p0);
    b.box.add(t.p0 + t.edge1);
    b.box.add(t.p0 + t.edge2);
    b.axis = t.normal;
    b.power = t.area_m2;
    scene.triangle_lights.push_back(t);
    bounds.push_back(b);
  }
  scene.light_tree = LightTree(bounds);
  return scene;
}

BsdfParameters lambert() {
  BsdfParameters p;
  p.f0 = Rgb(0);
  p.f90 = 0;
  return p;
}

constexpr Vec3 kUp = {0, 0, 1};

double quarter(double a, double b) {
  const double ra = std::sqrt(1 + a * a);
  const double rb = std::sqrt(1 + b * b);
  return 0.5 * (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb));
}

}  // namespace

double rectangle_irradiance(double x0, double x1, double y0, double y1) {
  return quarter(x1, y1) - quarter(x0, y1) - quarter(x1, y0) + quarter(x0, y0);
}

Stage::Stage(double side, double hidden)
    : half_(side / 2),
      edge_(-side / 2 + hidden * side),
      scene_(make_scene(half_)),
      lights_(scene_, nullptr, LightPick::kTree),
      bsdf_(lambert(), kUp, kUp) {}

double Stage::exact(double x_from) const noexcept {
  return rectangle_irradiance(x_from, half_, -half_, half_);
}

bool Stage::meets_light(Vec3 wi) const noexcept {
  const auto h = static_cast<float>(half_);
  return wi.z > 0 && std::fabs(wi.x) <= h * wi.z && std::fabs(wi.y) <= h * wi.z;
}

float Stage::pdf_light(Vec3 wi) const noexcept {
  if (!meets_light(wi)) {
    return 0;
  }
  const std::uint32_t triangle = wi.x + wi.y <= 0 ? 0 : 1;
  return lights_.pdf_triangle(triangle, {0, 0, 0}, kUp, 1 / wi.z, wi.z);
}

Stage::Sample Stage::toward(Vec3 wi, float pdf_solid_angle) const noexcept {
  Sample s;
  s.pdf_solid_angle = pdf_solid_angle;
  if (meets_light(wi)) {
    s.unhidden = bsdf_.evaluate(wi).value_cos.r * kPi;
    s.value = wi.x >= static_cast<float>(edge_) * wi.z ? s.unhidden : 0;
  }
  return s;
}

Stage::Sample Stage::sample_light(Vec4 u) const noexcept {
  const LightSample light = lights_.sample({0, 0, 0}, kUp, u.x, {u.y, u.z});
  if (!(light.pdf_solid_angle > 0)) {
    return {};
  }
  // Every sample is on the light; rounding at its edge must not move it outside.
  Sample s;
  s.pdf_solid_angle = light.pdf_solid_angle;
  const BsdfEval eval = bsdf_.evaluate(light.wi_world);
  s.unhidden = eval.value_cos.r * kPi * light.radiance.r;
  s.value = light.wi_world.x >= static_cast<float>(edge_) * light.wi_world.z ? s.unhidden : 0;
  s.other_pdf_solid_angle = eval.pdf_solid_angle;
  return s;
}

Stage::Sample Stage::sample_bsdf(Vec4 u) const noexcept {
  const BsdfSample b = bsdf_.sample(u.x, {u.y, u.z});
  if (!(b.pdf_solid_angle > 0)) {
    return {};
  }
  Sample s = toward(b.wi_local, b.pdf_solid_angle);
  s.other_pdf_solid_angle = pdf_light(b.wi_local);
  return s;
}

}  // namespace core::lab
