/// Reads light profiles: IES LM-63-1986 to ANSI/IES LM-63-19.
///
/// The intensity is the file's candela times its multiplier, ballast factor and, up to LM-63-91,
/// the ballast's photometric factor. Horizontal angles of types A and B are clockwise, as in
/// EXT_lights_ies. Lumens, units, sizes and watts are parsed but ignored: the light is a point.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/lights/ies_profile.h"

namespace core {

/// Errors: kInvalidArgument with the line and the reason, without a location. A TILT other than
/// NONE, whose factors depend on the mounting of the luminaire, gives a warning.
Result<IesProfile> read_ies(std::string_view text, std::vector<std::string>& warnings);

}  // namespace core
