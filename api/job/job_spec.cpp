#include "api/job/job_spec.h"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "api/job/integrator_row.h"
#include "api/job/job_checks.h"
#include "api/job/job_rows.h"
#include "api/job/stop_rules.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/schemas.h"
#include "core/integrators/registry.h"
#include "core/render/task/pass_plan.h"
#include "core/settings/choices.h"

namespace api {
namespace {

constexpr Range kCoordinate = {-limits::kMetres, limits::kMetres};
constexpr Range kFocalLength = {0, 1e9, true};  ///< pixels
constexpr Range kFilmPlace = {-1e9, 1e9};       ///< pixels

constexpr std::array kClasses = {
    core::NamedValue<JobClass>{"normal", JobClass::kNormal,
                               "Stored, and served in the order of priority."},
    core::NamedValue<JobClass>{
        "preview", JobClass::kPreview,
        "Served first, kept only in memory, superseded by the next preview with its key."},
};
std::span<const core::NamedValue<JobClass>> classes() { return kClasses; }

constexpr auto camera_row() {
  return group(
      "camera",
      "Null members keep the value of the file's camera, selected by name or index, otherwise the "
      "first.",
      text(
          "name", [](auto& s) -> auto& { return s.camera.name; }, {1, limits::kNameCharacters},
          "Name of the file's camera."),
      number(
          "index", [](auto& s) -> auto& { return s.camera.index; }, {0, 65535},
          "Index of the file's camera; excludes name."),
      triple(
          "position", [](auto& s) -> auto& { return s.camera.position; }, kCoordinate,
          "Camera position in world space, metres. Requires target; together they replace the "
          "file's pose."),
      triple(
          "target", [](auto& s) -> auto& { return s.camera.target; }, kCoordinate,
          "Point that the camera looks at, in world space, metres."),
      triple(
          "up", [](auto& s) -> auto& { return s.camera.up; }, kCoordinate,
          "Up direction; [0, 1, 0] if position and target are given without it."),
      shown_if([](const JobSpec& s) { return s.orbit.has_value(); },
               CustomRow<JobSpec>{"orbit", &read_orbit, &print_orbit, &orbit_schema}),
      shown_if([](const JobSpec& s) { return s.camera.pose.has_value(); },
               CustomRow<JobSpec>{"pose", &read_pose, &print_pose, &pose_schema}),
      shown_if([](const JobSpec& s) { return s.camera.type.has_value(); },
               choice(
                   "type", [](auto& s) -> auto& { return s.camera.type; }, &core::camera_types,
                   "Projection; by default the file camera's, and perspective where the pose is "
                   "given.")),
      shown_if([](const JobSpec& s) { return s.camera.orthographic_height_m.has_value(); },
               number(
                   "orthographic_height",
                   [](auto& s) -> auto& { return s.camera.orthographic_height_m; },
                   {0, limits::kMetres, true},
                   "Height of an orthographic view, metres; null: the file camera's, or what a "
                   "perspective camera sees at the target's distance.")),
      number(
          "vertical_fov_degrees", [](auto& s) -> auto& { return s.camera.vertical_fov_degrees; },
          {0, 180, true, true}, "Vertical field of view, degrees; perspective cameras only."),
      shown_if([](const JobSpec& s) { return s.camera.shift.has_value(); },
               CustomRow<JobSpec>{"shift", &read_shift, &print_shift, &shift_schema}),
      shown_if([](const JobSpec& s) { return s.camera.fx_px.has_value(); },
               number(
                   "fx", [](auto& s) -> auto& { return s.camera.fx_px; }, kFocalLength,
                   "Focal length of a pinhole camera, in pixels of the full film.")),
      shown_if([](const JobSpec& s) { return s.camera.fy_px.has_value(); },
               number(
                   "fy", [](auto& s) -> auto& { return s.camera.fy_px; }, kFocalLength,
                   "The same along y; null: fx.")),
      shown_if([](const JobSpec& s) { return s.camera.cx_px.has_value(); },
               number(
                   "cx", [](auto& s) -> auto& { return s.camera.cx_px; }, kFilmPlace,
                   "Principal point of a pinhole camera, in pixels; null: the film's centre. Pixel "
                   "0 goes from 0 to 1, as in COLMAP and nerfstudio: add 0.5 to OpenCV's cx and "
                   "cy, which count from the centre of pixel 0.")),
      shown_if([](const JobSpec& s) { return s.camera.cy_px.has_value(); },
               number(
                   "cy", [](auto& s) -> auto& { return s.camera.cy_px; }, kFilmPlace,
                   "The same along y, downwards.")),
      shown_if(
          [](const JobSpec& s) {
            return s.camera.distortion.model != core::DistortionModel::kNone;
          },
          CustomRow<JobSpec>{"distortion", &read_distortion, &print_distortion,
                             &distortion_schema}),
      number(
          "aperture_radius", [](auto& s) -> auto& { return s.camera.aperture_radius_m; },
          {0, limits::kMetres}, "Radius of the lens, metres; 0 is a pinhole."),
      number(
          "focus_distance", [](auto& s) -> auto& { return s.camera.focus_distance_m; },
          {0, limits::kMetres, true}, "Distance of the plane in focus, metres."));
}

constexpr auto film_row() {
  return group(
      "film", "Size, filter and recorded layers; null: no image, only a meter.",
      number(
          "width", [](auto& s) -> auto& { return s.render.film.width; }, {1, limits::kFilmSide},
          "Pixels. Width times height is limited to 64 megapixels (413)."),
      number(
          "height", [](auto& s) -> auto& { return s.render.film.height; }, {1, limits::kFilmSide},
          "Pixels."),
      CustomRow<JobSpec>{"crop", &read_crop, &print_crop, &crop_schema},
      group("filter", "Reconstruction filter.",
            choice(
                "type", [](auto& s) -> auto& { return s.render.film.filter.type; }, &core::filters,
                "Kind of filter."),
            number(
                "radius", [](auto& s) -> auto& { return s.render.film.filter.radius_px; },
                {0, limits::kFilterRadius, true}, "Radius in pixels.")),
      CustomRow<JobSpec>{"layers", &read_layers, &print_layers, &layers_schema});
}

/// A choice whose faults name the laboratory's experiment for adaptive rules that exist only there.
template <typename Row>
struct AdaptiveTypeRow : Row {
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    for (const core::LaboratoryRule& rule : core::laboratory_rules()) {
      if (value.is_string() && value.get_ref<const std::string&>() == rule.name) {
        faults.add(pointer, "'" + std::string(rule.name) +
                                "' is available only in the laboratory, because its image or its "
                                "error estimate is not correct: experiment '" +
                                std::string(rule.experiment) + "', estimator '" +
                                std::string(rule.estimator) + "'");
        return;
      }
    }
    Row::read(value, out, pointer, faults);
  }
};

template <typename Row>
constexpr auto adaptive_type(Row row) {
  return AdaptiveTypeRow<Row>{row};
}

constexpr auto adaptive_row() {
  constexpr auto kType = [](auto& s) -> auto& { return s.render.adaptive.type; };
  return group(
      "adaptive", "Adaptive sampling.",
      adaptive_type(choice("type", kType, &core::adaptive_types,
                           "Rule that assigns samples. Default: 'pilot' for jobs with "
                           "stop.relative_error, otherwise 'none'.")),
      option_of("/adaptive/min_samples", kType, &core::adaptive_types,
                number(
                    "min_samples", [](auto& s) -> auto& { return s.render.adaptive.min_samples; },
                    {1, limits::kSamplesPerPixel},
                    "Samples of every pixel before the first decision, all replicates together; "
                    "rounded up to a count at which decisions are made: 20, or 1, 1.25, 1.5 and "
                    "1.75 times 2^k of each replicate.")),
      option_of("/adaptive/granularity", kType, &core::adaptive_types,
                choice(
                    "granularity", [](auto& s) -> auto& { return s.render.adaptive.granularity; },
                    &core::granularities, "Unit that gets the same number of samples.")),
      option_of("/adaptive/dilation", kType, &core::adaptive_types,
                number(
                    "dilation", [](auto& s) -> auto& { return s.render.adaptive.dilation; },
                    {0, limits::kDilation},
                    "Radius in pixels, in tiles for granularity 'tile': each takes the largest "
                    "need of its neighbours.")));
}

constexpr auto estimator_row() {
  constexpr auto kMis = [](auto& s) -> auto& { return s.render.estimator.mis; };
  constexpr auto kRoulette = [](auto& s) -> auto& { return s.render.estimator.roulette; };
  constexpr auto kSplitting = [](auto& s) -> auto& { return s.render.estimator.splitting; };
  return group(
      "estimator", "How paths are sampled and combined.",
      choice(
          "strategy", [](auto& s) -> auto& { return s.render.estimator.strategy; },
          &core::strategies, "How directions are sampled."),
      group("mis", "Weights of multiple importance sampling.",
            choice("type", kMis, &core::mis_types, "Heuristic."),
            option_of(
                "/estimator/mis/exponent", kMis, &core::mis_types,
                number(
                    "exponent", [](auto& s) -> auto& { return s.render.estimator.mis_exponent; },
                    {1, 16}, "Exponent of the power heuristic."))),
      group("roulette", "Russian roulette.",
            choice("type", kRoulette, &core::roulette_types, "Rule for the survival probability."),
            option_of(
                "/estimator/roulette/delta", kRoulette, &core::roulette_types,
                number(
                    "delta", [](auto& s) -> auto& { return s.render.estimator.roulette_delta; },
                    {0, limits::kRadiance}, "Radiance [W/(m^2 sr)]; 0 traces every shadow ray."))),
      group("splitting", "Splitting of a path into several at its first surface.",
            choice("type", kSplitting, &core::splitting_types, "How their number is chosen."),
            option_of("/estimator/splitting/count", kSplitting, &core::splitting_types,
                      number(
                          "count", [](auto& s) -> auto& { return s.render.estimator.split_count; },
                          {1, limits::kSplitCount}, "Number of continuations."))),
      group("control_variate", "Quantity that is subtracted from samples and added in closed form.",
            choice(
                "type", [](auto& s) -> auto& { return s.render.estimator.control_variate; },
                &core::control_variate_types, "Kind of control variate.")),
      flag(
          "expected_values", [](auto& s) -> auto& { return s.render.estimator.expected_values; },
          "True: absorption and transparency weight paths; false: they terminate paths at "
          "random."));
}

constexpr auto light_sampler_row() {
  constexpr auto kType = [](auto& s) -> auto& { return s.render.light_sampler; };
  return group(
      "light_sampler", "How a light is selected.",
      choice("type", kType, &core::light_samplers, "Method of selection."),
      option_of(
          "/light_sampler/candidates", kType, &core::light_samplers,
          number(
              "candidates", [](auto& s) -> auto& { return s.render.light_candidates; },
              {1, limits::kLightCandidates}, "Candidate light samples, of which one is selected.")),
      option_of("/light_sampler/block", kType, &core::light_samplers,
                number(
                    "block", [](auto& s) -> auto& { return s.render.light_block; },
                    {1, limits::kLightBlock},
                    "Side, in pixels, of the squares whose pixels share light samples.")),
      option_of("/light_sampler/history", kType, &core::light_samplers,
                number(
                    "history", [](auto& s) -> auto& { return s.render.light_history; },
                    {1, limits::kLightHistory},
                    "Passes that also share light samples: successive samples of a replicate. At "
                    "most 64 paths share samples: block x block x history.")),
      option_of(
          "/light_sampler/candidates_per_pixel", kType, &core::light_samplers,
          number(
              "candidates_per_pixel", [](auto& s) -> auto& { return s.render.block_candidates; },
              {1, limits::kLightCandidates},
              "Candidate light samples of each path, of which one is shared.")));
}

const auto& table() {
  static constexpr auto kTable = std::tuple{
      required_text("scene", &JobSpec::scene, {1, limits::kNameCharacters},
                    "Id from POST /v1/scenes, or the name of a built-in scene."),
      text("name", &JobSpec::name, {0, limits::kNameCharacters}, "Display name."),
      CustomRow<JobSpec>{"labels", &read_labels, &print_labels, &labels_schema},
      number("priority", &JobSpec::priority, {-limits::kPriority, limits::kPriority},
             "Higher values are served first."),
      number(
          "seed", [](auto& s) -> auto& { return s.render.seed; }, {0, limits::kSeed},
          "Seed for all random numbers in the job."),
      camera_row(),
      text("variant", &JobSpec::variant, {1, limits::kNameCharacters},
           "Material variant of the file by name (KHR_materials_variants)."),
      number("time_seconds", &JobSpec::time_seconds,
             {-limits::kSceneSeconds, limits::kSceneSeconds},
             "Animation time, seconds; null: the rest pose given by the file's transforms."),
      shown_if([](const JobSpec& s) { return s.render.shutter_seconds > 0; },
               number(
                   "shutter_seconds", [](auto& s) -> auto& { return s.render.shutter_seconds; },
                   {0, limits::kSceneSeconds},
                   "Time that the shutter is open, in seconds, starting at time_seconds: animated "
                   "objects and the file's camera are blurred. 0: no motion blur.")),
      shown_if(
          [](const JobSpec& s) { return s.render.film.motion; },
          number("motion_seconds", &JobSpec::motion_seconds,
                 {-limits::kSceneSeconds, limits::kSceneSeconds},
                 "Time from time_seconds to the second moment of the layer motion, which "
                 "includes the motion of the file's camera; negative: an earlier moment. In the "
                 "rest pose nothing moves.")),
      CustomRow<JobSpec>{"medium", &read_medium, &print_medium, &medium_schema},
      choice("class", &JobSpec::job_class, &classes, "Scheduling class."),
      text("preview_key", &JobSpec::preview_key, {1, limits::kNameCharacters},
           "A later preview with the same key supersedes this one; class preview only."),
      CustomRow<JobSpec>{"environment", &read_environment, &print_environment, &environment_schema,
                         false, true},
      shown_if(
          [](const JobSpec& s) {
            return s.render.background.type != core::BackgroundType::kEnvironment ||
                   core::has_catcher(s.render);
          },
          CustomRow<JobSpec>{"background", &read_background, &print_background,
                             &background_schema}),
      shown_if([](const JobSpec& s) { return s.render.ground.type != core::GroundType::kNone; },
               CustomRow<JobSpec>{"ground", &read_ground, &print_ground, &ground_schema}),
      nullable(
          [](auto& s) -> auto& { return s.has_image; }, film_row()),
      integrator_row(),
      estimator_row(),
      group("sampler", "Sequence of sample points.",
            choice(
                "type", [](auto& s) -> auto& { return s.render.sampler; }, &core::samplers,
                "Type of point set. Each has a rule for sample counts; see /v1/server."),
            CustomRow<JobSpec>{
                "replicates", &read_replicates,
                [](const JobSpec& s, Json& object) { object["replicates"] = s.render.replicates; },
                &replicates_schema},
            CustomRow<JobSpec>{"first_replicate", &read_first_replicate,
                               [](const JobSpec& s, Json& object) {
                                 if (s.render.first_replicate != 0) {
                                   object["first_replicate"] = s.render.first_replicate;
                                 }
                               },
                               &first_replicate_schema, false, true}),
      light_sampler_row(),
      adaptive_row(),
      shown_if([](const JobSpec& s) { return !s.render.meter.empty(); },
               CustomRow<JobSpec>{"meter", &read_meter, &print_meter, &meter_schema}),
      choice(
          "units", [](auto& s) -> auto& { return s.render.units; }, &core::units,
          "Unit of radiance, irradiance and intensity."),
      flag(
          "spectral", [](auto& s) -> auto& { return s.render.spectral; },
          "True: paths carry three wavelengths instead of three colours."),
      CustomRow<JobSpec>{
          "stop",
          [](const Json& value, JobSpec& s, const std::string& pointer, Faults& faults) {
            s.stop = read_stop(value, pointer, faults);
          },
          [](const JobSpec& s, Json& object) { object["stop"] = print_stop(s.stop); },
          [](const JobSpec& defaults) { return stop_schema(defaults.stop); }},
      shown_if([](const JobSpec& s) { return !(s.denoise == DenoiseSpec{}); },
               group("denoise",
                     "Denoised images, which are made on demand and are not part of the film.",
                     choice(
                         "type", [](auto& s) -> auto& { return s.denoise.type; }, &core::denoisers,
                         "Denoiser."),
                     flag(
                         "preview", [](auto& s) -> auto& { return s.denoise.preview; },
                         "If false, there are none until the job has ended."))),
      shown_if([](const JobSpec& s) { return s.webhook.has_value(); },
               CustomRow<JobSpec>{"webhook", &read_webhook, &print_webhook, &webhook_schema}),
      shown_if(
          [](const JobSpec& s) { return s.retention_seconds.has_value(); },
          number("retention_seconds", &JobSpec::retention_seconds, {0, limits::kRetentionSeconds},
                 "Time after its end at which the job and its files are deleted; null: kept.")),
  };
  return kTable;
}

/// Rounds min_samples to a count at which decisions are made, so that the spec holds the value in
/// force. Returns false if it already was one.
bool round_min_samples(core::RenderSettings& render) {
  if (render.adaptive.type == core::AdaptiveType::kNone) {
    return false;
  }
  const int in_force = core::first_epoch(render);
  // Beyond the samples that a job may have, no decision is ever made.
  if (in_force == render.adaptive.min_samples || in_force > limits::kSamplesPerPixel) {
    return false;
  }
  render.adaptive.min_samples = in_force;
  return true;
}

std::string min_samples_warning(int asked, const core::RenderSettings& render) {
  return "adaptive.min_samples: " + std::to_string(asked) + " was requested, " +
         std::to_string(render.adaptive.min_samples) +
         " is used: decisions are made at 1, 1.25, 1.5 and 1.75 times 2^k samples of each of " +
         std::to_string(render.replicates) + " replicates, from 20 samples on.";
}

/// Returns the text of a member; empty if it has none.
std::string text_at(const Json& request, const char* pointer) {
  const Json::json_pointer at(pointer);
  return request.contains(at) && request.at(at).is_string() ? request.at(at).get<std::string>()
                                                            : std::string();
}

/// Takes the value of the row that the member names; one that no row has is refused later.
template <typename T>
void take_named(const Json& request, const char* pointer, std::span<const core::NamedValue<T>> rows,
                T& out) {
  const std::string name = text_at(request, pointer);
  for (const core::NamedValue<T>& row : rows) {
    out = row.name == name ? row.value : out;
  }
}

/// Returns the defaults of the integrator named by the request, or of the default one.
core::RenderSettings defaults_of(const Json& request) {
  const std::string type = text_at(request, "/integrator/type");
  const Json::json_pointer target("/stop/relative_error");
  core::DefaultTerms terms = core::kJobTerms;
  terms.has_error_target = request.contains(target) && !request.at(target).is_null();
  take_named(request, "/integrator/caustics", core::caustics_types(), terms.caustics);
  take_named(request, "/light_sampler/type", core::light_samplers(), terms.light_sampler);
  return core::default_settings(type.empty() ? core::RenderSettings().integrator : type, terms);
}

}  // namespace

Parsed<ParsedJob> parse_job(std::string_view body) {
  const Parsed<Json> value = parse_json(body, limits::kBodyBytes);
  if (!value) {
    return value.problem();
  }
  ParsedJob job;
  job.spec.render = defaults_of(*value);
  Faults faults;
  read_members(table(), *value, job.spec, "", faults);
  set_stage_defaults(*value, job.spec);
  drop_image(job.spec);
  // Rules between members require valid members.
  if (faults.empty()) {
    check_camera(job.spec, faults);
    check_film(job.spec.render.film, faults);
    check_image(job.spec, faults);
    check_class(job.spec, faults);
    check_stage(*value, job.spec, faults);
    check_error_target(job.spec.stop, job.spec, faults);
    check_shutter(job.spec, faults);
    check_rules(job.spec, nullptr, faults);
    round_stop(job.spec.stop, job.spec.render, job.warnings);
    const int asked = job.spec.render.adaptive.min_samples;
    if (round_min_samples(job.spec.render) &&
        value->contains(Json::json_pointer("/adaptive/min_samples"))) {
      job.warnings.push_back(min_samples_warning(asked, job.spec.render));
    }
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  for (std::string& warning : idle_warnings(job.spec)) {
    job.warnings.push_back(std::move(warning));
  }
  return job;
}

Json to_json(const JobSpec& spec) { return print_members(table(), spec); }

std::string spec_json(const JobSpec& spec) { return dump(to_json(spec)); }

bool same_spec(const JobSpec& a, const JobSpec& b) { return to_json(a) == to_json(b); }

Json job_request_schema() {
  return object_schema(table(), JobSpec{}, "A job: what to render, how, and when to stop.");
}

core::CameraSettings camera_in(const JobSpec& spec, const core::Bounds& bounds,
                               core::Place origin) {
  const auto from_origin = [origin](std::optional<core::Place>& place) {
    if (place) {
      place = *place - origin;
    }
  };
  core::CameraSettings camera = spec.camera;
  from_origin(camera.position);
  from_origin(camera.target);
  if (camera.pose) {
    const core::Place at = camera.pose->position() - origin;
    camera.pose->matrix[3] = at.x;
    camera.pose->matrix[7] = at.y;
    camera.pose->matrix[11] = at.z;
  }
  if (!spec.orbit) {
    return camera;
  }
  core::CameraOrbit orbit = *spec.orbit;
  from_origin(orbit.target);
  const core::FilmSettings& film = spec.render.film;
  return core::placed_on_orbit(std::move(camera), orbit, bounds, film.width, film.height);
}

std::optional<double> later_seconds(const JobSpec& spec) {
  const bool moves = spec.render.film.motion && spec.time_seconds.has_value();
  return moves ? std::optional(*spec.time_seconds + spec.motion_seconds) : std::nullopt;
}

std::string sight_key(const JobSpec& spec) {
  const Json all = to_json(spec);
  Json key = {{"width", spec.render.film.width}, {"height", spec.render.film.height}};
  for (const char* name : {"scene", "camera", "variant", "time_seconds", "ground"}) {
    key[name] = all.value(name, Json());
  }
  return dump(key);
}

std::optional<std::string> resolve_environment(JobSpec& spec, const core::SceneSummary& scene) {
  if (spec.environment_choice != EnvironmentChoice::kAutomatic) {
    return {};
  }
  spec.environment = core::EnvironmentSettings{};
  spec.environment_asset.reset();
  if (scene.has_environment) {
    return "No environment was given, so the scene's own is used.";
  }
  if (scene.lights.empty() && !scene.has_emissive_strength) {
    spec.environment_choice = EnvironmentChoice::kGiven;
    return "No environment was given, so it is white: the scene has no lights and no strong "
           "emission.";
  }
  spec.environment_choice = EnvironmentChoice::kBlack;
  return "No environment was given, so the background is black: the scene has its own lights.";
}

}  // namespace api
