/// Converts a model on this machine, with the files beside it that it refers to.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/scene_io/convert.h"

namespace cli {

/// Errors: of read_file() and core::convert_to_glb().
core::Result<core::Converted> convert_model(const std::string& path,
                                            const core::Converters& converters);

}  // namespace cli
