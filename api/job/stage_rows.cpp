// Surroundings of a model: environment, background, ground.

#include <cmath>
#include <string>
#include <tuple>

#include "api/job/job_rows.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/time_text.h"
#include "api/requests.h"
#include "core/integrators/registry.h"
#include "core/lights/sun_position.h"
#include "core/settings/choices.h"

namespace api {
namespace {

void read_asset(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.environment_asset.reset();
  if (value.is_null()) {
    return;
  }
  if (!value.is_string()) {
    faults.add(pointer, "expected a string, got " + std::string(type_text(value)));
  } else if (const auto& id = value.get_ref<const std::string&>(); !is_sha256(id)) {
    faults.add(pointer, shown(value) + " is not an asset id (64 lower-case hex digits)");
  } else {
    spec.environment_asset = id;
  }
}

void read_sun_time(const Json& value, core::SunSettings& sun, const std::string& pointer,
                   Faults& faults) {
  const auto text = read_text(value, {1, 64}, pointer, faults);
  if (!text) {
    return;
  }
  if (const auto seconds = parse_rfc3339(*text)) {
    sun.unix_seconds = *seconds;
  } else {
    faults.add(pointer,
               shown(value) + " is not an RFC 3339 time such as 2026-06-21T12:00:00+02:00");
  }
}

const auto& sun_table() {
  static constexpr auto kTable = std::tuple{
      number("latitude", &core::SunSettings::latitude_degrees, {-90, 90},
             "Degrees; north is positive."),
      number("longitude", &core::SunSettings::longitude_degrees, {-180, 180},
             "Degrees; east is positive."),
      CustomRow<core::SunSettings>{"time", &read_sun_time,
                                   [](const core::SunSettings& s, Json& object) {
                                     object["time"] = short_rfc3339(s.unix_seconds);
                                   },
                                   [](const core::SunSettings&) {
                                     Json schema =
                                         basic_schema("string", "RFC 3339 time during the day.");
                                     schema["format"] = "date-time";
                                     return schema;
                                   }},
  };
  return kTable;
}

void read_sun(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.environment.sun.reset();
  if (value.is_null() || !expect_object(value, pointer, faults)) {
    return;
  }
  for (const std::string_view member : member_names(sun_table())) {
    if (!value.contains(std::string(member))) {
      faults.add(join_pointer(pointer, member), "is required");
    }
  }
  read_members(sun_table(), value, spec.environment.sun.emplace(), pointer, faults);
}

void print_sun(const JobSpec& spec, Json& object) {
  if (spec.environment.sun) {
    object["sun"] = print_members(sun_table(), *spec.environment.sun);
  }
}

Json sun_schema(const JobSpec& /*defaults*/) {
  Json schema = object_schema(
      sun_table(), core::SunSettings{},
      "Sun and clear sky for a location and time, in cd/m2 (683 lm/W): at noon they light level "
      "ground with about 100,000 lux, so show images with exposure auto. Sky: Preetham, Shirley "
      "and Smits 1999, turbidity 3. Position: NOAA. The sun is sampled as a disc. North is -z, "
      "east is +x.");
  for (auto& property : schema["properties"]) {
    property.erase("default");
  }
  schema["type"] = {"object", "null"};
  schema["required"] = member_names(sun_table());
  schema["default"] = nullptr;
  return schema;
}

// Reads the short form of background type 'transparent'.
void read_visible(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  const auto visible = read_flag(value, pointer, faults);
  if (visible && !*visible) {
    spec.render.background.type = core::BackgroundType::kTransparent;
  }
}

const auto& environment_table() {
  constexpr Range kRadiance = {0, limits::kRadiance};
  static constexpr auto kTable = std::tuple{
      CustomRow<JobSpec>{
          "asset", &read_asset,
          [](const JobSpec& s, Json& object) {
            object["asset"] = s.environment_asset ? Json(*s.environment_asset) : Json(nullptr);
          },
          [](const JobSpec& /*defaults*/) {
            Json schema = basic_schema(
                "string",
                "Asset with an equirectangular image (.hdr, .exr) in cd/m2; null: one colour.",
                true);
            schema["pattern"] = "^[0-9a-f]{64}$";
            schema["default"] = nullptr;
            return schema;
          }},
      shown_if(
          [](const JobSpec& s) { return s.environment.preset.has_value(); },
          choice(
              "preset", [](auto& s) -> auto& { return s.environment.preset; },
              &core::environment_presets,
              "Procedural studio light, as strong as a white environment of 1 cd/m2; instead of an "
              "asset.")),
      CustomRow<JobSpec>{"sun", &read_sun, &print_sun, &sun_schema, false, true},
      triple(
          "color", [](auto& s) -> auto& { return s.environment.color; }, kRadiance,
          "Linear Rec.709; multiplies the image."),
      number(
          "intensity", [](auto& s) -> auto& { return s.environment.intensity; }, kRadiance,
          "Multiplies colour and image."),
      number(
          "rotation_degrees", [](auto& s) -> auto& { return s.environment.rotation_degrees; },
          {-limits::kAngleDegrees, limits::kAngleDegrees},
          "Positive angles rotate it counter-clockwise seen from above."),
      CustomRow<JobSpec>{"visible", &read_visible,
                         [](const JobSpec& s, Json& object) {
                           object["visible"] = !core::is_transparent(s.render);
                         },
                         [](const JobSpec& /*defaults*/) {
                           Json schema = basic_schema(
                               "boolean",
                               "If false, the environment lights the scene but the background is "
                               "transparent: short form of background type 'transparent'.");
                           schema["default"] = true;
                           return schema;
                         }},
  };
  return kTable;
}

const auto& background_table() {
  constexpr Range kRadiance = {0, limits::kRadiance};
  static constexpr auto kTable = std::tuple{
      choice("type", &core::BackgroundSettings::type, &core::backgrounds,
             "Kind of background. Default: 'transparent' with ground 'catcher', otherwise "
             "'environment'."),
      when([](const core::BackgroundSettings& s) { return s.type == core::BackgroundType::kColor; },
           "applies only to type 'color'",
           triple("color", &core::BackgroundSettings::color, kRadiance, "Linear Rec.709.")),
      when(
          [](const core::BackgroundSettings& s) {
            return s.type != core::BackgroundType::kEnvironment;
          },
          "does not apply to type 'environment'",
          shown_if(
              [](const core::BackgroundSettings& s) {
                return s.through_glass != (s.type == core::BackgroundType::kTransparent);
              },
              flag(
                  "through_glass", &core::BackgroundSettings::through_glass,
                  "Glass, water and other clear surfaces show the background, not the environment: "
                  "surfaces that camera paths cross, bent or not, with a roughness of at most 0.1. "
                  "With type 'transparent' their alpha is 1 less the luminance of the light that "
                  "they let through. Default: true for 'transparent' with integrators that support "
                  "it, otherwise false."))),
  };
  return kTable;
}

const auto& ground_table() {
  constexpr Range kMetres = {-limits::kMetres, limits::kMetres};
  constexpr Range kShare = {0, 1};
  constexpr auto kIsThere = [](const core::GroundSettings& s) {
    return s.type != core::GroundType::kNone;
  };
  constexpr std::string_view kElse = "applies only to types 'catcher' and 'sweep'";
  static constexpr auto kTable = std::tuple{
      choice("type", &core::GroundSettings::type, &core::grounds, "Kind of ground."),
      when(kIsThere, kElse,
           number("height", &core::GroundSettings::height_m, kMetres,
                  "Height (y), metres; null: the model's lowest point.")),
      when(
          kIsThere, kElse,
          triple("color", &core::GroundSettings::color, kShare,
                 "Albedo of its surface, linear Rec.709; also of a catcher, which lights the model "
                 "from below.")),
      when(kIsThere, kElse,
           number("reflection", &core::GroundSettings::reflection, kShare,
                  "Weight of a smooth clear coat that reflects the model: 0 is diffuse, 1 is a "
                  "lacquered surface, which reflects 4% at normal incidence and more at grazing "
                  "angles.")),
      when([](const core::GroundSettings& s) { return s.type == core::GroundType::kCatcher; },
           "applies only to type 'catcher'",
           shown_if(
               [](const core::GroundSettings& s) {
                 const core::ShadowSettings usual;
                 return s.shadow.color != usual.color || s.shadow.strength != usual.strength ||
                        s.shadow.softness != usual.softness;
               },
               nested(
                   "shadow", &core::GroundSettings::shadow, "The shadow on a catcher.",
                   choice("color", &core::ShadowSettings::color, &core::shadow_colors,
                          "Colour of the shadow."),
                   number("strength", &core::ShadowSettings::strength, kShare,
                          "Factor of the blocked light: 0 is no shadow."),
                   number(
                       "softness", &core::ShadowSettings::softness, kShare,
                       "Sine of the angle by which every light is widened for the shadow: 0 is the "
                       "shadow that the lights cast.")))),
  };
  return kTable;
}

void check_environment(const JobSpec& spec, Faults& faults) {
  const core::EnvironmentSettings& environment = spec.environment;
  const int sources =
      (spec.environment_asset ? 1 : 0) + (environment.preset ? 1 : 0) + (environment.sun ? 1 : 0);
  if (sources > 1) {
    faults.add(environment.preset ? "/environment/preset" : "/environment/sun",
               "asset, preset and sun exclude each other; give only one");
    return;
  }
  if (environment.sun) {
    const double elevation = core::sun_position(*environment.sun).elevation_degrees;
    if (!(elevation > 0)) {
      faults.add("/environment/sun/time",
                 "the sun is " + number_text(std::round(-elevation * 10) / 10) +
                     " degrees below the horizon at that time; the sky model covers only daytime");
    }
  }
}

}  // namespace

void read_environment(const Json& value, JobSpec& spec, const std::string& pointer,
                      Faults& faults) {
  spec.environment = core::EnvironmentSettings{};
  spec.environment_asset.reset();
  if (value.is_null()) {
    spec.environment_choice = EnvironmentChoice::kBlack;
    return;
  }
  spec.environment_choice = EnvironmentChoice::kGiven;
  read_members(environment_table(), value, spec, pointer, faults);
}

void print_environment(const JobSpec& spec, Json& object) {
  if (spec.environment_choice == EnvironmentChoice::kBlack) {
    object["environment"] = nullptr;
  } else if (spec.environment_choice == EnvironmentChoice::kGiven) {
    object["environment"] = print_members(environment_table(), spec);
  }
}

Json environment_schema(const JobSpec& defaults) {
  Json schema =
      object_schema(environment_table(), defaults,
                    "Distant environment lighting, added to the scene's lights. Null: black. "
                    "Absent: the scene's own, if it has one; otherwise white, unless the scene has "
                    "a punctual light or an emissive strength above 1.");
  schema["type"] = {"object", "null"};
  return schema;
}

void read_background(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  read_members(background_table(), value, spec.render.background, pointer, faults);
}

void print_background(const JobSpec& spec, Json& object) {
  object["background"] = print_members(background_table(), spec.render.background);
}

Json background_schema(const JobSpec& defaults) {
  Json schema = object_schema(background_table(), defaults.render.background,
                              "What the camera sees behind the scene; mirrors, and glass unless "
                              "through_glass is true, show the environment.");
  schema["properties"]["through_glass"].erase("default");
  return schema;
}

void read_ground(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  read_members(ground_table(), value, spec.render.ground, pointer, faults);
}

void print_ground(const JobSpec& spec, Json& object) {
  object["ground"] = print_members(ground_table(), spec.render.ground);
}

Json ground_schema(const JobSpec& defaults) {
  return object_schema(ground_table(), defaults.render.ground,
                       "Horizontal ground added to the scene.");
}

void set_stage_defaults(const Json& request, JobSpec& spec) {
  const auto is_given = [&request](const char* pointer) {
    return request.contains(Json::json_pointer(pointer));
  };
  if (core::has_catcher(spec.render) && !is_given("/background/type") &&
      !is_given("/environment/visible")) {
    spec.render.background.type = core::BackgroundType::kTransparent;
  }
  if (const auto* row = core::find_integrator(spec.render.integrator);
      row != nullptr && !is_given("/background/through_glass")) {
    spec.render.background.through_glass =
        core::is_transparent(spec.render) && core::accepts(*row, core::kThroughGlass);
  }
  spec.render.film.errors_over_white =
      core::has_catcher(spec.render) && core::is_transparent(spec.render);
}

void check_stage(const Json& request, const JobSpec& spec, Faults& faults) {
  check_environment(spec, faults);
  const Json::json_pointer visible("/environment/visible");
  const Json::json_pointer type("/background/type");
  if (request.contains(visible) && request.contains(type) &&
      (request.at(visible) == false) != (request.at(type) == "transparent")) {
    faults.add("/environment/visible", dump(request.at(visible)) + " contradicts background type " +
                                           shown(request.at(type)) + "; give only one");
  }
}

}  // namespace api
