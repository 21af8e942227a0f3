/// A textured hall of about 400,000 triangles under a constant sky: columns, vaults and a floor of
/// bumpy surfaces. Made in code; the same every time.
#pragma once

#include "core/description/scene_description.h"

namespace bench {

core::SceneDescription hall();

}  // namespace bench
