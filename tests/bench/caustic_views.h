/// Scenes with caustics of the kinds that products have, made in code.
#pragma once

#include <optional>
#include <string_view>

#include "core/render/picture/view.h"

namespace bench {

/// Returns `water`, a glass of water on a table in the sun; `ring`, of gold, likewise; `diamond`,
/// under a small lamp; or `ribbed`, a lamp behind ribbed glass. Empty: another name.
std::optional<core::View> caustic_view(std::string_view name, int width, int height);

}  // namespace bench
