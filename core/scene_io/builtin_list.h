/// The functions behind builtin_scenes(); one file each.
#pragma once

#include "core/scene_io/gltf_load.h"

namespace core {

Bytes make_still_life();
Bytes make_cornell_box();
Bytes make_furnace();
Bytes make_veach_mis();
Bytes make_many_lights();
Bytes make_glass();
Bytes make_interior();
Bytes make_keyhole();
Bytes make_caustic_pool();

}  // namespace core
