#include "api/queries/look_rows.h"

#include <algorithm>
#include <string_view>

#include <nlohmann/json.hpp>

#include "api/job/job_rows.h"
#include "api/json/limits.h"
#include "api/json/values.h"
#include "core/layers/layer_rows.h"
#include "core/settings/choices.h"
#include "core/settings/light_shares.h"

namespace api {
namespace {

/// Short for "khronos-neutral".
constexpr std::string_view kNeutral = "neutral";

constexpr std::array kDenoiseShows = {
    core::NamedValue<DenoiseShow>{"off", DenoiseShow::kOff, "The plain image."},
    core::NamedValue<DenoiseShow>{
        "mixed", DenoiseShow::kMixed,
        "The denoised image, mixed with the plain one where that is better."},
    core::NamedValue<DenoiseShow>{"full", DenoiseShow::kFull, "The denoiser's own image."},
    core::NamedValue<DenoiseShow>{
        "video", DenoiseShow::kVideo,
        "The denoiser's own image, averaged with those of the frames before and after it in its "
        "batch along the motion of the surfaces, for videos that do not flicker. All three jobs "
        "must have ended."},
};

constexpr std::array kFireflies = {
    core::NamedValue<Fireflies>{"keep", Fireflies::kKeep, "All light as it was sampled."},
    core::NamedValue<Fireflies>{
        "set_aside", Fireflies::kSetAside,
        "No pixel of a half outshines itself in the other half and its eight neighbours."},
};

constexpr std::array kFirefliesNames = {kFireflies[0].name, kFireflies[1].name};

// As core::image_formats(), which would have to be linked into programs that only parse requests.
constexpr std::array<std::string_view, 7> kExtensions = {"png", "jpg", "webp", "avif",
                                                         "exr", "hdr", "tif"};

}  // namespace

void read_layer(const std::string& value, ImageReading& out, const std::string& pointer,
                Faults& faults) {
  if (core::find_layer(value) == nullptr && !core::light_share(value)) {
    faults.add(pointer, unknown_layer(Json(value)));
  }
  out.query.layer = value;
}

Json layer_parameter_schema(const ImageReading& /*defaults*/) { return layer_schema(); }

void read_tone_map(const std::string& value, ImageReading& out, const std::string& pointer,
                   Faults& faults) {
  if (out.has_curve) {
    faults.add(pointer, "is given twice: curve and tonemap are the same");
  }
  out.has_curve = true;
  const std::vector<std::string_view> names(out.tone_maps.begin(), out.tone_maps.end());
  if (std::find(names.begin(), names.end(), value) == names.end()) {
    faults.add(pointer, not_available(Json(value), names));
  }
  out.query.tone_map = value;
}

void read_curve(const std::string& value, ImageReading& out, const std::string& pointer,
                Faults& faults) {
  read_tone_map(value == kNeutral ? "khronos-neutral" : value, out, pointer, faults);
}

Json tone_map_schema(const ImageReading& defaults) {
  Json schema = text_schema();
  // Not "default", which generated clients send: then both names of the parameter would be given.
  schema["x-default"] = defaults.query.tone_map;
  if (!defaults.tone_maps.empty()) {
    schema["enum"] = defaults.tone_maps;
  }
  return schema;
}

Json curve_schema(const ImageReading& defaults) {
  Json schema = tone_map_schema(defaults);
  if (schema.contains("enum")) {
    schema["enum"].push_back(kNeutral);
  }
  return schema;
}

void read_exposure(const std::string& value, ImageReading& out, const std::string& pointer,
                   Faults& faults) {
  out.query.auto_exposure = value == "auto";
  if (out.query.auto_exposure) {
    return;
  }
  if (const auto stops =
          read_number(number_in_query(value), {-limits::kExposureStops, limits::kExposureStops},
                      pointer, faults)) {
    out.query.exposure_stops = static_cast<float>(*stops);
  }
}

Json exposure_schema(const ImageReading& defaults) {
  return {{"anyOf",
           {{{"type", "number"},
             {"minimum", -limits::kExposureStops},
             {"maximum", limits::kExposureStops}},
            {{"type", "string"}, {"enum", {"auto"}}}}},
          {"default", defaults.query.exposure_stops}};
}

void read_background(const std::string& value, ImageReading& out, const std::string& pointer,
                     Faults& faults) {
  out.query.background = read_color(value, pointer, faults);
}

Json background_schema(const ImageReading& /*defaults*/) {
  Json schema = text_schema();
  schema["pattern"] = "^[0-9A-Fa-f]{6}$";
  schema["example"] = "ffffff";
  return schema;
}

void read_fireflies(const std::string& value, ImageReading& out, const std::string& pointer,
                    Faults& faults) {
  for (const auto& choice : kFireflies) {
    if (choice.name == value) {
      out.query.fireflies = choice.value;
      return;
    }
  }
  faults.add(pointer, not_available(Json(value), kFirefliesNames));
}

Json fireflies_schema(const ImageReading& /*defaults*/) {
  return {{"type", "string"}, {"enum", kFirefliesNames}};
}

void read_extension(const std::string& text, std::string& out, const std::string& pointer,
                    Faults& faults) {
  if (std::find(kExtensions.begin(), kExtensions.end(), text) == kExtensions.end()) {
    faults.add(pointer, not_available(Json(text), kExtensions));
  }
  out = text;
}

Json extension_schema() { return {{"type", "string"}, {"enum", kExtensions}}; }

std::span<const core::NamedValue<DenoiseShow>> denoise_shows() { return kDenoiseShows; }
std::span<const core::NamedValue<Fireflies>> fireflies_choices() { return kFireflies; }

}  // namespace api
