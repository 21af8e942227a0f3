/// Exposure and tone map of an image, where its format is linear and has none.
#pragma once

#include <optional>
#include <string>

#include "api/requests.h"
#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace server {

/// Returns kInvalidArgument at the parameter that a linear format cannot honour. Defaults, and a
/// tone map that changes nothing, are accepted. TIFF accepts all, since older versions of the web
/// page sent a look with it; ignored_look() reports what is ignored.
std::optional<core::Error> refused_look(const core::ImageFormat& format,
                                        const api::ImageQuery& query);

/// Returns the parameters ignored in this format, separated by commas, for X-Tessera-Ignored.
std::string ignored_look(const core::ImageFormat& format, const api::ImageQuery& query);

}  // namespace server
