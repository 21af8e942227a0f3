/// Reads accessors: any component type, stride, normalisation, sparse substitution.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/base/result.h"
#include "core/math/vec.h"
#include "core/scene_io/gltf_source.h"

namespace core {

/// Returns accessor.count * shape.values() floats, matrices column by column. Normalised integers
/// are mapped to [0,1] or [-1,1] by the specification's formulas; other integers keep their value.
/// Errors at `where`: kInvalidArgument (also for non-finite values), kTooLarge. repairs: unless
/// null, non-finite values count as 0.
Result<std::vector<float>> read_floats(GltfSource& source, int accessor, const std::string& where,
                                       GltfRepairs* repairs = nullptr);

/// As above for unsigned integer accessors, without normalisation.
Result<std::vector<std::uint32_t>> read_integers(GltfSource& source, int accessor,
                                                 const std::string& where);

/// Lengths of unit vectors of 3 and of 4 values may differ from 1 by this much. Source: Khronos'
/// glTF-Validator, unitLengthThresholdVec3 and unitLengthThresholdVec4.
inline constexpr float kUnitTolerance3 = 0.00674F;
inline constexpr float kUnitTolerance4 = 0.00769F;

/// Returns how many of the vectors of `width` values, the first `counted` of which are their
/// length, are not unit vectors.
template <std::size_t width, std::size_t counted = width>
std::size_t others_than_unit(std::span<const float> values) {
  constexpr float kTolerance = counted == 3 ? kUnitTolerance3 : kUnitTolerance4;
  std::size_t others = 0;
  for (std::size_t i = 0; i + width <= values.size(); i += width) {
    float squares = 0;
    for (std::size_t k = 0; k < counted; ++k) {
      squares += values[i + k] * values[i + k];
    }
    others += std::fabs(std::sqrt(squares) - 1) <= kTolerance ? 0U : 1U;
  }
  return others;
}

/// Converts floats to Vec2, Vec3 or Vec4. Pre: floats.size() is a multiple of the vector's size.
template <typename V>
std::vector<V> to_vectors(std::span<const float> floats) {
  constexpr std::size_t kRows = sizeof(V) / sizeof(float);
  std::vector<V> vectors(floats.size() / kRows);
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    const float* f = floats.data() + i * kRows;
    if constexpr (std::is_same_v<V, Vec2>) {
      vectors[i] = {f[0], f[1]};
    } else if constexpr (std::is_same_v<V, Vec3>) {
      vectors[i] = {f[0], f[1], f[2]};
    } else {
      vectors[i] = {f[0], f[1], f[2], f[3]};
    }
  }
  return vectors;
}

/// Returns kInvalidArgument at `where` unless elements of the accessor have this shape.
Status check_shape(const GltfSource& source, int accessor, ElementShape shape,
                   const std::string& where);

}  // namespace core
