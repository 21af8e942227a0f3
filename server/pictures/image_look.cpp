#include "server/pictures/image_look.h"

#include <string_view>

namespace server {
namespace {

constexpr std::string_view kToldOnly = "tif";

/// The plain curves are accepted as well: they add no look to linear values.
bool has_tone_map(const api::ImageQuery& query) {
  return query.tone_map != api::ImageQuery().tone_map && query.tone_map != "linear" &&
         query.tone_map != "srgb";
}

std::string display_formats() {
  std::string list;
  for (const core::ImageFormat& format : core::image_formats()) {
    list +=
        format.high_dynamic_range ? "" : (list.empty() ? "" : ", ") + std::string(format.extension);
  }
  return list;
}

}  // namespace

std::string ignored_look(const core::ImageFormat& format, const api::ImageQuery& query) {
  if (!format.high_dynamic_range) {
    return "";
  }
  std::string names;
  const auto add = [&names](bool is_given, std::string_view name) {
    if (is_given) {
      names.append(names.empty() ? "" : ", ").append(name);
    }
  };
  add(query.exposure_stops != 0 || query.auto_exposure, "exposure");
  add(has_tone_map(query), "tonemap");
  add(query.white_balance_k.has_value(), "white_balance");
  add(query.contrast != 1, "contrast");
  return names;
}

std::optional<core::Error> refused_look(const core::ImageFormat& format,
                                        const api::ImageQuery& query) {
  if (query.bits != 8 && (query.bits != 16 || format.extension != "png")) {
    return core::Error{
        core::ErrorCode::kInvalidArgument,
        query.bits == 16 ? "." + std::string(format.extension) + " has no 16-bit integers; png does"
                         : "must be 8 or 16",
        "/bits"};
  }
  const std::string ignored = ignored_look(format, query);
  if (ignored.empty() || format.extension == kToldOnly) {
    return std::nullopt;
  }
  return core::Error{core::ErrorCode::kInvalidArgument,
                     "." + std::string(format.extension) + " is linear and takes none; " +
                         display_formats() + " do",
                     "/" + ignored.substr(0, ignored.find(','))};
}

}  // namespace server
