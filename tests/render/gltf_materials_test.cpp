// Opaque materials of glTF against the formulas of appendix B and of the KHR extensions, under one
// sun: the radiance is f(wo, wi) * lux * cos, without noise.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/bsdf/thin_film.h"
#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::pixel;
using test_support::towards;

constexpr double kPi = 3.14159265358979323846;

struct Wide {
  double x, y, z;
};
Wide wide(Vec3 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

double schlick(double f0, double cos_vh) { return f0 + (1 - f0) * std::pow(1 - cos_vh, 5); }

/// D * V of appendix B.3.2, viewed along the normal; widths along x and y as in
/// KHR_materials_anisotropy.
double specular_along_normal(Wide wi, double alpha_x, double alpha_y) {
  const double length = std::sqrt(wi.x * wi.x + wi.y * wi.y + (wi.z + 1) * (wi.z + 1));
  const Wide h = {wi.x / length, wi.y / length, (wi.z + 1) / length};
  const double k = h.x * h.x / (alpha_x * alpha_x) + h.y * h.y / (alpha_y * alpha_y) + h.z * h.z;
  const double d = 1 / (kPi * alpha_x * alpha_y * k * k);
  const double root =
      std::sqrt(alpha_x * alpha_x * wi.x * wi.x + alpha_y * alpha_y * wi.y * wi.y + wi.z * wi.z);
  return d * 0.5 / (root + wi.z);  // the viewer's root in V is 1 for a viewer at n
}
double half_cos(Wide wi) { return std::sqrt((1 + wi.z) / 2); }  // between wo = n and h

float lit(const core::MaterialDescription& m, Vec3 wi, int channel = 0) {
  core::SceneDescription scene = test_support::stage(m);
  scene.lights.push_back(test_support::sun(wi, {1, 1, 1}));
  return pixel(test_support::shoot_glb(scene, {}), 4, 4)[channel];
}

TEST(GltfMaterials, MetalIsGgxWithSchlickFresnelInTheBaseColor) {
  // The specification has single scattering. Multiple scattering adds at most (1 - E(wo)) (1 -
  // E(wi)) / (1 - E_avg) of a Lambertian, times the colour; E by truth 3 for alpha = 0.25: 0.9158
  // along the normal.
  core::MaterialDescription m;
  m.base_color = {0.9F, 0.5F, 0.2F};
  m.roughness = 0.5F;
  for (const double theta : {5.0, 30.0, 55.0}) {
    const Vec3 wi = towards(theta, 40);
    for (int c = 0; c < 3; ++c) {
      const double f0 = static_cast<double>(m.base_color[c]);
      const double expected = schlick(f0, half_cos(wide(wi))) *
                              specular_along_normal(wide(wi), 0.25, 0.25) *
                              static_cast<double>(wi.z);
      const auto seen = static_cast<double>(lit(m, wi, c));
      const double bounces = (1 - 0.9158) * 1.3 * f0 / kPi * static_cast<double>(wi.z);
      EXPECT_GT(seen, expected * 0.9995) << theta << " " << c;
      EXPECT_LT(seen, expected * 1.0005 + bounces) << theta << " " << c;
    }
  }
}

TEST(GltfMaterials, DielectricIsFourPercentOverItsDiffuseBase) {
  core::MaterialDescription m;
  m.base_color = {0.8F, 0.3F, 0};
  m.metallic = 0;
  m.roughness = 0.6F;
  for (const double theta : {10.0, 45.0, 65.0}) {
    const Vec3 wi = towards(theta);
    const double f = schlick(0.04, half_cos(wide(wi)));
    const double specular = f * specular_along_normal(wide(wi), 0.36, 0.36);
    for (int c = 0; c < 3; ++c) {
      // fresnel_mix; the energy-conserving coupling by albedos differs from it by up to 6% of the
      // base.
      const double expected = (specular + (1 - f) * static_cast<double>(m.base_color[c]) / kPi) *
                              static_cast<double>(wi.z);
      EXPECT_NEAR(static_cast<double>(lit(m, wi, c)), expected, 0.06 * expected + 3e-4)
          << theta << " " << c;
    }
  }
}

TEST(GltfMaterials, SpecularColorReducesTheBaseByItsLargestChannel) {
  // KHR_materials_specular: the base keeps its hue under a red highlight; the view is outside the
  // highlight.
  core::MaterialDescription m;
  m.metallic = 0;
  m.roughness = 0.2F;
  m.ior = 0;  // then f0 is the specular colour
  m.specular_color = {0.5F, 0, 0};
  m.base_color = {0, 0.6F, 0.6F};
  const Vec3 wi = towards(30);
  const double expected =
      (1 - schlick(0.5, half_cos(wide(wi)))) * 0.6 / kPi * static_cast<double>(wi.z);
  EXPECT_NEAR(static_cast<double>(lit(m, wi, 1)), expected,
              0.06 * expected);  // twice that if each channel used its own value
}

TEST(GltfMaterials, SpecularFactorZeroIsLambertian) {
  core::MaterialDescription m;
  m.metallic = 0;
  m.specular = 0;
  m.base_color = {0.7F, 0.7F, 0.7F};
  EXPECT_NEAR(static_cast<double>(lit(m, towards(60))), 0.7 / kPi * 0.5, 1e-6);
}

TEST(GltfMaterials, AnisotropyStretchesHighlightsAlongItsDirection) {
  // alpha_t = mix(alpha, 1, strength^2) along the tangent, rotated counter-clockwise by the
  // rotation.
  const double roughness = 0.4;
  const double strength = 0.7;
  const double rotation = 0.5;
  core::MaterialDescription m;
  m.base_color = {0.05F, 0.05F, 0.05F};  // so dark that multiple scattering is negligible
  m.roughness = 0.4F;
  m.anisotropy = 0.7F;
  m.anisotropy_rotation_rad = 0.5F;
  const double alpha = roughness * roughness;
  const double along = alpha + (1 - alpha) * strength * strength;
  for (const double phi : {0.0, 28.6479, 75.0, 118.6479, -40.0}) {
    const Vec3 wi = towards(30, phi);
    const Wide w = wide(wi);
    const Wide turned = {w.x * std::cos(rotation) + w.y * std::sin(rotation),
                         -w.x * std::sin(rotation) + w.y * std::cos(rotation), w.z};
    const double expected =
        schlick(0.05, half_cos(w)) * specular_along_normal(turned, along, alpha) * w.z;
    EXPECT_NEAR(static_cast<double>(lit(m, wi)), expected, 1e-3 * expected + 1e-3) << phi;
  }
}

TEST(GltfMaterials, AnisotropyTextureRotatesTheDirection) {
  // Red and green 128, 255: direction +y in the tangent frame; blue 255: full strength.
  core::MaterialDescription m;
  m.roughness = 0.3F;
  m.anisotropy = 0.8F;
  m.anisotropy_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  test_support::add_image(scene, 1, 1, 3, {128, 255, 255});
  const auto shown = [&scene](double phi) {
    core::SceneDescription with = scene;
    with.lights.push_back(test_support::sun(towards(40, phi), {1, 1, 1}));
    return pixel(test_support::shoot_glb(with, {}), 4, 4).r;
  };
  EXPECT_GT(shown(90), 10 * shown(0));
}

TEST(GltfMaterials, ClearcoatAddsFourPercentAboveTheGeometricNormal) {
  // The base is black, so only the coat is visible: GGX with f0 = 0.04, unaffected by the normal
  // map of the base.
  core::MaterialDescription m = test_support::lambert({0, 0, 0});
  m.clearcoat = 0.8F;
  m.clearcoat_roughness = 0.5F;
  m.normal_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  test_support::add_image(scene, 1, 1, 3, {200, 128, 220});
  const Vec3 wi = towards(20, 60);
  scene.lights.push_back(test_support::sun(wi, {1, 1, 1}));
  const double expected = 0.8 * schlick(0.04, half_cos(wide(wi))) *
                          specular_along_normal(wide(wi), 0.25, 0.25) * static_cast<double>(wi.z);
  EXPECT_NEAR(static_cast<double>(pixel(test_support::shoot_glb(scene, {}), 4, 4).r), expected,
              0.01 * expected);
}

TEST(GltfMaterials, ClearcoatUsesItsNormalMap) {
  core::MaterialDescription m = test_support::lambert({0, 0, 0});
  m.clearcoat = 1;
  m.clearcoat_roughness = 0.3F;
  m.clearcoat_normal_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  test_support::add_image(scene, 1, 1, 3, {172, 128, 247});  // tilted by 20.4 degrees towards +u
  const auto shown = [&scene](double theta) {
    core::SceneDescription with = scene;
    with.lights.push_back(test_support::sun(towards(theta), {1, 1, 1}));
    return pixel(test_support::shoot_glb(with, {}), 4, 4).r;
  };
  // The mirror direction of the viewer is at twice the tilt.
  EXPECT_GT(shown(41), 20 * shown(-41));
  EXPECT_GT(shown(41), 2 * shown(15));
}

/// Charlie's distribution with the shadowing of Estevez and Kulla 2017, in double.
double charlie(Wide wi, double cos_view, double roughness) {
  const double alpha = roughness * roughness;
  const double sin_view = std::sqrt(1 - cos_view * cos_view);
  const double hx = wi.x + sin_view;
  const double length = std::sqrt(hx * hx + wi.y * wi.y + (wi.z + cos_view) * (wi.z + cos_view));
  const double cos_h = (wi.z + cos_view) / length;
  const double d = (2 + 1 / alpha) * std::pow(1 - cos_h * cos_h, 0.5 / alpha) / (2 * kPi);
  const double t = (1 - alpha) * (1 - alpha);
  const auto mix = [t](double at_rough, double at_smooth) {
    return at_rough + (at_smooth - at_rough) * t;
  };
  const auto curve = [&mix](double x) {
    return mix(21.5473, 25.3245) /
               (1 + mix(3.82987, 3.32435) * std::pow(x, mix(0.19823, 0.16801))) +
           mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967);
  };
  const auto lambda = [&curve](double c) {
    return c < 0.5 ? std::exp(curve(c)) : std::exp(2 * curve(0.5) - curve(1 - c));
  };
  return d / ((1 + lambda(cos_view) + lambda(wi.z)) * 4 * cos_view * wi.z);
}

TEST(GltfMaterials, SheenIsCharlieOverAReducedBase) {
  for (const double roughness : {0.3, 0.7, 1.0}) {
    core::MaterialDescription m = test_support::lambert({0, 0, 0});
    m.sheen_color = {1, 0.5F, 0.25F};
    m.sheen_roughness = static_cast<float>(roughness);
    const Vec3 wi = towards(60, 90);
    for (int c = 0; c < 3; ++c) {
      const double expected = static_cast<double>(m.sheen_color[c]) *
                              charlie(wide(wi), 1, roughness) * static_cast<double>(wi.z);
      EXPECT_NEAR(static_cast<double>(lit(m, wi, c)), expected, 1e-3 * expected + 1e-6)
          << roughness << " " << c;
    }
    // Over a white base: base * min(1 - max(sheen) E(wo), 1 - max(sheen) E(wi)).
    const auto albedo = [roughness](double cos_view) {
      double sum = 0;
      constexpr int kSteps = 400;
      for (int i = 0; i < kSteps; ++i) {
        for (int k = 0; k < kSteps; ++k) {
          const double z = (i + 0.5) / kSteps;
          const double phi = 2 * kPi * (k + 0.5) / kSteps;
          const double r = std::sqrt(1 - z * z);
          sum += charlie({r * std::cos(phi), r * std::sin(phi), z}, cos_view, roughness) * z;
        }
      }
      return sum * 2 * kPi / (kSteps * kSteps);
    };
    m.base_color = {0, 0, 1};
    const double fuzz = 0.25 * charlie(wide(wi), 1, roughness);
    const double share = std::min(1 - albedo(1), 1 - albedo(0.5));
    EXPECT_NEAR(static_cast<double>(lit(m, wi, 2)), (fuzz + share / kPi) * 0.5, 0.004) << roughness;
  }
}

TEST(GltfMaterials, IridescenceFactorOrThicknessZeroIsNoFilm) {
  // In closed form: a smooth black dielectric of index 1.5 under a white sky returns 4%.
  const auto sky = test_support::constant_sky({1, 1, 1});
  const auto returned = [&sky](float factor, float thickness_nm) {
    core::MaterialDescription m;
    m.metallic = 0;
    m.roughness = 0;
    m.base_color = {0, 0, 0};
    m.iridescence = factor;
    m.iridescence_thickness_min_nm = 0;
    m.iridescence_thickness_max_nm = thickness_nm;
    return pixel(test_support::shoot_glb(test_support::stage(m), {.sky = sky}), 4, 4);
  };
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(returned(0, 400)[c], 0.04F, 2e-5F);
    EXPECT_NEAR(returned(1, 0)[c], 0.04F, 2e-5F);
  }
  const Rgb film = returned(1, 400);
  const Rgb formula = core::thin_film_fresnel(1, 1.3F, 400, Rgb(0.04F));
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(film[c], formula[c], 2e-4F);
  }
}

TEST(GltfMaterials, ThinFilmShowsTheColorsOfTheAirySum) {
  // Truth 14 exactly for one wavelength; then the colour formula of the extension, a sum of
  // Gaussians, against the Airy sum under CIE matching functions (Wyman, Sloan and Shirley 2013):
  // within a twentieth of its range.
  const double quarter = 550 / (4 * 1.38);
  EXPECT_NEAR(core::airy_reflectance(1, 1, 1.38, 1.52, quarter, 550), 0.0126, 1e-4);
  const double bare = std::pow((1.52 - 1) / (1.52 + 1), 2);
  EXPECT_NEAR(core::airy_reflectance(1, 1, 1.38, 1.52, 0, 550), bare, 1e-9);
  const auto y_bar = [](double nm) {
    const auto bell = [nm](double a, double mu, double s1, double s2) {
      const double t = (nm - mu) / (nm < mu ? s1 : s2);
      return a * std::exp(-0.5 * t * t);
    };
    return bell(0.821, 568.8, 46.9, 40.5) + bell(0.286, 530.9, 16.3, 31.1);
  };
  for (const double thickness : {150.0, 250.0, 400.0}) {
    double sum = 0;
    double weight = 0;
    for (double nm = 380; nm < 760; nm += 2) {
      sum += y_bar(nm) * core::airy_reflectance(1, 1, 1.6, 1.5, thickness, nm);
      weight += y_bar(nm);
    }
    const auto f0 = static_cast<float>(std::pow(0.5 / 2.5, 2));
    const Rgb seen = core::thin_film_fresnel(1, 1.6F, static_cast<float>(thickness), Rgb(f0));
    EXPECT_NEAR(static_cast<double>(core::luminance(seen)), sum / weight, 0.01) << thickness;
  }
}

TEST(GltfMaterials, DiffuseTransmissionTransmitsItsFactor) {
  core::MaterialDescription m = test_support::lambert({0.8F, 0.8F, 0.8F});
  m.diffuse_transmission = 0.3F;
  m.diffuse_transmission_color = {1, 0.5F, 0.2F};
  m.double_sided = true;
  const double cosine = std::cos(50 * kPi / 180);
  for (int c = 0; c < 3; ++c) {
    const double color = static_cast<double>(m.diffuse_transmission_color[c]);
    EXPECT_NEAR(static_cast<double>(lit(m, towards(50), c)), 0.7 * 0.8 / kPi * cosine, 1e-6)
        << "front";
    EXPECT_NEAR(static_cast<double>(lit(m, towards(130), c)), 0.3 * color / kPi * cosine, 1e-6)
        << "back";
  }
}

TEST(GltfMaterials, EmissionIsFactorTimesStrengthTimesTexture) {
  core::MaterialDescription m = test_support::lambert({0, 0, 0});
  m.emissive = Rgb{1, 0.5F, 0.25F} * 6;  // written as a strength of 6
  m.emissive_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  test_support::add_image(scene, 1, 1, 3, {255, 128, 0});
  const Rgb seen = pixel(test_support::shoot_glb(scene, {}), 4, 4);
  EXPECT_NEAR(static_cast<double>(seen.r), 6, 1e-5);
  EXPECT_NEAR(static_cast<double>(seen.g), 3 * test_support::srgb_to_linear(128), 1e-5);
  EXPECT_EQ(seen.b, 0);
}

TEST(GltfMaterials, UnlitIgnoresLight) {
  core::MaterialDescription m;
  m.unlit = true;
  m.base_color = {0.2F, 0.4F, 0.6F};
  EXPECT_NEAR(lit(m, towards(30), 0), 0.2F, 1e-6F);
  EXPECT_NEAR(lit(m, towards(170), 2), 0.6F, 1e-6F);
}

TEST(GltfMaterials, IorZeroReflectsEverything) {
  // KHR_materials_ior: 0 means an infinite index, so Fresnel is 1: no light reaches the base.
  core::MaterialDescription m;
  m.metallic = 0;
  m.roughness = 0;
  m.ior = 0;
  m.base_color = {0, 0, 0};
  const Rgb seen = pixel(test_support::shoot_glb(test_support::stage(m),
                                                 {.sky = test_support::constant_sky({1, 1, 1})}),
                         4, 4);
  EXPECT_NEAR(seen.g, 1, 1e-5F);
}

/// One triangle that covers the patch, written by hand with the JSON of its materials.
core::Bytes raw_glb(const char* materials[], int count, const char* primitive_more,
                    const char* extensions) {
  core::GlbWriter writer;
  const float positions[9] = {-1, -1, 0, 5, -1, 0, -1, 5, 0};
  const int accessor = writer.add_accessor(std::as_bytes(std::span(positions)), 5126, "VEC3", 3,
                                           R"({"min": [-1, -1, 0], "max": [5, 5, 0]})");
  for (int i = 0; i < count; ++i) {
    writer.add("materials", materials[i]);
  }
  writer.add("meshes", R"({"primitives": [{"attributes": {"POSITION": )" +
                           std::to_string(accessor) + R"(}, "material": 0)" + primitive_more +
                           "}]}");
  writer.add("nodes", R"({"mesh": 0})");
  writer.add("cameras",
             R"({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0,)"
             R"( "zfar": 20}})");
  writer.add("nodes", R"({"camera": 0, "translation": [0, 0, 10]})");
  writer.use_extension("KHR_materials_unlit");
  writer.use_extension("KHR_materials_variants");
  writer.use_extension("KHR_materials_pbrSpecularGlossiness");
  writer.set("extensions", extensions);
  return writer.finish();
}

TEST(GltfMaterials, VariantsSelectTheMaterial) {
  const char* materials[] = {R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]},)"
                             R"( "extensions": {"KHR_materials_unlit": {}}})",
                             R"({"pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1]},)"
                             R"( "extensions": {"KHR_materials_unlit": {}}})"};
  const core::Bytes glb =
      raw_glb(materials, 2,
              R"(, "extensions": {"KHR_materials_variants": {"mappings": [{"material": 1,)"
              R"( "variants": [1]}]}})",
              R"({"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}})");
  for (const char* variant : {"", "day", "night"}) {
    core::GltfOptions options;
    if (*variant != '\0') {
      options.variant = variant;
    }
    const Rgb seen = pixel(test_support::shoot(test_support::load(glb, options), {}), 4, 4);
    const bool night = std::string(variant) == "night";
    EXPECT_EQ(seen.r, night ? 0 : 1) << variant;
    EXPECT_EQ(seen.g, night ? 1 : 0) << variant;
  }
}

TEST(GltfMaterials, SpecularGlossinessUsesItsOwnFresnelAndDiffuse) {
  const char* materials[] = {
      R"({"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0.2, 0, 1],
          "specularFactor": [0.6, 0.3, 0.1], "glossinessFactor": 1}}})"};
  const core::Bytes glb =
      raw_glb(materials, 1, "", R"({"KHR_materials_variants": {"variants": []}})");
  core::SceneDescription scene = test_support::load(glb);
  const auto sky = test_support::constant_sky({1, 1, 1});
  const Rgb seen = test_support::shoot(scene, {.samples = 4096, .sky = sky}).mean();
  // At normal incidence: specular + diffuse * (1 - max(specular)); the coupling of the base by
  // albedos changes the second term by a few percent.
  const double diffuse[3] = {0.5, 0.2, 0};
  const double specular[3] = {0.6, 0.3, 0.1};
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(static_cast<double>(seen[c]), specular[c] + diffuse[c] * 0.4, 0.03) << c;
  }
}

}  // namespace
