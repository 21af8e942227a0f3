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
  std::string names = query.exposure_stops != 0 || query.auto_exposure ? "exposure" : "";
  if (has_tone_map(query)) {
    names += names.empty() ? "tonemap" : ", tonemap";
  }
  return names;
}

std::optional<core::Error> refused_look(const core::ImageFormat& format,
                                        const api::ImageQuery& query) {
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
