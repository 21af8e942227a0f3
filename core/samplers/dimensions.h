/// Which random number is for what. Numbers come in groups of four that are stratified together.
#pragma once

namespace core {

/// One group: film position and lens.
inline constexpr int kCameraGroup = 0;

/// Every bounce owns a block of groups of the same size, so a new use never shifts the old ones.
enum class BounceGroup {
  kLight,     ///< x: which light, y and z: where on it, w: Russian roulette
  kBsdf,      ///< x: lobe, y and z: direction, w: free
  kVolume,    ///< kept for media: distance, phase function
  kCount
};

constexpr int dimension_group(int bounce, BounceGroup group) {
  return 1 + bounce * static_cast<int>(BounceGroup::kCount) + static_cast<int>(group);
}

/// What options need beside the bounce's own groups. x: which of several light samples, y: whether its
/// shadow ray is traced, z and w: free. Far beyond the blocks of the deepest bounce.
constexpr int choice_group(int bounce) { return (1 << 20) + bounce; }

}  // namespace core
