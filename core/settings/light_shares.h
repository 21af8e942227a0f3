/// Layers that are shares of the light, one per number or name instead of a row.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "core/settings/settings.h"

namespace core {

/// Layers without a row of their own, one per number or name.
struct LayerPattern {
  std::string_view name;
  std::string_view summary;
};
std::span<const LayerPattern> layer_patterns();
/// Parses a layer `bounce:N`, `bounce:N-` (N and more), `light:NAME`, `st:S,T`, `st:S,T:unweighted`
/// or `irradiance`; empty for other names.
std::optional<LightShare> light_share(std::string_view layer);

}  // namespace core
