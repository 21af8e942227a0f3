/// A textured hall of about 400,000 triangles under a constant sky: columns, vaults and a floor
/// with bumpy surfaces. Made in code; always identical.
#pragma once

#include "core/description/scene_description.h"

namespace bench {

/// fineness: multiplies the triangles along each side; 2.34 gives two million.
core::SceneDescription hall(float fineness = 1);

}  // namespace bench
