#include "tests/support/bsdf_cases.h"

#include <cmath>

#include "core/sampling/warp.h"

namespace test_support {

using core::BsdfParameters;
using core::Vec3;

namespace {

BsdfParameters rough(float roughness) {
  BsdfParameters p;
  p.roughness = roughness;
  p.alpha_x = p.alpha_y = roughness * roughness;
  return p;
}

/// Adds clearcoats over white diffuse surfaces, with an interface and without.
void add_coated(std::vector<BsdfCase>& cases) {
  // The tables are within 2e-4 of these smooth curves; the sequence that adds up a rough coat is
  // within 8e-4 at 80 degrees. Attenuated twice without regard to both, 1.4e-3 to 1.3e-2 too much.
  constexpr double kTolerance = 0.001;
  const auto percent = [](float r) { return r > 0 ? (r > 0.5F ? "70" : "20") : "00"; };
  for (const float over : {0.0F, 0.2F, 0.7F}) {
    core::BsdfLayers coat;
    coat.clearcoat = 1;
    coat.clearcoat_roughness = over;
    const std::string name = std::string("Coat") + percent(over);
    BsdfParameters p = rough(1);
    p.f0 = {0, 0, 0};
    p.f90 = 0;
    cases.push_back({name + "OverMatte", p, true, kTolerance, coat});
    for (const float under : {0.0F, 0.2F, 0.7F}) {
      p = rough(under);
      p.alpha_x = p.alpha_y = std::max(p.alpha_x, 1e-4F);
      // A rough lobe passes the coat as often as the flatter of its two directions allows, so that
      // the coat takes more of it than it reflects.
      cases.push_back({name + "OverWhite" + percent(under), p, under == 0, kTolerance, coat});
    }
  }
}

/// Adds the less common layers, over typical bases.
void add_layered(std::vector<BsdfCase>& cases) {
  const auto add = [&cases](std::string name, const BsdfParameters& p,
                            const core::BsdfLayers& layers, bool lossless,
                            double tolerance = 0.01) {
    cases.push_back({std::move(name), p, lossless, tolerance, layers});
  };
  for (const float r : {0.2F, 0.7F}) {
    const std::string tail = r > 0.5F ? "70" : "20";
    core::BsdfLayers coat;
    coat.clearcoat = 1;
    coat.clearcoat_roughness = r;
    BsdfParameters p = rough(0.5F);
    add("CoatOverDielectric" + tail, p, coat, false);
    p.metallic = 1;
    add("CoatOverMetal" + tail, p, coat, false);
    core::BsdfLayers sheen;
    sheen.sheen_color = {0.9F, 0.5F, 0.2F};
    sheen.sheen_roughness = r;
    add("SheenOverDielectric" + tail, rough(0.6F), sheen, false);
    core::BsdfLayers film;
    film.iridescence = 1;
    film.iridescence_thickness_nm = 420;
    p = rough(r);
    add("FilmOverDielectric" + tail, p, film, false);
    p.metallic = 1;
    p.base_color = {0.9F, 0.6F, 0.3F};
    add("FilmOverMetal" + tail, p, film, false);
    p.metallic = 0.5F;
    add("FilmOverHalfMetal" + tail, p, film, false);
    p = rough(r);
    p.transmission = 1;
    add("FilmOverThinGlass" + tail, p, film, false);
    p.thin = false;
    add("FilmOverSolidGlassOutside" + tail, p, film, false, 0.02);
    p.inside = true;
    add("FilmOverSolidGlassInside" + tail, p, film, false, 0.02);
    core::BsdfLayers leaf;
    leaf.diffuse_transmission = 0.6F;
    add("DiffuseTransmission" + tail, rough(r), leaf, true);
    p = rough(r);
    p.transmission = 0.5F;
    p.thin = false;
    add("MilkyGlassOutside" + tail, p, leaf, true);
    p.inside = true;
    add("MilkyGlassInside" + tail, p, leaf, true);
    p.transmission = 0;
    add("WaxInside" + tail, p, leaf, true);
    p.inside = false;
    add("WaxOutside" + tail, p, leaf, true);
  }
  // Whose albedo falls and rises again towards grazing angles.
  core::BsdfLayers film;
  film.iridescence = 1;
  film.iridescence_ior = 1.2F;
  film.iridescence_thickness_nm = 600;
  film.clearcoat = 1;
  add("CoatOverFilm", rough(0.5F), film, false, 0.001);
  core::BsdfLayers coat;
  coat.clearcoat = 0.7F;
  coat.clearcoat_normal = core::normalize(Vec3{0.1F, -0.05F, 1});
  add("SmoothCoatOverRough", rough(0.6F), coat, false);
}

}  // namespace

std::vector<BsdfCase> bsdf_cases() {
  std::vector<BsdfCase> cases;
  const auto add = [&cases](std::string name, const BsdfParameters& p, bool lossless,
                            double tolerance = 0.005) {
    cases.push_back({std::move(name), p, lossless, tolerance, std::nullopt});
  };
  BsdfParameters p = rough(1);
  p.f0 = {0, 0, 0};
  p.f90 = 0;
  add("Lambert", p, true, 1e-5);
  p.base_color = {0.8F, 0.5F, 0.2F};
  add("LambertColoured", p, false);
  for (const float r : {0.3F, 0.6F, 1.0F}) {
    const std::string tail = r == 1 ? "100" : (r < 0.5F ? "30" : "60");
    add("Dielectric" + tail, rough(r), true);
    p = rough(r);
    p.metallic = 1;
    add("Metal" + tail, p, true);
    p = rough(r);
    p.transmission = 1;
    add("ThinGlass" + tail, p, true, 0.01);
    p.thin = false;
    p.f90 = 1;
    add("SolidGlassOutside" + tail, p, true, 0.01);
    p.inside = true;
    add("SolidGlassInside" + tail, p, true, 0.01);
    for (const float specular : {0.4F, 0.0F}) {  // KHR_materials_specular
      const std::string name = specular > 0 ? "Dimmed" : "Matte";
      p.f90 = specular;
      p.specular_color = {1.6F, 1.6F, 1.6F};
      p.inside = true;
      add(name + "SolidGlassInside" + tail, p, true, 0.01);
      p.inside = false;
      add(name + "SolidGlassOutside" + tail, p, true, 0.01);
    }
    p.f90 = 1;
    p.specular_color = {0, 0, 0};
    add("GrazingSolidGlassOutside" + tail, p, true, 0.01);
    p.f90 = 0.4F;
    p.specular_color = {2, 1, 0.2F};
    add("RedSolidGlassOutside" + tail, p, false, 0.01);
  }
  p = rough(0.5F);
  p.metallic = 1;
  p.alpha_x = 0.6F;
  p.alpha_y = 0.25F;
  add("AnisotropicWhiteMetal", p, true, 0.05);  // the tables are for isotropic lobes only
  p.base_color = {1, 0.8F, 0.3F};
  p.alpha_y = 0.15F;
  add("AnisotropicGold", p, false, 0.05);
  p = rough(0.5F);
  p.transmission = 1;
  p.thin = false;
  for (const float narrow : {0.04F, 0.16F}) {
    const std::string tail = narrow < 0.1F ? "20" : "40";
    p.alpha_x = 1;
    p.alpha_y = narrow;
    p.inside = false;
    // The tables are within .015 of the albedos of these lobes, from which those of isotropic lobes
    // of the same mean width differ by up to .05 outside and .09 inside (numerical integration).
    add("BrushedSolidGlassOutside" + tail, p, true, 0.02);
    p.inside = true;
    add("BrushedSolidGlassInside" + tail, p, true, 0.02);
  }
  p = rough(0.5F);
  p.metallic = 0.5F;
  p.transmission = 0.5F;
  p.base_color = {0.9F, 0.6F, 0.4F};
  add("HalfMetalHalfThin", p, false);
  p.thin = false;
  add("HalfMetalHalfSolid", p, false);
  p = rough(0);
  p.alpha_x = p.alpha_y = 1e-4F;
  add("SmoothDielectric", p, true);
  p.transmission = 1;
  add("SmoothThinGlass", p, true);
  p.thin = false;
  add("SmoothSolidGlass", p, true, 1e-3);
  p.f90 = 0.5F;
  add("DimmedSmoothSolidGlass", p, true, 1e-3);
  p.f90 = 1;
  p.ior = 1;
  p.f0 = {0, 0, 0};
  add("IndexMatched", p, true, 1e-3);
  add_layered(cases);
  add_coated(cases);
  return cases;
}

Vec3 direction(double degrees) {
  const double theta = degrees * 3.14159265358979 / 180;
  const double phi = 0.2;
  return {static_cast<float>(std::sin(theta) * std::cos(phi)),
          static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
}

Vec3 tilted_normal() {
  const double theta = 20 * 3.14159265358979 / 180;
  return {static_cast<float>(std::sin(theta) * 0.6), static_cast<float>(std::sin(theta) * 0.8),
          static_cast<float>(std::cos(theta))};
}

Vec3 random_hemisphere(Random& random) { return core::uniform_hemisphere(random.uniform_2d()); }

}  // namespace test_support
