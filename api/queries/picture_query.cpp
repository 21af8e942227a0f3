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
#include "api/queries/look_rows.h"
#include "api/requests.h"

namespace api {
namespace {

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

Json range_schema(const ImageReading& /*defaults*/) {
  Json schema = text_schema();
  schema["example"] = "auto";
  return schema;
}

const auto& image_table() {
  static constexpr auto kTable = std::tuple_cat(
      layer_row(), look_rows(),
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
              "until the end, for <img>."),
          ticket_row<ImageReading>(),
      });
  return kTable;
}

/// Query of the archive of a batch.
struct ArchiveReading : ImageReading {
  std::string format = BatchPicturesQuery{}.format;
};
const auto& archive_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{ParameterField<ArchiveReading>{
          "format", "Format of the images.",
          [](const std::string& text, ArchiveReading& out, const std::string& pointer,
             Faults& faults) { read_extension(text, out.format, pointer, faults); },
          [](const ArchiveReading& defaults) {
            Json schema = extension_schema();
            schema["default"] = defaults.format;
            return schema;
          }}},
      layer_row(), look_rows());
  return kTable;
}

const auto& sheet_table() {
  static constexpr auto kTable = std::tuple_cat(layer_row(), look_rows());
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

std::string image_key(const ImageQuery& query) {
  // All members, so that a new one does not compile before it is part of the key.
  const auto& [layer, exposure_stops, auto_exposure, background, tone_map, white_balance_k,
               contrast, bits, range, revision, rect, max_size, denoise, mix, fireflies, parts,
               stream] = query;
  Json key = {layer ? Json(*layer) : Json(),
              exposure_stops,
              auto_exposure,
              tone_map,
              white_balance_k ? Json(*white_balance_k) : Json(),
              contrast,
              bits,
              static_cast<int>(denoise),
              mix,
              parts};
  key.push_back(background ? Json{background->r, background->g, background->b} : Json());
  key.push_back(range ? range->ends ? Json(*range->ends) : Json("auto") : Json());
  key.push_back(rect ? Json{rect->x, rect->y, rect->width, rect->height} : Json());
  key.push_back(max_size ? Json(*max_size) : Json());
  key.push_back(fireflies ? Json(static_cast<int>(*fireflies)) : Json());
  static_cast<void>(revision);  // the least one that is accepted
  static_cast<void>(stream);    // how images are sent
  return dump(key);
}

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
