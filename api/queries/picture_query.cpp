// Queries of images: of one job, and of all jobs of a batch.
#include <algorithm>
#include <array>
#include <limits>

#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/batch.h"
#include "api/job/job_rows.h"
#include "api/json/faults.h"
#include "api/json/limits.h"
#include "api/json/query_rows.h"
#include "api/json/schemas.h"
#include "api/json/values.h"
#include "api/requests.h"
#include "core/settings/registry.h"

namespace api {
namespace {

/// x, y, width and height must be given together; tone_maps are the allowed names.
struct ImageReading {
  ImageQuery query;
  std::array<std::optional<int>, 4> rect;
  std::vector<std::string> tone_maps;
};
constexpr std::array<std::string_view, 4> kRectNames = {"x", "y", "width", "height"};

std::optional<core::PixelRect> rect_of(const ImageReading& reading, Faults& faults) {
  const auto& parts = reading.rect;
  const auto is_given = [](const auto& part) { return part.has_value(); };
  if (std::none_of(parts.begin(), parts.end(), is_given) || !faults.empty()) {
    return {};
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i]) {
      faults.add("/" + std::string(kRectNames[i]),
                 "is required; x, y, width and height must be given together");
    }
  }
  if (!faults.empty()) {
    return {};
  }
  return core::PixelRect{*parts[0], *parts[1], *parts[2], *parts[3]};
}

template <std::size_t kPart>
constexpr auto rect_row(std::string_view doc) {
  constexpr Range kRange =
      kPart < 2 ? Range{0, limits::kFilmSide - 1} : Range{1, limits::kFilmSide};
  return number(
      kRectNames[kPart], [](auto& s) -> auto& { return s.rect[kPart]; }, kRange, doc);
}

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
  const std::vector<std::string_view> names(out.tone_maps.begin(), out.tone_maps.end());
  if (std::find(names.begin(), names.end(), value) == names.end()) {
    faults.add(pointer, not_available(Json(value), names));
  }
  out.query.tone_map = value;
}

Json tone_map_schema(const ImageReading& defaults) {
  Json schema = text_schema();
  schema["default"] = defaults.query.tone_map;
  if (!defaults.tone_maps.empty()) {
    schema["enum"] = defaults.tone_maps;
  }
  return schema;
}

// Reads "auto" or a number of stops.
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

// Reads numbers separated by commas.
void read_mix(const std::string& value, ImageReading& out, const std::string& pointer,
              Faults& faults) {
  out.query.mix.clear();
  for (std::size_t begin = 0; begin <= value.size();) {
    const std::size_t end = std::min(value.find(',', begin), value.size());
    const auto weight = read_number(number_in_query(value.substr(begin, end - begin)),
                                    {-limits::kMixWeight, limits::kMixWeight}, pointer, faults);
    if (!weight) {
      return;
    }
    out.query.mix.push_back(static_cast<float>(*weight));
    begin = end + 1;
  }
}

Json mix_schema(const ImageReading& /*defaults*/) {
  Json schema = text_schema();
  schema["example"] = "1,0.5,0";
  return schema;
}

// Reads "auto", or two numbers separated by a comma.
void read_range(const std::string& value, ImageReading& out, const std::string& pointer,
                Faults& faults) {
  if (value == "auto") {
    out.query.range = ImageRange{};
    return;
  }
  const auto comma = value.find(',');
  if (comma == std::string::npos) {
    faults.add(pointer,
               shown(Json(value)) + " is neither auto nor two numbers separated by a comma");
    return;
  }
  constexpr auto kMost = static_cast<double>(std::numeric_limits<float>::max());
  const auto low =
      read_number(number_in_query(value.substr(0, comma)), {-kMost, kMost}, pointer, faults);
  const auto high =
      read_number(number_in_query(value.substr(comma + 1)), {-kMost, kMost}, pointer, faults);
  if (!low || !high) {
    return;
  }
  const std::array<float, 2> ends = {static_cast<float>(*low), static_cast<float>(*high)};
  if (!(ends[0] < ends[1])) {
    faults.add(pointer, "the first number must be below the second");
    return;
  }
  out.query.range = ImageRange{ends};
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

Json range_schema(const ImageReading& /*defaults*/) {
  Json schema = text_schema();
  schema["example"] = "auto";
  return schema;
}

constexpr std::array kDenoiseShows = {
    core::NamedValue<DenoiseShow>{"off", DenoiseShow::kOff, "The plain image."},
    core::NamedValue<DenoiseShow>{
        "mixed", DenoiseShow::kMixed,
        "The denoised image, mixed with the plain one where that is better."},
    core::NamedValue<DenoiseShow>{"full", DenoiseShow::kFull, "The denoiser's own image."},
};

constexpr std::array kFireflies = {
    core::NamedValue<Fireflies>{"keep", Fireflies::kKeep, "All light as it was sampled."},
    core::NamedValue<Fireflies>{
        "set_aside", Fireflies::kSetAside,
        "No pixel of a half outshines itself in the other half and its eight neighbours."},
};

constexpr std::array kFirefliesNames = {kFireflies[0].name, kFireflies[1].name};

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

/// Rows that select the layer and its display.
constexpr auto look_rows() {
  return std::tuple{
      ParameterField<ImageReading>{"layer", "Beauty when absent (EXR: all layers).", &read_layer,
                                   &layer_parameter_schema},
      choice(
          "denoise", [](auto& s) -> auto& { return s.query.denoise; }, &denoise_shows,
          "off: the plain image. mixed: the denoised image, mixed with the plain one where that is "
          "better; it converges to the plain one. full: the denoiser's own image, which may stay "
          "biased. For beauty and the layers of denoised images, which show mixed if it is absent. "
          "X-Tessera-Error gives the error. While the job renders, an image may be a few revisions "
          "old: see X-Tessera-Revision."),
      ParameterField<ImageReading>{
          "fireflies",
          "set_aside: light that one half alone has found and that outshines all around it is "
          "scaled down to its neighbours, the default of png, jpg and webp; keep: the default of "
          "exr, hdr and tif. For beauty and light shares; denoised images are always made without "
          "fireflies. X-Tessera-Set-Aside gives the share of the light that was taken.",
          &read_fireflies, &fireflies_schema},
      ParameterField<ImageReading>{
          "exposure",
          "Stops, or auto: from the log-average luminance of the film's image, with at most a "
          "tenth "
          "of its pixels above white; in an archive or sheet that of the first image. "
          "X-Tessera-Exposure reports the value. Display formats only. Not for exr and hdr, which "
          "are linear: 422. tif also stays linear, which X-Tessera-Ignored reports.",
          &read_exposure, &exposure_schema},
      ParameterField<ImageReading>{"tonemap", "Display formats only, as with exposure.",
                                   &read_tone_map, &tone_map_schema},
      ParameterField<ImageReading>{
          "background",
          "Colour behind a transparent image, as six hexadecimal digits of sRGB; the image loses "
          "its alpha. If absent, formats without alpha (jpg, hdr) use white. Not for data layers.",
          &read_background, &background_schema},
  };
}

const auto& image_table() {
  static constexpr auto kTable = std::tuple_cat(
      look_rows(),
      std::tuple{
          ParameterField<ImageReading>{
              "range",
              "LOW,HIGH: values that are shown as black and white, or auto. For data layers in "
              "display formats; X-Tessera-Range reports the values used.",
              &read_range, &range_schema},
          ParameterField<ImageReading>{
              "mix",
              "Weights of the job's light shares (layers bounce:N, light:NAME, st:S,T) in their "
              "order, separated by commas: their weighted sum replaces the image. For beauty and "
              "error. The layers irradiance and st:S,T:unweighted are not part of the image and "
              "have no weight.",
              &read_mix, &mix_schema},
          number(
              "revision", [](auto& s) -> auto& { return s.query.revision; }, {0, kRevisionMax},
              "At least this revision; otherwise 409."),
          rect_row<0>("Left column of a part; x, y, width and height must be given together."),
          rect_row<1>("Top row of a part."),
          rect_row<2>("Width of a part."),
          rect_row<3>("Height of a part."),
          number(
              "max_size", [](auto& s) -> auto& { return s.query.max_size; }, {1, limits::kFilmSide},
              "Longest side of the image; larger images are scaled down."),
          flag(
              "parts", [](auto& s) -> auto& { return s.query.parts; },
              "1: an EXR of all layers has one part per layer, with its name; 0: one part, with "
              "channels LAYER.CHANNEL."),
          flag(
              "stream", [](auto& s) -> auto& { return s.query.stream; },
              "1, or Accept: multipart/x-mixed-replace without an image type: every new image "
              "until "
              "the end, for <img>."),
          ticket_row<ImageReading>(),
      });
  return kTable;
}

/// Query of the archive of a batch.
struct ArchiveReading : ImageReading {
  std::string format = BatchPicturesQuery{}.format;
};
// As core::image_formats(), which would have to be linked into programs that only parse requests.
constexpr std::array<std::string_view, 6> kExtensions = {"png", "jpg", "webp", "exr", "hdr", "tif"};

void read_extension(const std::string& text, ArchiveReading& out, const std::string& pointer,
                    Faults& faults) {
  if (std::find(kExtensions.begin(), kExtensions.end(), text) == kExtensions.end()) {
    faults.add(pointer, not_available(Json(text), kExtensions));
  }
  out.format = text;
}

const auto& archive_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{ParameterField<ArchiveReading>{
          "format", "Format of the images.", &read_extension,
          [](const ArchiveReading& defaults) {
            return Json{{"type", "string"}, {"enum", kExtensions}, {"default", defaults.format}};
          }}},
      look_rows());
  return kTable;
}

const auto& sheet_table() {
  static constexpr auto kTable = look_rows();
  return kTable;
}

template <typename Table>
Parsed<BatchPicturesQuery> parse_pictures_query(const Table& table, QueryParams query,
                                                std::span<const std::string> tone_maps) {
  ArchiveReading reading;
  reading.tone_maps.assign(tone_maps.begin(), tone_maps.end());
  Faults faults;
  read_query(table, query, reading, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  return BatchPicturesQuery{reading.format, reading.query};
}

}  // namespace

std::span<const core::NamedValue<DenoiseShow>> denoise_shows() { return kDenoiseShows; }
std::span<const core::NamedValue<Fireflies>> fireflies_choices() { return kFireflies; }

Parsed<ImageQuery> parse_image_query(QueryParams query, std::span<const std::string> tone_maps) {
  ImageReading reading;
  reading.tone_maps.assign(tone_maps.begin(), tone_maps.end());
  Faults faults;
  read_query(image_table(), query, reading, faults);
  reading.query.rect = rect_of(reading, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  return reading.query;
}
Parsed<BatchPicturesQuery> parse_archive_query(QueryParams query,
                                               std::span<const std::string> tone_maps) {
  return parse_pictures_query(archive_table(), query, tone_maps);
}
Parsed<BatchPicturesQuery> parse_sheet_query(QueryParams query,
                                             std::span<const std::string> tone_maps) {
  return parse_pictures_query(sheet_table(), query, tone_maps);
}

Json archive_parameters(const Capabilities& capabilities) {
  ArchiveReading defaults;
  defaults.tone_maps = capabilities.tone_maps;
  return query_parameters(archive_table(), defaults);
}
Json sheet_parameters(const Capabilities& capabilities) {
  ImageReading defaults;
  defaults.tone_maps = capabilities.tone_maps;
  return query_parameters(sheet_table(), defaults);
}
Json image_parameters(const Capabilities& capabilities) {
  ImageReading defaults;
  defaults.tone_maps = capabilities.tone_maps;
  return query_parameters(image_table(), defaults);
}

}  // namespace api
