/// Photometric units.
#pragma once

namespace core {

/// Lumens per watt of nominal white. A radiance of 1 is 1 cd/m^2: candelas, lux and nits are taken
/// 1:1, and what is given in watts (the sun) times this. Source: SI, the luminous efficacy at 555
/// nm.
inline constexpr double kLumensPerWatt = 683;

}  // namespace core
