/// Presets of tenants, as routes use them.
#pragma once

#include <optional>
#include <string>

#include "api/presets.h"
#include "server/store/preset_table.h"

namespace server {

/// Returns the tenant's own preset of that name, or the ready one; empty: there is none. Problems:
/// those of the store; of parse_preset() for a preset that another version has stored.
api::Parsed<std::optional<api::Preset>> stored_preset(PresetTable& presets, std::string_view name,
                                                      const std::string& tenant);

}  // namespace server
