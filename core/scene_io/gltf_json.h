/// JSON helpers for the sources of core/scene_io. Not included by headers that others include.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace core {

using GltfJson = nlohmann::json;

}  // namespace core
