/// Small scenes made in code, directly as SceneDescription: tests of the renderer need no file
/// format.
#pragma once

#include <functional>
#include <memory>

#include "core/lights/environment.h"
#include "core/render/task/render_task.h"
#include "core/scene/scene.h"

namespace test_support {

/// A sphere of stacks x 2 stacks quads with smooth normals. inward: normals and front side point
/// in.
core::PrimitiveDescription sphere(core::Vec3 center, float radius_m, int stacks, bool inward,
                                  int material);
/// A parallelogram; front side towards cross(edge1, edge2).
core::PrimitiveDescription quad(core::Vec3 corner, core::Vec3 edge1, core::Vec3 edge2,
                                int material);
/// A closed box, turned about the vertical.
core::PrimitiveDescription box(core::Vec3 center, core::Vec3 half, float angle_rad,
                               int material = -1);
/// A horizontal disk of 512 triangles; faces down.
core::PrimitiveDescription disk(core::Vec3 center, float radius_m, int material);
/// Lambert: no specular layer.
core::MaterialDescription lambert(core::Rgb albedo);
core::MaterialDescription emitter(core::Rgb radiance);
/// White and smooth.
core::MaterialDescription mirror();
/// Clear and smooth. thickness 0: a thin wall.
core::MaterialDescription glass(float ior = 1.5F, float thickness = 1);
/// Emits along -z of its frame. irradiance: of a surface that faces it.
core::PunctualLightDescription directional(const core::Transform& to_world,
                                           core::Rgb irradiance = core::Rgb(1));
/// Everything in one mesh with one instance.
core::SceneDescription scene_of(std::vector<core::MaterialDescription> materials,
                                std::vector<core::PrimitiveDescription> primitives);

/// The Cornell box with round dimensions, 1 m wide: red left, green right, an emitter in the
/// ceiling.
core::SceneDescription cornell();

/// A view of it from in front, toward a point of its middle plane at that height, with box filter
/// and no auxiliary layers.
core::View cornell_view(int width, int height, float fov_degrees, float height_m = 0.5F);

std::shared_ptr<const core::Scene> build(core::SceneDescription description);
std::shared_ptr<const core::Environment> constant_sky(core::Rgb radiance);

/// An equirectangular map; value(column, row), row 0 at the top.
std::shared_ptr<const core::Environment> sky_map(int width, int height,
                                                 const std::function<core::Rgb(int, int)>& value,
                                                 float rotation_degrees = 0);

/// A view with box filter and no auxiliary layers.
core::View view_of(std::shared_ptr<const core::Scene> scene, int width, int height);
core::View view_of(core::SceneDescription scene, int width, int height);
void look_at(core::View& view, core::Vec3 from, core::Vec3 to, float fov_degrees);

struct Picture {
  std::shared_ptr<core::Film> film;
  core::FilmSnapshot snapshot;
  core::StopReason reason = core::StopReason::kNone;
  core::Progress progress;
  std::vector<core::ConvergencePoint> points;

  core::Rgb mean() const;
  /// Standard error of mean(), from the halves of all pixels.
  core::Rgb standard_error() const;
};

/// Returns the settings with defaults for options that the integrator does not accept, so that a
/// test can render one view by several integrators.
core::RenderSettings accepted(const core::RenderSettings& settings);
/// As core::settled_renderer(), with accepted() settings.
core::Result<std::shared_ptr<const core::Renderer>> settled_renderer(core::View view);

/// Renders accepted() settings to the end on two threads; aborts the test program on errors.
Picture render(const core::View& view, const core::StopRules& stop, int threads = 2);
Picture render(const core::View& view, int samples_per_pixel, int threads = 2);

}  // namespace test_support
