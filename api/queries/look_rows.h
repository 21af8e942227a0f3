/// Rows of queries that choose how an image of a job is shown.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "api/json/faults.h"
#include "api/json/json.h"
#include "api/json/query_rows.h"
#include "api/queries/look_ranges.h"
#include "api/requests.h"

namespace api {

/// x, y, width and height must be given together; tone_maps are the allowed names.
struct ImageReading {
  ImageQuery query;
  std::array<std::optional<int>, 4> rect;
  std::vector<std::string> tone_maps;
  bool has_curve = false;
};

void read_layer(const std::string& value, ImageReading& out, const std::string& pointer,
                Faults& faults);
Json layer_parameter_schema(const ImageReading& defaults);
void read_curve(const std::string& value, ImageReading& out, const std::string& pointer,
                Faults& faults);
Json curve_schema(const ImageReading& defaults);
/// As read_curve(), without short names.
void read_tone_map(const std::string& value, ImageReading& out, const std::string& pointer,
                   Faults& faults);
Json tone_map_schema(const ImageReading& defaults);
/// Reads "auto" or a number of stops.
void read_exposure(const std::string& value, ImageReading& out, const std::string& pointer,
                   Faults& faults);
Json exposure_schema(const ImageReading& defaults);
void read_background(const std::string& value, ImageReading& out, const std::string& pointer,
                     Faults& faults);
Json background_schema(const ImageReading& defaults);
void read_fireflies(const std::string& value, ImageReading& out, const std::string& pointer,
                    Faults& faults);
Json fireflies_schema(const ImageReading& defaults);

/// Reads the extension of an image format.
void read_extension(const std::string& text, std::string& out, const std::string& pointer,
                    Faults& faults);
Json extension_schema();

constexpr auto layer_row() {
  return std::tuple{ParameterField<ImageReading>{"layer", "Beauty when absent (EXR: all layers).",
                                                 &read_layer, &layer_parameter_schema}};
}

/// Rows that select the display of the layer.
constexpr auto look_rows() {
  return std::tuple{
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
          "scaled down to its neighbours, the default of png, jpg, webp and avif; keep: the "
          "default of "
          "exr, hdr and tif. For beauty and light shares; denoised images are always made without "
          "fireflies. X-Tessera-Set-Aside gives the share of the light that was taken.",
          &read_fireflies, &fireflies_schema},
      ParameterField<ImageReading>{
          "exposure",
          "Stops, or auto: from the log-average luminance of the film's image, with at most a "
          "tenth of its pixels above white; in an archive or sheet that of the first image. "
          "X-Tessera-Exposure reports the value. Display formats only. Not for exr and hdr, which "
          "are linear: 422. tif also stays linear, which X-Tessera-Ignored reports.",
          &read_exposure, &exposure_schema},
      ParameterField<ImageReading>{"curve",
                                   "Tone curve: a name of `tone_maps`, or neutral for "
                                   "khronos-neutral. Display formats only, as with exposure.",
                                   &read_curve, &curve_schema},
      number(
          "white_balance", [](auto& s) -> auto& { return s.query.white_balance_k; },
          {kWhiteKelvin.min, kWhiteKelvin.max},
          "Colour temperature of the light that is shown as white, in kelvin: 2700 for lamps, 6500 "
          "changes next to nothing. By Bradford's adaptation. Display formats only, as exposure."),
      number(
          "contrast", [](auto& s) -> auto& { return s.query.contrast; },
          {kContrast.min, kContrast.max},
          "Stops that one stop of the scene becomes, about middle grey. Display formats only, as "
          "exposure."),
      number(
          "bits", [](auto& s) -> auto& { return s.query.bits; }, {8, 16},
          "Bits of each channel: 8 or 16. 16 only for png."),
      ParameterField<ImageReading>{"tonemap", "The same as curve.", &read_tone_map,
                                   &tone_map_schema},
      ParameterField<ImageReading>{
          "background",
          "Colour behind a transparent image, as six hexadecimal digits of sRGB; the image loses "
          "its alpha. If absent, formats without alpha (jpg, hdr) use white. Not for data layers.",
          &read_background, &background_schema},
  };
}

}  // namespace api
