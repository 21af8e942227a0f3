/// JSON between the sources of core/scene_io. No header that others include reads this one.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace core {

using GltfJson = nlohmann::json;

}  // namespace core
