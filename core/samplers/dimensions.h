/// Which random number is for what. Numbers come in groups of four that are stratified together.
#pragma once

namespace core {

/// One group: film position and lens.
inline constexpr int kCameraGroup = 0;

/// Every bounce owns a block of groups of the same size, so a new use never shifts the old ones.
enum class BounceGroup {
  kLight,   ///< x: which light, y and z: where on it, w: Russian roulette
  kBsdf,    ///< x: lobe, y and z: direction, w: delta lobe or not (strategies cosine and uniform)
  kVolume,  ///< w: hero wavelength at a dispersive boundary; x, y and z are free
  kCount
};

constexpr int dimension_group(int bounce, BounceGroup group) {
  return 1 + bounce * static_cast<int>(BounceGroup::kCount) + static_cast<int>(group);
}

/// Numbers for options, beside the bounce's own groups. x: which of several light candidates, y:
/// roulette of its shadow ray, z: which of the shared light samples, w: whether the light tree is
/// asked for the density of a neighbour's sample. Far beyond the blocks of the deepest bounce.
constexpr int choice_group(int bounce) { return (1 << 20) + bounce; }

}  // namespace core
