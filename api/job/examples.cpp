#include "api/job/examples.h"

#include <array>

#include <nlohmann/json.hpp>

#include "api/answers/objects_view.h"
#include "api/json/errors.h"
#include "api/json/time_text.h"

namespace api {
namespace {

constexpr std::string_view kAssetId =
    "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08";

Json parsed(const std::string& text) { return Json::parse(text); }

core::SceneSummary example_scene() {
  core::SceneSummary scene;
  scene.name = "cornell-box";
  scene.bounds.add(core::Vec3{0, 0, -0.5592F});
  scene.bounds.add(core::Vec3{0.5528F, 0.5488F, 0});
  scene.triangles = 32;
  scene.instances = 8;
  scene.bytes = 24576;
  core::CameraDescription camera;
  camera.name = "Camera";
  scene.cameras.push_back(camera);
  scene.materials = {"white", "red", "green", "light"};
  return scene;
}

std::vector<core::ConvergencePoint> example_points() {
  std::vector<core::ConvergencePoint> points;
  constexpr std::array kSamples = {4, 16, 64};
  constexpr std::array kErrorsAt = {0.31, 0.16, 0.079};
  for (std::size_t i = 0; i < kSamples.size(); ++i) {
    core::ConvergencePoint point;
    point.samples_per_pixel = kSamples[i];
    point.elapsed_seconds = 0.05 * kSamples[i];
    point.cpu_seconds = 0.1 * kSamples[i];
    point.rays = static_cast<std::uint64_t>(kSamples[i]) * 1'036'800;
    point.error = {kErrorsAt[i], kErrorsAt[i] * 0.97, kErrorsAt[i] * 1.03, false};
    points.push_back(point);
  }
  return points;
}

PixelView example_pixel() {
  PixelView pixel;
  pixel.x = 120;
  pixel.y = 80;
  pixel.samples = 64;
  pixel.layers.push_back({"beauty",
                          {0.52, 0.31, 0.12},
                          {0.02, 0.01, 0.01},
                          {0.48, 0.29, 0.1},
                          {0.56, 0.33, 0.14},
                          {{0.51, 0.31, 0.12}, {0.53, 0.31, 0.12}}});
  return pixel;
}

ObjectsView example_objects() {
  ObjectsView out;
  out.camera = {.type = core::CameraType::kPerspective,
                .width = 960,
                .height = 540,
                .scale_px = {651.8, 651.8},
                .center_px = {480, 270},
                .distortion = {},
                .origin = {},
                .to_world = {}};
  out.has_ids = true;
  ObjectView chair{.id = 4,
                   .pointer = "/nodes/3",
                   .name = "chair",
                   .first_instance = 3,
                   .instances = 1,
                   .place = {}};
  chair.place.bounds.add(core::Vec3{-0.5F, 0, -0.5F});
  chair.place.bounds.add(core::Vec3{0.5F, 1, 0.5F});
  chair.place.visible = BoxView{310, 120, 84, 201, 9320};
  chair.place.amodal = BoxView{309.6, 119.7, 120.2, 201.9, 0};
  out.objects = {chair};
  out.instances = {{3, 4, chair.place}};
  out.materials = {{1, "/materials/0", "oak"}};
  out.primitives = {{1, "/meshes/0/primitives/0", ""}};
  return out;
}

}  // namespace

JobView example_job() {
  JobView job;
  job.id = "3f0c9c52-6d0e-4d7b-9a51-0a6f3c1b7e10";
  job.state = JobState::kRendering;
  job.created_at_unix_seconds = 1767225600;
  job.started_at_unix_seconds = 1767225600.25;
  job.spec.scene = "cornell-box";
  job.spec.environment_choice = EnvironmentChoice::kGiven;
  job.progress.fraction = 0.25;
  job.progress.samples_min = 64;
  job.progress.samples_mean = 64;
  job.progress.samples_max = 64;
  job.progress.elapsed_seconds = 3.2;
  job.progress.cpu_seconds = 6.3;
  job.progress.eta_seconds = 9.6;
  job.progress.eta_low_seconds = 9.1;
  job.progress.eta_high_seconds = 10.1;
  job.progress.rays = 66'355'200;
  job.progress.rays_per_second = 20'736'000;
  job.progress.error = {0.079, 0.077, 0.081, false};
  job.progress.revision = 2040;
  job.peak_bytes = 41'943'040;
  job.warnings = {
      "No environment was given, so it is white: the scene has no lights and no strong emission."};
  return job;
}

Json example_of(std::string_view schema) {
  if (schema == "JobRequest") {
    return {{"scene", "cornell-box"},
            {"film", {{"width", 480}, {"height", 270}}},
            {"stop", {{"relative_error", 0.02}, {"seconds", 60}}}};
  }
  if (schema == "JobPatch") {
    return {{"priority", 10}, {"stop", {{"samples_per_pixel", 1024}}}};
  }
  if (schema == "BatchRequest") {
    return {{"template",
             {{"scene", "glass"},
              {"camera", {{"orbit", {{"phi_degrees", 80}}}}},
              {"film", {{"width", 1200}, {"height", 1200}}},
              {"stop", {{"relative_error", 0.03}}}}},
            {"matrix", {{"camera.orbit.theta_degrees", {0, 90, 180, 270}}}},
            {"name", "view-{theta_degrees}"}};
  }
  if (schema == "ExtendRequest") {
    return {{"stop", {{"samples_per_pixel", 1024}}}};
  }
  if (schema == "LabRequest") {
    return {{"experiment", "strategies"}, {"estimator", "mis"}, {"sampler", "independent"},
            {"n", {16, 64, 256, 1024}},   {"replicates", 64},   {"seed", 1},
            {"params", {{"side", 4}}}};
  }
  if (schema == "SceneFromAssets") {
    return {{"gltf", kAssetId}, {"files", {{"textures/wood.png", kAssetId}}}};
  }
  if (schema == "ComparisonRequest") {
    return {{"a", example_job().id}, {"b", kAssetId}};
  }
  if (schema == "MergeRequest") {
    return {{"films", Json::array({example_job().id, kAssetId})}};
  }
  if (schema == "Asset") {
    return parsed(asset_json(kAssetId, 1'048'576));
  }
  if (schema == "Scene") {
    return parsed(scene_json("cornell-box", example_scene()));
  }
  if (schema == "Job") {
    return parsed(job_json(example_job()));
  }
  if (schema == "SceneObjects") {
    return parsed(objects_json(example_objects()));
  }
  if (schema == "Convergence") {
    return parsed(convergence_json(example_points()));
  }
  if (schema == "Pixel") {
    return parsed(pixel_json(example_pixel()));
  }
  if (schema == "Problem") {
    return parsed(problem_json(make_problem(core::ErrorCode::kInvalidArgument,
                                            {{"/film/width", "0 is outside [1, 16384]"}}),
                               "/v1/jobs"));
  }
  return nullptr;
}

}  // namespace api
