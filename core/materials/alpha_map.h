/// has_alpha_map(): whether coverage varies with a texture.
#pragma once

#include "core/materials/material.h"

namespace core {

/// Returns whether coverage is read from the texture of the base colour.
inline bool has_alpha_map(const Material& m) noexcept {
  return m.has_alpha && m.base_color.texture != nullptr && !m.base_color.texture->is_opaque();
}

}  // namespace core
