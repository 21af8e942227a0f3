/// Photometric units.
#pragma once

namespace core {

/// Lumens per watt of nominal white. A scene's candelas, nits and lux are taken 1:1, so that the
/// luminance of its irradiance is in lux. Source: SI, the luminous efficacy at 555 nm.
inline constexpr double kLumensPerWatt = 683;

}  // namespace core
