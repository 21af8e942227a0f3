// Waves against one path at a time over the product of features, drawn at random: each setting has
// a sky, lights, materials with and without textures, panes in front of them, a camera, a filter
// and options of its own. Both use the same random numbers, so pictures differ only where rounding
// sends a path elsewhere. A failure prints the seed and what was drawn.
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/lights/ies_profile.h"
#include "core/lights/made_environment.h"
#include "core/math/numbers.h"
#include "core/scene/ground.h"
#include "core/settings/choices.h"
#include "core/settings/light_shares.h"
#include "core/wave/wave_tracer.h"
#include "tests/support/differing_pixels.h"
#include "tests/support/scenes.h"
#include "tests/unit/core/random_materials.h"

namespace {

using core::MaterialDescription;
using core::Rgb;
using core::Vec3;
using test_support::Draw;
using test_support::Drawn;
using test_support::kFilm;
using test_support::kGlass;
using test_support::Kind;
using test_support::kKinds;
using test_support::kWalls;

constexpr int kSettings = 200;
constexpr int kOneKindSettings = 60;
constexpr int kSide = 8;
constexpr int kSamples = 4;
/// Settings with a larger film, whose paths fill waves; of those with a catcher, which needs room
/// there.
constexpr int kFullWaves = 8;
/// Of a picture: rounding sends one path in ten thousand elsewhere, more of long ones through
/// glass.
constexpr std::size_t kPixelsMost = 8;

/// What is drawn, with one fault if asked: the planted ones that a comparison must see.
enum class Fault {
  kNone,
  kNoSun,
  kRougher,
  kThinnerLayers,
  kDenserGlass,
  kClearerGlass,
  kThickerLeaves,
  kRounderBrush,
  kThickerFilms,
  kOtherTexels,
  kTiltedNormals,
  kOneBounceLess,
  kDimLights,
  kDimProfiles,
  kOtherLens,
  kOtherShadows,
  kOneCandidateMore,
  kOtherMotion,
  kThickerFog,
  kOtherPhase,
  kNoSpectrum
};

/// Noise in bytes or floats.
int add_image(core::SceneDescription& scene, Draw& draw) {
  core::Image image;
  image.width = 32;
  image.height = 8;
  image.channels = 4;
  image.type = draw.often(0.5F) ? core::PixelType::kU8 : core::PixelType::kF32;
  const bool is_byte = image.type == core::PixelType::kU8;
  image.bytes.resize(image.value_count() * (is_byte ? 1 : sizeof(float)));
  for (std::size_t i = 0; i < image.value_count(); ++i) {
    const float value = draw.between(0, 1);
    if (is_byte) {
      image.bytes[i] = static_cast<std::byte>(255 * value);
    } else {
      std::memcpy(&image.bytes[sizeof(float) * i], &value, sizeof(float));
    }
  }
  scene.images.push_back(std::make_shared<const core::Image>(std::move(image)));
  return static_cast<int>(scene.images.size()) - 1;
}

/// Lookups with the same coordinates, most of the time: lanes read only these together.
void add_textures(MaterialDescription& m, core::SceneDescription& scene, Draw& draw, Fault fault) {
  core::TextureDescription common;
  const auto turn = [&](core::TextureDescription& slot) {
    slot.uv_set = draw.below(2);
    slot.wrap_u = static_cast<core::TextureWrap>(draw.below(3));
    slot.wrap_v = static_cast<core::TextureWrap>(draw.below(3));
    const float size = draw.between(0.3F, 3);
    slot.uv_transform = {size, 0.3F, draw.between(-1, 1), -0.3F, size, draw.between(-1, 1)};
    if (fault == Fault::kOtherTexels) {
      slot.uv_transform[2] += 0.1F;
    }
  };
  turn(common);
  common.nearest = draw.often(0.1F);
  const auto fill = [&](core::TextureDescription& slot, float share) {
    if (!draw.often(share)) {
      return;
    }
    slot = common;
    if (draw.often(0.1F)) {
      turn(slot);
    }
    slot.image = add_image(scene, draw);
  };
  fill(m.base_color_texture, 0.8F);
  fill(m.metallic_roughness_texture, 0.5F);
  fill(m.normal_texture, 0.4F);
  m.normal_scale = draw.between(0.2F, 1) * (fault == Fault::kTiltedNormals ? 1.3F : 1.0F);
  fill(m.emissive_texture, is_black(m.emissive) ? 0 : 0.5F);
  fill(m.specular_texture, m.specular < 1 ? 0.3F : 0);
  fill(m.transmission_texture, m.transmission > 0 ? 0.3F : 0);
  fill(m.clearcoat_texture, m.clearcoat > 0 ? 0.3F : 0);
  fill(m.clearcoat_roughness_texture, m.clearcoat > 0 ? 0.3F : 0);
  fill(m.clearcoat_normal_texture, m.clearcoat > 0 ? 0.3F : 0);
  fill(m.sheen_color_texture, m.sheen_roughness > 0 ? 0.3F : 0);
  fill(m.sheen_roughness_texture, m.sheen_roughness > 0 ? 0.3F : 0);
  fill(m.anisotropy_texture, m.anisotropy > 0 ? 0.3F : 0);
  if (draw.drawn == Drawn::kFilms) {
    fill(m.iridescence_texture, m.iridescence > 0 ? 0.3F : 0);
    fill(m.iridescence_thickness_texture, m.iridescence > 0 ? 0.3F : 0);
  }
  if (draw.drawn == Drawn::kWalls) {
    fill(m.diffuse_transmission_texture, m.diffuse_transmission > 0 ? 0.3F : 0);
    fill(m.diffuse_transmission_color_texture, m.diffuse_transmission > 0 ? 0.3F : 0);
  }
}

/// is_closed: the surface may bound a solid.
int add_material(core::SceneDescription& scene, Draw& draw, bool is_closed, Fault fault) {
  const bool is_glass = draw.drawn == Drawn::kSolids && is_closed;
  const bool is_wall = draw.drawn == Drawn::kWalls && draw.often(0.7F);
  const bool has_film = draw.drawn == Drawn::kFilms && draw.often(0.7F);
  const Kind kind = is_glass   ? draw.one_of(kGlass)
                    : is_wall  ? draw.one_of(kWalls)
                    : has_film ? kFilm
                               : draw.one_of(kKinds);
  MaterialDescription m;
  m.base_color = draw.color();
  m.metallic = 0;
  m.roughness = draw.between(0.05F, 1);
  m.double_sided = draw.often(0.3F);
  kind.make(m, draw);
  const bool is_textured = draw.often(0.5F);
  if (is_textured) {
    add_textures(m, scene, draw, fault);
  }
  if (!is_closed) {
    m.thickness = 0;
  }
  if (fault == Fault::kRougher) {
    m.roughness = std::min(1.0F, m.roughness + 0.02F);
  }
  if (fault == Fault::kThinnerLayers) {
    m.clearcoat *= 0.9F;
    m.sheen_color = m.sheen_color * 0.9F;
  }
  if (fault == Fault::kDenserGlass && m.transmission > 0) {
    m.ior += 0.05F;
  }
  if (fault == Fault::kClearerGlass) {
    m.attenuation_distance *= 2;
  }
  if (fault == Fault::kRounderBrush) {
    m.anisotropy *= 0.8F;
  }
  if (fault == Fault::kThickerFilms) {
    m.iridescence_thickness_max_nm *= 1.1F;
  }
  if (fault == Fault::kThickerLeaves) {
    m.diffuse_transmission *= 0.9F;
  }
  draw.say(std::string(is_textured ? "textured " : "") + kind.name);
  scene.materials.push_back(m);
  return static_cast<int>(scene.materials.size()) - 1;
}

/// Adds the attributes that textures need, and sometimes colours.
core::PrimitiveDescription finished(core::PrimitiveDescription p, Draw& draw) {
  const float size = draw.often(0.2F) ? 30.0F : 3.0F;
  p.uv = {};
  for (const Vec3 at : p.positions) {
    p.uv[0].push_back({size * (at.x + at.z), size * at.y});
    p.uv[1].push_back({size * at.y, 0.7F * size * (at.x - at.z)});
    p.tangents.push_back({0.6F, 0, 0.8F, at.x < 0.5F ? 1.0F : -1.0F});
  }
  if (draw.often(0.15F)) {
    for (std::size_t i = 0; i < p.positions.size(); ++i) {
      const Rgb c = draw.color();
      p.colors.push_back({c.r, c.g, c.b, 1});
    }
  }
  return p;
}

core::Transform placed(Draw& draw) {
  const float angle = draw.between(0, core::kTwoPi);
  const float size = draw.between(0.7F, 1.2F);
  const float mirror = draw.often(0.3F) ? -1.0F : 1.0F;
  core::Transform out;
  out.x = Vec3{std::cos(angle), 0, -std::sin(angle)} * (size * mirror);
  out.y = {0, size, 0};
  out.z = Vec3{std::sin(angle), 0, std::cos(angle)} * size;
  return out;
}

/// Lets a shape move and turn while the shutter is open.
void move(core::PrimitiveDescription& shape, const core::Transform& to_world, Draw& draw,
          Fault fault) {
  const Vec3 way = Vec3{draw.between(-0.3F, 0.3F), draw.between(0, 0.2F), 0} *
                   (fault == Fault::kOtherMotion ? 1.2F : 1.0F);
  const int steps = draw.one_of(std::array{1, 3});
  for (int step = 1; step <= steps; ++step) {
    const float part = static_cast<float>(step * step) / static_cast<float>(steps * steps);
    const float c = std::cos(part);
    const float s = std::sin(part);
    const auto turned = [&](Vec3 v) { return Vec3{c * v.x + s * v.z, v.y, c * v.z - s * v.x}; };
    core::MovedVertices& then = shape.later.emplace_back();
    for (std::size_t i = 0; i < shape.positions.size(); ++i) {
      then.positions.push_back(turned(to_world.point(shape.positions[i]) - to_world.t) +
                               to_world.t + way * part);
    }
    for (const Vec3 n : shape.normals) {
      then.normals.push_back(turned(core::normalize_or(to_world.normal(n), {0, 0, 1})));
    }
  }
  draw.say("moving");
}

/// Balls on a floor, unless it is a catcher, before a wall, the right ones behind a pane. Some of
/// them move if the shutter is open.
void add_shapes(core::SceneDescription& scene, Draw& draw, Fault fault, bool has_floor,
                Draw* motion) {
  const auto add = [&](core::PrimitiveDescription shape, bool is_closed,
                       const core::Transform& to_world) {
    shape.material = add_material(scene, draw, is_closed, fault);
    core::PrimitiveDescription whole = finished(std::move(shape), draw);
    if (motion != nullptr && motion->often(0.5F)) {
      move(whole, to_world, *motion, fault);
    }
    scene.meshes.emplace_back();
    scene.meshes.back().primitives = {std::move(whole)};
    scene.instances.push_back({static_cast<int>(scene.meshes.size()) - 1, to_world});
  };
  if (has_floor) {
    add(test_support::quad({-2, 0, -1}, {0, 0, 3}, {4, 0, 0}, 0), false, {});
  }
  if (draw.often(0.5F)) {
    add(test_support::quad({-2, 0, -1}, {4, 0, 0}, {0, 2, 0}, 0), false, {});
  }
  for (const float x : {-0.8F, 0.0F, 0.8F}) {
    core::Transform at = placed(draw);
    at.t = {x, 0.4F, draw.between(-0.5F, 0.2F)};
    add(test_support::sphere({0, 0, 0}, 0.38F, 6, false, 0), true, at);
  }
  if (draw.often(0.7F)) {
    core::PrimitiveDescription pane =
        test_support::quad({0, 0.1F, 1}, {1.2F, 0, 0.1F}, {0, 1.2F, 0}, 0);
    draw.say("pane:");
    add(std::move(pane), false, {});
  }
}

/// A profile of random candela, in one of the three coordinate systems.
std::shared_ptr<const core::IesProfile> profile(Draw& draw, Fault fault) {
  core::IesProfile::Grid grid;
  grid.photometry = static_cast<core::Photometry>(1 + draw.below(3));
  grid.theta_rad = {0.2F, 0.7F, 1.6F, core::kPi};
  grid.phi_rad = {0, 1.5F, 4, core::kTwoPi};
  for (std::size_t phi = 0; phi < grid.phi_rad.size(); ++phi) {
    for (std::size_t theta = 0; theta < grid.theta_rad.size(); ++theta) {
      const bool repeats = phi + 1 == grid.phi_rad.size();
      grid.candela.push_back(repeats ? grid.candela[theta]
                                     : draw.between(0.2F, 2) *
                                           (fault == Fault::kDimProfiles ? 0.9F : 1.0F));
    }
  }
  return std::make_shared<const core::IesProfile>(std::move(grid));
}

/// more: leaves the other draws as they are.
void add_lights(core::SceneDescription& scene, Draw& draw, Draw& more, Fault fault) {
  const float scale = fault == Fault::kDimLights ? 0.98F : 1.0F;
  const auto add = [&](core::PrimitiveDescription shape, Rgb radiance) {
    shape.material = static_cast<int>(scene.materials.size());
    MaterialDescription m = test_support::emitter(radiance * scale);
    m.double_sided = draw.often(0.3F);
    if (draw.often(0.2F)) {
      m.emissive_texture.image = add_image(scene, draw);
    }
    scene.materials.push_back(m);
    scene.meshes.emplace_back();
    scene.meshes.back().primitives = {finished(std::move(shape), draw)};
    scene.instances.push_back({static_cast<int>(scene.meshes.size()) - 1, {}});
  };
  const int quads = draw.one_of(std::array{0, 0, 1, 2, 5});
  for (int i = 0; i < quads; ++i) {
    const Vec3 corner = {draw.between(-1.5F, 1), draw.between(1.6F, 2.2F), draw.between(-1, 1)};
    add(test_support::quad(corner, {0.5F, 0, 0}, {0, 0.1F, 0.4F}, 0), draw.color() * 10);
  }
  const bool has_ball = draw.often(0.2F);
  if (has_ball) {
    add(test_support::sphere({-1.4F, 1.3F, 0.5F}, 0.2F, 5, false, 0), draw.color() * 8);
  }
  const int lamps = draw.one_of(std::array{0, 0, 1, 3});
  for (int i = 0; i < lamps; ++i) {
    core::PunctualLightDescription lamp;
    lamp.type = static_cast<core::PunctualType>(draw.below(3));
    lamp.intensity = draw.color() * scale;
    lamp.range_m = draw.often(0.2F) ? 3.0F : 0.0F;
    lamp.inner_cone_rad = 0.4F;
    lamp.outer_cone_rad = 1.2F;
    // Tilted: a light in the plane of a wall is above or below it by rounding.
    lamp.to_world = {{1, 0, 0}, {0, 0.6F, -0.8F}, {0, 0.8F, 0.6F}, {draw.between(-1, 1), 2, 0.3F}};
    if (more.often(0.4F)) {
      lamp.type = core::PunctualType::kProfile;
      lamp.profile = static_cast<int>(scene.profiles.size());
      scene.profiles.push_back(profile(more, fault));
      more.say("profile");
    }
    scene.lights.push_back(lamp);
  }
  draw.say(std::to_string(quads) + " quads" + (has_ball ? ", a ball" : "") + " and " +
           std::to_string(lamps) + " lamps");
}

std::shared_ptr<const core::Environment> sky(Draw& draw, Fault fault) {
  core::EnvironmentSettings settings;
  settings.color = draw.color();
  settings.rotation_degrees = draw.between(0, 360);
  const int type = draw.below(5);
  draw.say(std::array{"no sky", "constant sky", "studio", "map",
                      "map with a sun"}[static_cast<std::size_t>(type)]);
  if (type == 0) {
    return nullptr;
  }
  if (type < 3) {
    if (type == 2) {
      settings.preset = static_cast<core::EnvironmentPreset>(draw.below(3));
    }
    return *core::make_environment(settings);
  }
  core::Image image;
  image.width = 16;
  image.height = 8;
  image.channels = 3;
  image.type = core::PixelType::kF32;
  image.bytes.resize(image.value_count() * sizeof(float));
  for (std::size_t i = 0; i < image.value_count(); ++i) {
    const float value = draw.between(0, 1) + (draw.often(0.02F) ? 30.0F : 0.0F);
    std::memcpy(&image.bytes[sizeof(float) * i], &value, sizeof(float));
  }
  core::SunDisc sun;
  sun.direction = core::normalize({draw.between(-1, 1), draw.between(0, 0.7F), -1});
  sun.radiance = draw.color() * 40;
  sun.angular_radius_rad = draw.between(0.05F, 0.3F);
  const bool has_sun = type == 4 && fault != Fault::kNoSun;
  return *core::Environment::create(&image, settings, has_sun ? &sun : nullptr);
}

/// more: leaves the other draws as they are.
void set_camera(core::View& view, Draw& draw, Draw& more, Fault fault) {
  const bool looks_up = draw.often(0.3F);
  view.camera.position = Vec3{draw.between(-0.7F, 0.7F), draw.between(0.6F, 1.5F), 2.8F};
  view.camera.target = looks_up ? Vec3{0, 1.6F, 0} : Vec3{0.1F, 0.5F, 0};
  const float fov_degrees = draw.between(25, 60);
  const int type = draw.below(6);
  if (type == 0) {
    view.camera.type = core::CameraType::kOrthographic;
  } else if (type == 1) {
    view.camera.type = core::CameraType::kPanorama;
  } else if (type == 5) {  // the lens's axis is left of the centre
    view.camera.type = core::CameraType::kPinhole;
    view.camera.fx_px = kSide / (2 * std::tan(fov_degrees * (core::kPi / 360)));
    view.camera.cx_px = 0.3 * kSide;
    if (more.often(0.5F)) {
      const double k1 = fault == Fault::kOtherLens ? 0.1 : -0.05;
      view.camera.distortion = {core::DistortionModel::kFisheye, {k1, 0.01, -0.002, 0.001}};
      more.say("fisheye");
    } else if (fov_degrees > 40) {
      view.camera.distortion = {core::DistortionModel::kOpencv, {-0.05, 0.01, 0.002, -0.001}};
    }
  } else {
    view.camera.vertical_fov_degrees = fov_degrees;
    if (type == 2) {
      view.camera.aperture_radius_m = 0.1F;
      view.camera.focus_distance_m = 2;
    }
  }
  draw.say(std::array{"orthographic", "panorama", "lens", "perspective", "perspective",
                      "calibrated"}[static_cast<std::size_t>(type)]);
}

void set_options(core::RenderSettings& s, Draw& draw, Fault fault) {
  s.film.filter = {static_cast<core::FilterType>(draw.below(5)), draw.between(0.5F, 2)};
  s.film.albedo = s.film.normal = s.film.depth = true;
  s.max_depth = draw.one_of(std::array{1, 2, 3, 5, 8});
  draw.say("depth " + std::to_string(s.max_depth));
  if (fault == Fault::kOneBounceLess) {
    --s.max_depth;
  }
  if (draw.often(0.4F)) {
    s.estimator.splitting = core::SplittingType::kFixed;
    s.estimator.split_count = draw.one_of(std::array{2, 3, 4});
    draw.say("split " + std::to_string(s.estimator.split_count));
  }
  if (draw.often(0.3F)) {
    s.sampler = draw.one_of(std::array{core::SamplerType::kIndependent, core::SamplerType::kHalton,
                                       core::SamplerType::kZsobol});
  }
  if (draw.often(0.4F)) {
    s.light_sampler =
        draw.one_of(std::array{core::LightSamplerType::kPower, core::LightSamplerType::kUniform,
                               core::LightSamplerType::kRis, core::LightSamplerType::kRis});
  }
  s.light_candidates = 1 + draw.below(4);
  if (s.light_sampler == core::LightSamplerType::kRis) {
    draw.say("ris " + std::to_string(s.light_candidates));
    s.light_candidates += fault == Fault::kOneCandidateMore ? 1 : 0;
  }
  if (draw.often(0.3F)) {
    s.background.type = static_cast<core::BackgroundType>(1 + draw.below(3));
    s.background.color = draw.color();
    s.background.through_glass = draw.often(0.5F);
    draw.say("backdrop");
  }
  if (s.ground.type == core::GroundType::kNone && draw.often(0.3F)) {
    for (const char* layer : {"bounce:0", "bounce:1", "bounce:2-", "light:environment"}) {
      s.film.shares.push_back(*core::light_share(layer));
    }
    draw.say("shares");
  }
}

/// Fog, or wavelengths in place of colours.
void set_spectrum_or_fog(core::RenderSettings& s, Draw& draw, Fault fault) {
  if (s.ground.type != core::GroundType::kNone) {
    return;
  }
  if (draw.often(0.3F) && s.light_sampler != core::LightSamplerType::kRis) {
    core::FogSettings& fog = s.fog.emplace();
    fog.scattering = draw.color() * draw.between(0, 0.6F);
    fog.absorption = draw.often(0.5F) ? Rgb{} : draw.color() * 0.2F;
    fog.g = draw.often(0.3F) ? 0 : draw.between(-0.8F, 0.8F);
    draw.say("fog");
    fog.scattering = fog.scattering * (fault == Fault::kThickerFog ? 1.1F : 1.0F);
    fog.g += fault == Fault::kOtherPhase ? 0.1F : 0.0F;
  } else if (draw.often(0.2F)) {
    s.spectral = fault != Fault::kNoSpectrum;
    draw.say("spectral");
  }
}

/// A catcher in place of the floor, most of the time without options that its lanes do not have.
core::GroundSettings ground(Draw& draw, Fault fault) {
  core::GroundSettings out = {core::GroundType::kCatcher, 0.0F, draw.color(), 0, {}};
  core::ShadowSettings& shadow = out.shadow;
  shadow.color = draw.often(0.5F) ? core::ShadowColor::kNeutral : core::ShadowColor::kPhysical;
  shadow.strength = draw.between(0.3F, 1);
  out.reflection = draw.often(0.2F) ? 0.7F : 0.0F;
  shadow.softness = draw.often(0.2F) ? 0.3F : 0.0F;
  if (fault == Fault::kOtherShadows) {
    shadow.strength *= 0.9F;
  }
  draw.say("catcher");
  return out;
}

struct Setting {
  std::string words;
  core::View view;
};

Setting setting(std::uint64_t seed, Fault fault = Fault::kNone, Drawn drawn = Drawn::kAll) {
  Draw draw(seed);
  draw.drawn = drawn;
  core::SceneDescription scene;
  const bool is_caught = draw.often(0.3F) && drawn == Drawn::kAll;
  const core::GroundSettings below = is_caught ? ground(draw, fault) : core::GroundSettings{};
  Draw more(~seed);  // leaves the other draws as they are
  Draw still_more(~seed / 2);
  const bool is_open = more.often(0.25F);
  add_shapes(scene, draw, fault, !is_caught, is_open ? &more : nullptr);
  add_lights(scene, draw, still_more, fault);
  auto environment = sky(draw, fault);
  core::add_ground(scene, below);
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  view.environment = std::move(environment);
  set_camera(view, draw, still_more, fault);
  view.settings.ground = below;
  view.settings.shutter_seconds = is_open ? 1 : 0;
  set_options(view.settings, draw, fault);
  set_spectrum_or_fog(view.settings, more, fault);
  view.settings.film.errors_over_white =
      core::has_catcher(view.settings) && core::is_transparent(view.settings);
  view.settings.seed = seed;
  draw.say(more.words());
  draw.say(still_more.words());
  return {draw.words(), std::move(view)};
}

struct Planted {
  const char* name;
  Fault fault;
  int least;
};

/// The first seed; --gtest_random_seed draws other settings.
std::uint64_t first_seed() {
  return static_cast<std::uint64_t>(GTEST_FLAG_GET(random_seed)) * kSettings;
}
/// Tests whether lanes serve the setting; others test nothing here.
bool is_served(const core::View& view) {
  return core::make_wave_tracer({view.scene->data(), view.environment.get(), view.settings}) !=
         nullptr;
}

TEST(WaveProduct, RandomSettingsLookAsOnePathAtATime) {
  constexpr std::size_t kPixels = std::size_t{kSide} * kSide;
  std::size_t count = 0;
  std::size_t times = 0;  // the pixels of a small film
  int full = 0;
  for (std::uint64_t seed = first_seed(); seed < first_seed() + kSettings; ++seed) {
    Setting one = setting(seed);
    std::size_t larger = 1;
    if (core::has_catcher(one.view.settings) && full < kFullWaves) {
      ++full;
      larger = 9;
      one.view.settings.film.width = one.view.settings.film.height = 3 * kSide;
    }
    times += larger;
    EXPECT_TRUE(is_served(one.view)) << "seed " << seed << ": " << one.words;
    const std::size_t differing =
        test_support::differing_pixels(one.view, seed % 8 == 0 ? 1 : 8, one.view, kSamples, 1);
    EXPECT_LE(differing, kPixelsMost * larger) << "seed " << seed << ": " << one.words;
    count += differing;
  }
  EXPECT_EQ(full, kFullWaves);
  EXPECT_LE(count, times * kPixels / 800);
}

// The catcher's coat mirrors: what it adds and takes is not scaled by the shadow's strength.
TEST(WaveProduct, CatchersThatReflectLookAsOnePathAtATime) {
  int count = 0;
  for (std::uint64_t seed = first_seed(); count < 8; ++seed) {
    Setting one = setting(seed);
    if (core::has_catcher(one.view.settings) && one.view.settings.ground.reflection > 0) {
      ++count;
      one.view.settings.film.width = one.view.settings.film.height = 3 * kSide;
      EXPECT_LE(test_support::differing_pixels(one.view, 8, one.view, kSamples, 1), kPixelsMost)
          << "seed " << seed << ": " << one.words;
    }
  }
}

/// Compares settings of one kind.
void expect_as_one_path_at_a_time(Drawn drawn) {
  constexpr std::size_t kPixels = std::size_t{kSide} * kSide;
  std::size_t count = 0;
  for (std::uint64_t seed = first_seed(); seed < first_seed() + kOneKindSettings; ++seed) {
    const Setting one = setting(seed, Fault::kNone, drawn);
    EXPECT_TRUE(is_served(one.view)) << "seed " << seed << ": " << one.words;
    const std::size_t differing =
        test_support::differing_pixels(one.view, seed % 8 == 0 ? 1 : 8, one.view, kSamples, 1);
    EXPECT_LE(differing, kPixelsMost) << "seed " << seed << ": " << one.words;
    count += differing;
  }
  EXPECT_LE(count, kOneKindSettings * kPixels / 800);
}

void expect_fault_is_seen(const Planted& planted, Drawn drawn) {
  int seen = 0;
  const std::uint64_t end = first_seed() + 24;
  for (std::uint64_t seed = first_seed(); seed < end && seen < planted.least; ++seed) {
    const core::View faulty = setting(seed, planted.fault, drawn).view;
    const core::View right = setting(seed, Fault::kNone, drawn).view;
    const std::size_t differing = test_support::differing_pixels(faulty, 8, right, kSamples, 1);
    seen += differing > kPixelsMost ? 1 : 0;
  }
  EXPECT_GE(seen, planted.least) << planted.name;
}

TEST(WaveProduct, SolidsOfGlassLookAsOnePathAtATime) {
  expect_as_one_path_at_a_time(Drawn::kSolids);
}

TEST(WaveProduct, WallsAndLeavesLookAsOnePathAtATime) {
  expect_as_one_path_at_a_time(Drawn::kWalls);
}

TEST(WaveProduct, FilmsLookAsOnePathAtATime) { expect_as_one_path_at_a_time(Drawn::kFilms); }

TEST(WaveProduct, SeesPlantedFaultsOfGlassLeavesAndFilms) {
  expect_fault_is_seen({"thicker films", Fault::kThickerFilms, 8}, Drawn::kFilms);
  expect_fault_is_seen({"denser glass", Fault::kDenserGlass, 4}, Drawn::kSolids);
  expect_fault_is_seen({"clearer glass", Fault::kClearerGlass, 1}, Drawn::kSolids);
  expect_fault_is_seen({"denser walls", Fault::kDenserGlass, 4}, Drawn::kWalls);
  expect_fault_is_seen({"thicker leaves", Fault::kThickerLeaves, 4}, Drawn::kWalls);
}

/// A catcher under a clear ball, in front of a grey one that is seen through it.
core::View ball_before_another(int split_count) {
  core::SceneDescription scene;
  scene.materials = {test_support::lambert({0.8F, 0.8F, 0.8F}), {}};
  MaterialDescription& glass = scene.materials[1];
  glass.transmission = 1;
  glass.thickness = 1;
  glass.roughness = 0;
  scene.meshes.resize(2);
  scene.meshes[0].primitives = {test_support::sphere({0, 0.5F, -1}, 0.5F, 12, false, 0)};
  scene.meshes[1].primitives = {test_support::sphere({0, 0.4F, 0.3F}, 0.4F, 24, false, 1)};
  scene.instances = {{0, {}}, {1, {}}};
  core::GroundSettings below;
  below.type = core::GroundType::kCatcher;
  core::add_ground(scene, below);
  core::View view = test_support::view_of(std::move(scene), 3 * kSide, kSide);
  view.environment = *core::make_environment({});
  view.camera.position = {0, 0.5F, 2.5F};
  view.camera.target = {0, 0.4F, 0};
  view.settings.max_depth = 8;
  view.settings.ground = below;
  view.settings.background.type = core::BackgroundType::kTransparent;
  view.settings.background.through_glass = true;
  view.settings.film.errors_over_white = true;
  view.settings.estimator.splitting = core::SplittingType::kFixed;
  view.settings.estimator.split_count = split_count;
  return view;
}

// Paths go through the clear ball unsplit, and reflections off it return to the lanes. 64 is the
// largest count: one sample takes an eighth of a wave.
TEST(WaveProduct, CatchersSplitOnlyWhatIsNotSeenThroughGlass) {
  for (const int count : {2, 8, 40, 64}) {
    const core::View view = ball_before_another(count);
    EXPECT_TRUE(is_served(view));
    EXPECT_LE(test_support::differing_pixels(view, 8, view, 2, 1), std::size_t{3}) << count;
  }
}

// The planted faults, each in one of the two only; `least` of 24 settings notice it.
TEST(WaveProduct, SeesPlantedFaults) {
  for (const auto& [name, fault, least] :
       {Planted{"no sun", Fault::kNoSun, 1}, Planted{"rougher", Fault::kRougher, 8},
        Planted{"thinner layers", Fault::kThinnerLayers, 3},
        Planted{"rounder brush", Fault::kRounderBrush, 1},
        Planted{"other texels", Fault::kOtherTexels, 4},
        Planted{"tilted normals", Fault::kTiltedNormals, 3},
        Planted{"one bounce less", Fault::kOneBounceLess, 3},
        Planted{"dim lights", Fault::kDimLights, 4},
        Planted{"dim profiles", Fault::kDimProfiles, 1},
        Planted{"other lens", Fault::kOtherLens, 1},
        Planted{"other shadows", Fault::kOtherShadows, 1},
        Planted{"one candidate more", Fault::kOneCandidateMore, 1},
        Planted{"other motion", Fault::kOtherMotion, 2},
        Planted{"thicker fog", Fault::kThickerFog, 2},
        Planted{"other phase", Fault::kOtherPhase, 2},
        Planted{"no spectrum", Fault::kNoSpectrum, 2}}) {
    expect_fault_is_seen({name, fault, least}, Drawn::kAll);
  }
}

}  // namespace
