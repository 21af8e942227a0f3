/// How a picture is to look, exposure and tone map, where the format is linear and has no look.
#pragma once

#include <optional>
#include <string>

#include "api/requests.h"
#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace server {

/// kInvalidArgument at the parameter that a linear format cannot honour. The defaults, and a tone
/// map that changes nothing, are no wish. TIFF is not refused, for who asks for it with the look of
/// a screen, as the page once did; ignored_look() tells.
std::optional<core::Error> refused_look(const core::ImageFormat& format,
                                        const api::ImageQuery& query);

/// The parameters that count for nothing in this format, with commas; for X-Tessera-Ignored.
std::string ignored_look(const core::ImageFormat& format, const api::ImageQuery& query);

}  // namespace server
