// Weights of bidirectional path tracing: for a given path, those of all strategies add up to 1,
// also with the strategies that merge subpaths at the vertices on surfaces. Paths have random
// vertices on a glossy floor, and in fog whose extinction differs by channel and by height or on
// rough glass; subpaths and weights are the renderer's.
#include "core/integrators/bidirectional/bdpt_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/math/offset_ray.h"
#include "core/transport/intersect.h"
#include "core/transport/surface_event.h"
#include "core/transport/visibility.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::PartialSums;
using core::Rgb;
using core::Subpath;
using core::TransportMode;
using core::Vec3;
using core::Vertex;
using test_support::Random;

/// kAll: all three, so that the probability of picking a light matters, over a floor behind rough
/// glass, without fog.
enum class Lamp { kPanel, kPoint, kSky, kAll };
/// kNoLightProbability: light samples as if there were one light; kReverse: densities of the way
/// back are 2% too large.
/// kMergedTwice: connections do not know of the strategies that merge. kOtherDisk: those of the
/// light subpath believe in a smaller disk. kUnaimed: light subpaths believe in lights that are not
/// aimed.
enum class Fault {
  kNone,
  kNoFlightBack,
  kNoExtinction,
  kNoLightProbability,
  kReverse,
  kMergedTwice,
  kOtherDisk,
  kUnaimed
};

/// The point, which is also in the panel.
constexpr Vec3 kLamp = {0.3F, 2, 0.2F};

std::shared_ptr<const core::Scene> scene_with(Lamp lamp) {
  core::MaterialDescription floor;
  floor.metallic = 0;
  floor.roughness = 0.5F;
  core::SceneDescription scene =
      test_support::scene_of({floor, test_support::emitter(Rgb(3))},
                             {test_support::quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0)});
  if (lamp == Lamp::kPanel || lamp == Lamp::kAll) {
    const float z = lamp == Lamp::kAll ? -3 : -0.5F;  // out of the camera's sight of the glass
    scene.meshes[0].primitives.push_back(
        test_support::quad({-0.5F, 2, z}, {1, 0, 0}, {0, 0, 1}, 1));
  }
  if (lamp == Lamp::kPoint || lamp == Lamp::kAll) {
    core::PunctualLightDescription point;
    point.to_world = core::translation(kLamp);
    scene.lights.push_back(point);
  }
  if (lamp == Lamp::kAll) {
    core::MaterialDescription glass = floor;
    glass.transmission = 1;
    glass.thickness = 1;
    scene.materials.push_back(glass);
    scene.meshes[0].primitives.push_back(test_support::quad({-4, 1, 4}, {8, 0, 0}, {0, 0, -8}, 2));
  }
  return test_support::build(std::move(scene));
}

/// is_sharp: fog scatters so narrowly that light merges after it.
core::RenderSettings settings_with(Lamp lamp, bool is_sharp, const char* integrator) {
  core::RenderSettings settings = core::default_settings(integrator);
  settings.film.width = settings.film.height = 16;
  if (lamp == Lamp::kAll) {
    return settings;
  }
  settings.fog = {.scattering = {0.2F, 0.6F, 1.5F},
                  .absorption = {0.1F, 0, 0.3F},
                  .g = is_sharp ? 0.9F : 0.4F,
                  .height_falloff = 0.7F};
  return settings;
}

core::Camera camera_of(bool is_orthographic) {
  core::CameraDescription file;
  file.orthographic = is_orthographic;
  file.y_magnification = 3;
  const float h = std::sqrt(0.5F);
  file.to_world = {{1, 0, 0}, {0, h, -h}, {0, h, h}, {0, 4, 4}};  // looks down at 45 degrees
  return *core::Camera::create({}, {file}, {}, 16, 16);
}

struct Target {
  Vec3 at;
  bool is_on_surface = false;
};

/// One path and the input of its subpaths.
class Paths {
 public:
  /// merged: PartialSums::merged; 0: none.
  Paths(Lamp lamp, bool is_orthographic, Fault fault, double merged = 0,
        const char* integrator = "bdpt")
      : fault_(fault),
        merged_(merged),
        scene_(scene_with(lamp)),
        sky_(lamp == Lamp::kSky || lamp == Lamp::kAll ? test_support::constant_sky({1, 2, 3})
                                                      : nullptr),
        settings_(settings_with(lamp, merged > 0, integrator)),
        fog_(settings_.fog.value_or(core::FogSettings{}), data().center, data().radius_m),
        camera_(camera_of(is_orthographic)),
        lights_(data(), sky_.get(), core::LightPick::kTree),
        emission_(data(), sky_.get()),
        weights_({data(), sky_.get(), settings_, &camera_}, lights_, emission_) {}

  /// Aims the lights at balls, one in the other, and at the first light.
  void aim() {
    std::vector<float> lights(emission_.size());
    lights[0] = 1;
    emission_.aim({{{0.2F, 0.5F, 0.1F}, 1.5F, 0.3F}, {{0, 0.1F, 0}, 0.5F, 0.4F}}, lights);
  }

  /// targets: from the camera to the light. Empty if the light cannot take this way.
  std::optional<double> sum_of_weights(const std::vector<Target>& targets, Random& random) {
    targets_ = targets;
    is_possible_ = true;
    camera_side_.clear();
    light_side_.clear();
    sharp_.clear();
    start_ = emission_.sample(random.uniform(), random.uniform_2d(), random.uniform_2d());
    if (data().has_volumes && lamp() == Lamp::kSky && start_.ray.direction.y > 0) {
      return {};  // from below the glass
    }
    Subpath from_camera = camera_subpath();
    if (is_possible_) {
      light_subpath();
    }
    if (!is_possible_) {
      return {};
    }
    double sum = found(from_camera) + light_sample();
    if (weights_.connects()) {
      const auto to = camera_.sample_wi(light_side_.back().origin(), {0.5F, 0.5F});
      const Vertex& last = light_side_.back();
      sum += weights_.splat(last, to, last.evaluate(to.wi_world, TransportMode::kImportance),
                            flight_depth(last.origin(), to.wi_world, to.distance_m));
    }
    auto from_light = light_side_.rbegin();
    for (const Vertex& vertex : camera_side_) {
      sum += merging(vertex, *from_light);
      if (++from_light == light_side_.rend()) {
        break;
      }
      if (!weights_.connects()) {
        continue;
      }
      const Vec3 d = from_light->origin() - vertex.origin();
      const Vec3 wi = normalize(d);
      sum += weights_.connection(vertex, *from_light, wi,
                                 vertex.evaluate(wi, TransportMode::kRadiance),
                                 from_light->evaluate(-wi, TransportMode::kImportance),
                                 flight_depth(vertex.origin(), wi, length(d)));
    }
    return is_possible_ ? std::optional(sum) : std::nullopt;
  }

 private:
  /// Returns whether light arrives sharply at a vertex of the light subpath.
  bool merges(const Vertex& at) const { return sharp_.contains(&at) && at.can_merge(); }
  double merging(const Vertex& from_camera, const Vertex& from_light) const {
    if (!(merged_ > 0) || !merges(from_light)) {
      return 0;
    }
    PartialSums sums = from_camera.sums;
    sums.merged = merged_;
    return weights_.merging(sums, from_light.sums,
                            from_camera.evaluate(from_light.wo_world(), TransportMode::kRadiance));
  }
  const core::SceneData& data() const { return scene_->data(); }
  /// The light at which the path starts.
  Lamp lamp() const {
    const std::size_t triangles = data().triangle_lights.size();
    return start_.light < triangles                                   ? Lamp::kPanel
           : start_.light < triangles + data().punctual_lights.size() ? Lamp::kPoint
                                                                      : Lamp::kSky;
  }
  Rgb flight_depth(Vec3 from, Vec3 direction, float distance_m) const {
    return !settings_.fog ? Rgb{} : fog_.medium().sigma_t * fog_.depth(from, direction, distance_m);
  }
  /// Direction from a point of the scene to the light.
  Vec3 to_light(Vec3 from) const {
    return lamp() == Lamp::kSky ? -start_.ray.direction : normalize(start_.ray.origin - from);
  }
  float distance_to_light(Vec3 from) const {
    return lamp() == Lamp::kSky ? core::kFar : length(start_.ray.origin - from);
  }

  Subpath subpath() {
    Subpath path{core::start_path(sampler_, rays_)};
    path.merged = fault_ == Fault::kMergedTwice ? 0 : merged_;
    path.fog = settings_.fog ? &fog_ : nullptr;
    return path;
  }
  /// Makes the vertex at the end of the path's ray.
  Vertex& reach(std::list<Vertex>& vertices, Subpath& path, const Target& target) {
    const float distance_m = length(target.at - path.ray.origin);
    path.flight_depth = flight_depth(path.ray.origin, path.ray.direction, distance_m);
    if (!target.is_on_surface) {
      return vertices.emplace_back(
          path, core::MediumSample{.scatterer = &fog_.medium(), .distance_m = distance_m});
    }
    core::PathVertex met;
    EXPECT_TRUE(core::intersect(data(), path, met));
    is_possible_ &= length(met.point.position - target.at) < 1e-3F;  // nothing is in between
    core::surface_event(data(), path, met);
    return vertices.emplace_back(data(), path, met);
  }
  void leave(Subpath& path, const Vertex& vertex, Vec3 direction, TransportMode mode) {
    core::ScatterEval f = vertex.evaluate(direction, mode);
    is_possible_ &= f.pdf_solid_angle > 0 && f.pdf_reverse > 0;
    f.pdf_reverse *= fault_ == Fault::kReverse ? 1.02F : 1.0F;
    path.sums = weights_.after_scattering(
        vertex.sums, static_cast<double>(vertex.cosine(direction)),
        static_cast<double>(f.pdf_solid_angle), static_cast<double>(f.pdf_reverse), mode);
    path.last = {f.pdf_solid_angle, vertex.origin(), vertex.light_normal(), 1};
    path.last_extinction = fault_ == Fault::kNoFlightBack && mode == TransportMode::kImportance
                               ? Rgb(1)
                               : vertex.extinction;
    path.ray.origin = vertex.origin();
    if (vertex.medium == nullptr) {
      const core::PathVertex& at = vertex.surface;
      const bool through = dot(direction, at.shading.horizon) < 0;
      path.ray.origin = core::offset_ray(
          vertex.origin(), through ? -at.shading.horizon : at.shading.horizon, at.point.error_m);
      if (through && at.face.solid != nullptr) {
        path.media = at.beyond;
      }
    }
    path.ray.direction = direction;
    ++path.depth;
    path.medium_scatterings += vertex.medium != nullptr ? 1 : 0;
  }

  Subpath camera_subpath() {
    Subpath path = subpath();
    const auto seen = camera_.sample_wi(targets_.front().at, {0.5F, 0.5F});
    path.ray.origin = path.last.origin = seen.origin;
    path.ray.direction = -seen.wi_world;
    path.sums = weights_.from_camera(path.ray);
    for (std::size_t i = 0; i < targets_.size() && is_possible_; ++i) {
      Vertex& vertex = reach(camera_side_, path, targets_[i]);
      vertex.sums = weights_.at_camera_vertex(path, vertex);
      leave(path, vertex,
            i + 1 < targets_.size() ? normalize(targets_[i + 1].at - vertex.origin())
                                    : to_light(vertex.origin()),
            TransportMode::kRadiance);
    }
    return path;
  }
  void light_subpath() {
    Subpath path = subpath();
    path.merged *= fault_ == Fault::kOtherDisk ? 0.5 : 1.0;
    const Vec3 first = targets_.back().at;
    core::EmissionSample light = start_;
    if (lamp() == Lamp::kSky) {
      light.ray.origin = first - light.ray.direction * (3 * data().radius_m);
    }
    path.ray.origin = path.last.origin = light.ray.origin;
    path.ray.direction = -to_light(first);
    const core::EmissionSampler unaimed(data(), sky_.get());
    light.pdf = (fault_ == Fault::kUnaimed ? unaimed : emission_)
                    .pdf(light.light, path.ray.origin, path.ray.direction);
    bool is_ended = false;
    for (std::size_t i = targets_.size(); is_possible_ && i-- > 0;) {
      Vertex& vertex = reach(light_side_, path, targets_[i]);
      if (fault_ == Fault::kNoExtinction) {
        vertex.extinction = Rgb(1);
      }
      vertex.sums = weights_.at_light_vertex(path, light, vertex);
      if (path.arrives_sharply() && !is_ended) {
        sharp_.insert(&vertex);
      }
      // Without connections, light subpaths end where they have not scattered sharply.
      is_ended |= !weights_.connects() && path.bounces() > 0 && !path.arrives_sharply();
      if (i > 0) {
        leave(path, vertex, normalize(targets_[i - 1].at - vertex.origin()),
              TransportMode::kImportance);
      }
    }
  }

  /// s = 0.
  double found(Subpath& path) {
    if (lamp() == Lamp::kPoint) {
      return 0;
    }
    if (lamp() == Lamp::kSky) {
      path.flight_depth = flight_depth(path.ray.origin, path.ray.direction, core::kFar);
      return weights_.background(path);
    }
    std::list<Vertex> end;
    Vertex& vertex = reach(end, path, {start_.ray.origin, true});
    vertex.sums = weights_.at_camera_vertex(path, vertex);
    EXPECT_EQ(vertex.surface.point.light, start_.light);
    return weights_.emission(path, vertex);
  }
  /// s = 1.
  double light_sample() const {
    const Vertex& vertex = camera_side_.back();
    const Vec3 from = vertex.origin();
    core::LightSample light;
    light.wi_world = to_light(from);
    light.target = start_.ray.origin;
    light.light = start_.light;
    light.is_far = lamp() == Lamp::kSky;
    light.is_delta = lamp() == Lamp::kPoint;
    const Vec3 n = vertex.light_normal();
    if (lamp() == Lamp::kPoint) {
      light.pdf_solid_angle = lights_.prob_light(light.light, from, n);
    } else if (lamp() == Lamp::kSky) {
      light.pdf_solid_angle = lights_.pdf_environment(light.wi_world, from, n);
    } else {
      light.triangle = light.light;
      light.pdf_solid_angle =
          lights_.pdf_triangle(light.light, from, n, length(start_.ray.origin - from),
                               std::fabs(dot(start_.normal, light.wi_world)));
    }
    if (fault_ == Fault::kNoLightProbability) {
      light.pdf_solid_angle /= lights_.prob_light(light.light, from, n);
    }
    return weights_.light_sample(vertex, light,
                                 vertex.evaluate(light.wi_world, TransportMode::kRadiance),
                                 flight_depth(from, light.wi_world, distance_to_light(from)));
  }

  Fault fault_;
  double merged_;
  bool is_possible_ = true;
  std::shared_ptr<const core::Scene> scene_;
  std::shared_ptr<const core::Environment> sky_;
  core::RenderSettings settings_;
  core::Fog fog_;
  core::Camera camera_;
  core::LightSampler lights_;
  core::EmissionSampler emission_;
  core::BdptWeights weights_;
  core::PathSampler sampler_{core::SamplerType::kIndependent, 2, 1, 0};
  std::uint64_t rays_ = 0;
  std::vector<Target> targets_;
  core::EmissionSample start_;
  std::list<Vertex> camera_side_;
  std::list<Vertex> light_side_;
  std::set<const Vertex*> sharp_;
};

/// The largest distance from 1 of the sums of many paths with vertices of these kinds: 'f' in fog,
/// 's' on the floor, 'g' on the glass, '-' in fog, just above the line between its neighbours, '^'
/// likewise between the one before and the lamp.
double worst(Paths& paths, const std::string& kinds) {
  Random random(7);
  double most = 0;
  int possible = 0;
  for (int i = 0; i < 200; ++i) {
    std::vector<Target> targets;
    for (const char kind : kinds) {
      const float x = 2 * random.uniform() - 1;
      const float z = 2 * random.uniform() - 1;
      const float y = kind == 's' ? 0 : kind == 'g' ? 1 : 0.2F + 1.5F * random.uniform();
      targets.push_back({{x, y, z}, kind == 's' || kind == 'g'});
    }
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      if (kinds[k] == '^') {
        targets[k].at = (targets[k - 1].at + kLamp) * 0.5F;
        targets[k].at.y += 0.02F + 0.1F * random.uniform();
      }
    }
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      if (kinds[k] == '-') {
        targets[k].at = (targets[k - 1].at + targets[k + 1].at) * 0.5F;
        targets[k].at.y += 0.02F + 0.1F * random.uniform();
      }
    }
    if (const auto sum = paths.sum_of_weights(targets, random)) {
      most = std::max(most, std::fabs(*sum - 1));
      ++possible;
    }
  }
  EXPECT_GE(possible, 20) << kinds;
  return most;
}

constexpr std::array kKinds = {"s", "f", "ff", "sf", "fs", "fsf", "sfs", "fffff", "sffsf"};
/// Densities are products of floats, at vertices that offset_ray() moves off the path by rounding
/// errors.
constexpr double kRounding = 1e-3;

TEST(BdptWeights, AddUpToOneOverTheStrategiesOfAPath) {
  for (const Lamp lamp : {Lamp::kPanel, Lamp::kPoint, Lamp::kSky}) {
    for (const bool is_orthographic : {false, true}) {
      Paths paths(lamp, is_orthographic, Fault::kNone);
      for (const char* kinds : kKinds) {
        EXPECT_LT(worst(paths, kinds), kRounding)
            << kinds << ", lamp " << static_cast<int>(lamp) << ", " << is_orthographic;
      }
    }
  }
}

constexpr std::array kGlassKinds = {"g", "gsg", "gsgsg"};

TEST(BdptWeights, AddUpToOneUnderManyKindsOfLightsThroughGlass) {
  for (const bool is_orthographic : {false, true}) {
    Paths paths(Lamp::kAll, is_orthographic, Fault::kNone);
    for (const char* kinds : kGlassKinds) {
      EXPECT_LT(worst(paths, kinds), kRounding) << kinds << ", " << is_orthographic;
    }
  }
}

/// Squares of the light paths in a disk, for a density of 1 per area: one to a thousand.
constexpr std::array kMerged = {1.0, 1e3, 1e6};

constexpr std::array kMergingKinds = {"s-s", "s-s-s", "fs-sf", "s-sfs-s"};

TEST(BdptWeights, AddUpToOneWithMerging) {
  for (const double merged : kMerged) {
    for (const Lamp lamp : {Lamp::kPanel, Lamp::kPoint, Lamp::kSky}) {
      for (const bool is_orthographic : {false, true}) {
        Paths paths(lamp, is_orthographic, Fault::kNone, merged);
        for (const char* kinds : kMergingKinds) {
          EXPECT_LT(worst(paths, kinds), kRounding) << kinds << ", lamp " << static_cast<int>(lamp)
                                                    << ", " << is_orthographic << ", " << merged;
        }
      }
    }
  }
}

// Light comes to all vertices sharply, to some, or to none.
constexpr std::array kCausticKinds = {"s", "s^", "s^s", "fs-s^", "s-s", "s-s-s^", "s-sfs-s"};

TEST(BdptWeights, AddUpToOneWithCausticsAlone) {
  for (const double merged : kMerged) {
    for (const Lamp lamp : {Lamp::kPanel, Lamp::kPoint, Lamp::kSky}) {
      for (const bool is_orthographic : {false, true}) {
        Paths paths(lamp, is_orthographic, Fault::kNone, merged, "path-caustics");
        for (const char* kinds : kCausticKinds) {
          EXPECT_LT(worst(paths, kinds), kRounding) << kinds << ", lamp " << static_cast<int>(lamp)
                                                    << ", " << is_orthographic << ", " << merged;
        }
      }
    }
  }
}

TEST(BdptWeights, AddUpToOneWhereLightsAreAimed) {
  for (const Lamp lamp : {Lamp::kPanel, Lamp::kPoint, Lamp::kSky}) {
    Paths caustics(lamp, false, Fault::kNone, 1, "path-caustics");
    caustics.aim();
    for (const char* kinds : {"s^", "fs-s^", "s-s-s^"}) {
      EXPECT_LT(worst(caustics, kinds), kRounding) << kinds << ", lamp " << static_cast<int>(lamp);
    }
    // Where both strategies weigh something.
    Paths wrong(lamp, false, Fault::kUnaimed, lamp == Lamp::kSky ? 1e3 : 1, "path-caustics");
    wrong.aim();
    EXPECT_GT(worst(wrong, "s^"), kRounding) << "lamp " << static_cast<int>(lamp);
  }
  for (const bool is_orthographic : {false, true}) {
    Paths paths(Lamp::kAll, is_orthographic, Fault::kNone);
    paths.aim();
    for (const char* kinds : kGlassKinds) {
      EXPECT_LT(worst(paths, kinds), kRounding) << kinds << ", " << is_orthographic;
    }
  }
}

TEST(BdptWeights, DetectsAChainThatIsCountedTwiceAndADiskOfAnotherSize) {
  for (const Fault fault : {Fault::kMergedTwice, Fault::kOtherDisk}) {
    Paths all(Lamp::kPanel, false, fault, 1e6, "vcm");
    for (const char* kinds : kMergingKinds) {
      EXPECT_GT(worst(all, kinds), kRounding) << kinds << ", " << static_cast<int>(fault);
    }
  }
  Paths caustics(Lamp::kPoint, false, Fault::kMergedTwice, 1e6, "path-caustics");
  for (const char* kinds : {"s^", "s-s^", "sfs^"}) {
    EXPECT_GT(worst(caustics, kinds), kRounding) << kinds;
  }
}

TEST(BdptWeights, DetectsWrongDensitiesOfLightsAndOfTheWayBack) {
  for (const Fault fault : {Fault::kNoLightProbability, Fault::kReverse}) {
    Paths paths(Lamp::kAll, false, fault);
    for (const char* kinds : kGlassKinds) {
      if (fault == Fault::kReverse && std::string(kinds) == "g") {
        continue;  // no vertex has a density back to another one
      }
      EXPECT_GT(worst(paths, kinds), kRounding) << kinds << ", " << static_cast<int>(fault);
    }
  }
}

TEST(BdptWeights, DetectsFreeFlightMissingOnOneSide) {
  for (const Fault fault : {Fault::kNoFlightBack, Fault::kNoExtinction}) {
    for (const Lamp lamp : {Lamp::kPanel, Lamp::kPoint, Lamp::kSky}) {
      Paths paths(lamp, false, fault);
      for (const char* kinds : {"ff", "fsf", "fffff"}) {
        EXPECT_GT(worst(paths, kinds), 50 * kRounding)
            << kinds << ", lamp " << static_cast<int>(lamp) << ", " << static_cast<int>(fault);
      }
    }
  }
}

}  // namespace
