/// Dispersion by formula, which no glTF extension has: members of a material's extras.
///
///   "ior_cauchy": [A, B, C]                                   A [1], B [um^2], C [um^4]
///   "ior_sellmeier": {"b": [B1, B2, B3], "c_um2": [C1, C2, C3]}   as in data sheets
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/color/ior_curve.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// The curve of a material's extras; IorFormula::kNone when they have none. where: JSON pointer of
/// the material. Refused are both members together, other shapes, values that are no 32-bit floats,
/// and an index outside of [1, 10000] at a visible wavelength.
Result<IorCurve> read_ior_curve(const tinygltf::Value& extras, const std::string& where);

}  // namespace core
