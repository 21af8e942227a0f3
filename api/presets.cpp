#include "api/presets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/query_rows.h"
#include "api/json/schemas.h"
#include "api/json/time_text.h"
#include "api/queries/look_rows.h"
#include "api/queries/render_query.h"
#include "core/base/text.h"
#include "core/settings/choices.h"

namespace api {
namespace {

/// In place of the scene that the URL names.
constexpr std::string_view kAnyScene = "any";
constexpr double kPixelRatioMax = 4;

void read_template(const Json& value, Preset& out, const std::string& pointer, Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  if (value.contains("scene")) {
    faults.add(join_pointer(pointer, "scene"), "is given when the preset is used");
    return;
  }
  Json job = value;
  job["scene"] = kAnyScene;
  const auto parsed = parse_job(dump(job));
  if (!parsed) {
    for (const FieldError& error : parsed.problem().errors) {
      faults.add(pointer + error.pointer, error.detail);
    }
    return;
  }
  if (!parsed->spec.has_image) {
    faults.add(join_pointer(pointer, "film"), "must not be null: a preset makes images");
  }
  if (parsed->spec.job_class != JobClass::kNormal) {
    faults.add(join_pointer(pointer, "class"), "must be normal: images by URL are kept");
  }
  out.job = dump(value);
  out.priority = parsed->spec.priority;
}

void read_sizes(const Json& value, Preset& out, const std::string& pointer, Faults& faults) {
  out.sizes.clear();
  if (!value.is_array()) {
    faults.add(pointer, "expected an array of [width, height]");
    return;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string place = join_pointer(pointer, std::to_string(i));
    const Json& size = value[i];
    if (!size.is_array() || size.size() != 2) {
      faults.add(place, "expected [width, height]");
      continue;
    }
    const Range sides = {1, limits::kFilmSide};
    const auto width = read_integer(size[0], sides, join_pointer(place, "0"), faults);
    const auto height = read_integer(size[1], sides, join_pointer(place, "1"), faults);
    if (width && height) {
      out.sizes.push_back({static_cast<int>(*width), static_cast<int>(*height)});
    }
  }
  if (static_cast<std::int64_t>(value.size()) > limits::kPageSize) {
    faults.add(pointer, "has more than " + std::to_string(limits::kPageSize) + " sizes");
  }
}

const auto& preset_table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<Preset>{
          "job", &read_template,
          [](const Preset& preset, Json& object) { object["job"] = Json::parse(preset.job); },
          [](const Preset&) {
            return basic_schema("object", "A JobRequest without `scene`; class normal.");
          },
          true},
      flag("public", &Preset::is_public,
           "Images need no signature, in the film's size and in those of `sizes`. The name must be "
           "free among the public presets of all tenants."),
      CustomRow<Preset>{"sizes", &read_sizes,
                        [](const Preset& preset, Json& object) { object["sizes"] = preset.sizes; },
                        [](const Preset&) {
                          Json schema = basic_schema(
                              "array",
                              "Sizes [width, height] of public images in pixels, `dpr` included.");
                          schema["items"] = {{"type", "array"},
                                             {"items", {{"type", "integer"}}},
                                             {"minItems", 2},
                                             {"maxItems", 2}};
                          schema["default"] = Json::array();
                          return schema;
                        }},
      number(
          "deadline_seconds", &Preset::deadline_seconds, {0, limits::kWaitSeconds, true},
          "The first request of an image waits at most this long (and at most --max-wait); then it "
          "gets the image as it is, if every pixel has a sample, or 503."),
      flag(
          "turntable", &Preset::is_turntable,
          "The model has the same size at every theta, for images that turn it: the least distance "
          "at which 8% of each side are free from all around. Otherwise each angle has its own."),
  };
  return kTable;
}

const auto& url_table() {
  constexpr Range kSide = {1, limits::kFilmSide};
  static constexpr auto kTable = std::tuple{
      number("w", &PictureUrl::width, kSide,
             "Width; the height follows from the preset's film if it is absent."),
      number("h", &PictureUrl::height, kSide, "Height; the width follows likewise."),
      number("dpr", &PictureUrl::pixel_ratio, {0, kPixelRatioMax, true},
             "Pixels for each unit of w and h."),
  };
  return kTable;
}

bool is_whole(double value) { return std::floor(value) == value; }

bool is_view_listed(const Preset& preset, const PictureUrl& url) {
  const Json job = Json::parse(preset.job);
  const auto is_own = [&job](const char* name, double degrees) {
    const auto pointer = Json::json_pointer("/camera/orbit") / name;
    return job.contains(pointer) && job[pointer].is_number() &&
           std::remainder(job[pointer].get<double>() - degrees, 360.0) == 0;
  };
  return (is_whole(url.theta_degrees) && is_whole(url.phi_degrees)) ||
         (is_own("theta_degrees", url.theta_degrees) && is_own("phi_degrees", url.phi_degrees));
}

}  // namespace

Parsed<Preset> parse_preset(std::string_view body) {
  return parse_body<Preset>(preset_table(), body);
}

std::string preset_json(std::string_view name, const Preset& preset) {
  Json object = {{"name", name}};
  object.update(print_members(preset_table(), preset));
  return dump(object);
}

std::string preset_list_json(const std::map<std::string, Preset>& presets) {
  Json list = Json::array();
  for (const auto& [name, preset] : presets) {
    list.push_back(Json::parse(preset_json(name, preset)));
  }
  return dump(Json{{"presets", std::move(list)}});
}

const std::map<std::string, Preset>& ready_presets() {
  static const std::map<std::string, Preset> kReady = [] {
    std::map<std::string, Preset> ready;
    // A wide image on a page: the model in its studio.
    ready["hero"].job = R"({"film":{"width":1600,"height":900},"environment":{"preset":"studio"},)"
                        R"("ground":{"type":"sweep"},"stop":{"relative_error":0.02,"seconds":60}})";
    // Marketplaces ask for a square of at least 1,000 pixels without a scene around the product.
    ready["packshot"].job =
        R"({"film":{"width":1000,"height":1000},"environment":{"preset":"tent"},)"
        R"("ground":{"type":"catcher"},"background":{"type":"transparent"},)"
        R"("stop":{"relative_error":0.02,"seconds":60}})";
    ready["turntable"].is_turntable = true;
    ready["turntable"].job =
        R"({"film":{"width":800,"height":800},"environment":{"preset":"studio"},)"
        R"("ground":{"type":"catcher"},"background":{"type":"transparent"},)"
        R"("stop":{"relative_error":0.03,"seconds":30}})";
    // Light from all sides: without a ground, studio light leaves the model's lower half dark.
    ready["thumbnail"].job =
        R"({"film":{"width":256,"height":256},"environment":{"preset":"tent"},)"
        R"("background":{"type":"transparent"},"stop":{"relative_error":0.05,"seconds":10}})";
    return ready;
  }();
  return kReady;
}

bool is_preset_name(std::string_view text) {
  constexpr std::size_t kCharactersMax = 64;
  const auto lights = core::environment_presets();
  return !text.empty() && text.size() <= kCharactersMax && core::is_word(text, "._-") &&
         std::none_of(lights.begin(), lights.end(),
                      [text](const auto& light) { return light.name == text; });
}

std::string signing_key_json(const SigningKeyView& key) {
  return dump(Json{{"id", key.id}, {"key", key.key}});
}

std::string signing_key_list_json(std::span<const SigningKeyRowView> keys) {
  Json list = Json::array();
  for (const SigningKeyRowView& key : keys) {
    list.push_back(
        {{"id", key.id}, {"tenant", key.tenant}, {"created_at", rfc3339(key.created_at)}});
  }
  return dump(Json{{"keys", std::move(list)}});
}

Parsed<PictureUrl> parse_picture_url(std::string_view scene, std::string_view view,
                                     QueryParams query) {
  PictureUrl url;
  Faults faults;
  const std::size_t colon = scene.find(':');
  url.scene = scene.substr(0, colon);
  if (colon != std::string_view::npos) {
    url.variant = std::string(scene.substr(colon + 1));
  }
  const std::size_t comma = view.find(',');
  const std::size_t point = view.rfind('.');
  if (comma == std::string_view::npos || point == std::string_view::npos || point < comma ||
      point + 1 == view.size()) {
    faults.add("/view", shown(Json(view)) + " is not THETA,PHI.FORMAT, such as 30,75.webp");
  } else {
    const auto angle = [&](std::string_view text, const Range& range) {
      return read_number(number_in_query(std::string(text)), range, "/view", faults).value_or(0);
    };
    url.theta_degrees =
        angle(view.substr(0, comma), {-limits::kAngleDegrees, limits::kAngleDegrees});
    url.phi_degrees = angle(view.substr(comma + 1, point - comma - 1), {0, limits::kPhiDegrees});
    url.format = view.substr(point + 1);
  }
  read_query(url_table(), query, url, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  return url;
}

Parsed<PictureJob> parse_picture_job(const Preset& preset, const PictureUrl& url) {
  RenderQuery settings;
  settings.theta_degrees = url.theta_degrees;
  settings.phi_degrees = url.phi_degrees;
  settings.variant = url.variant;
  const auto plain = parse_render_job(preset.job, settings, {.scene = url.scene});
  if (!plain) {
    return plain.problem();
  }
  const core::FilmSettings& film = plain->spec.render.film;
  const double aspect = static_cast<double>(film.width) / static_cast<double>(film.height);
  double width = film.width;
  double height = film.height;
  if (url.width || url.height) {
    width = url.pixel_ratio * url.width.value_or(url.height.value_or(0) * aspect);
    height = url.pixel_ratio * url.height.value_or(url.width.value_or(0) / aspect);
  } else {
    width *= url.pixel_ratio;
    height *= url.pixel_ratio;
  }
  if (std::max(width, height) > static_cast<double>(limits::kFilmSide)) {
    return make_problem(
        core::ErrorCode::kInvalidArgument,
        {{width > height ? "/w" : "/h",
          "the image would be larger than " + std::to_string(limits::kFilmSide) + " pixels"}});
  }
  const auto pixels = [](double side) { return static_cast<int>(std::max(std::round(side), 1.0)); };
  const std::array<int, 2> size = {pixels(width), pixels(height)};
  const bool is_listed =
      size == std::array{film.width, film.height} ||
      std::find(preset.sizes.begin(), preset.sizes.end(), size) != preset.sizes.end();
  settings.size = size;
  auto job = parse_render_job(preset.job, settings, {.scene = url.scene});
  if (!job) {
    return job.problem();
  }
  return PictureJob{.job = *std::move(job),
                    .is_size_listed = is_listed,
                    .is_view_listed = is_view_listed(preset, url)};
}

Parsed<Preset> parse_new_preset(std::string_view body) {
  auto preset = parse_preset(body);
  if (!preset) {
    return preset;
  }
  PictureUrl url;
  url.scene = kAnyScene;
  Faults faults;
  if (const auto made = parse_picture_job(*preset, url); !made) {
    for (const FieldError& error : made.problem().errors) {
      faults.add("/job" + error.pointer, "with the angles of a URL: " + error.detail);
    }
  }
  for (std::size_t i = 0; i < preset->sizes.size() && faults.empty(); ++i) {
    url.width = preset->sizes[i][0];
    url.height = preset->sizes[i][1];
    if (const auto made = parse_picture_job(*preset, url); !made) {
      faults.add("/sizes/" + std::to_string(i), made.problem().detail);
    }
  }
  return faults.empty() ? std::move(preset) : Parsed<Preset>(faults.problem());
}

void add_preset_schemas(Json& components) {
  components["PresetRequest"] =
      as_request(object_schema(preset_table(), Preset{}, "A job template for many images."));
  Json preset = object_schema(preset_table(), Preset{}, "A preset.");
  preset["properties"]["name"] = text_schema();
  preset["required"] = {"name", "job", "public", "sizes", "deadline_seconds", "turntable"};
  components["Preset"] = std::move(preset);
  const auto closed = [](std::string_view doc, Json properties) {
    Json schema = basic_schema("object", doc);
    for (const auto& each : properties.items()) {
      schema["required"].push_back(each.key());
    }
    schema["properties"] = std::move(properties);
    schema["additionalProperties"] = false;
    return schema;
  };
  const auto list_of = [](std::string_view name, std::string_view doc) {
    Json list = basic_schema("array", doc);
    list["items"] = {{"$ref", "#/components/schemas/" + std::string(name)}};
    return list;
  };
  components["PresetList"] =
      closed("All presets.", {{"presets", list_of("Preset", "Sorted by name.")}});
  Json text = text_schema();
  text["description"] = "Unpadded base64url of 32 random bytes, which is returned only once.";
  components["SigningKey"] =
      closed("A new signing key.", {{"id", text_schema()}, {"key", std::move(text)}});
  Json time = text_schema();
  time["format"] = "date-time";
  components["SigningKeyRow"] =
      closed("A signing key, without its text.",
             {{"id", text_schema()}, {"tenant", text_schema()}, {"created_at", std::move(time)}});
  components["SigningKeyList"] =
      closed("All signing keys.", {{"keys", list_of("SigningKeyRow", "Oldest first.")}});
}

Json picture_url_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(url_table(), PictureUrl{});
}

}  // namespace api
