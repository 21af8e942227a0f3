/// A textured hall of about 400,000 triangles under a constant sky: columns, vaults and a floor
/// with bumpy surfaces. Made in code; always identical.
#pragma once

#include "core/description/scene_description.h"

namespace bench {

core::SceneDescription hall();

}  // namespace bench
